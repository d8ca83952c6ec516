"""Plants from python-control and scipy, flown; gains, classes and set-points."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from channel.codec.signals import InputSignal, Signal, Signals
from receiver.controllers.base import ControllerContext
from tenbaud.audit.audit import audit
from tenbaud.build.given import reference_settings
from tenbaud.build.references import build_references
from tenbaud.config.load import load_config
from tenbaud.design.settings import settings_of
from tenbaud.design.systems import matrices
from tenbaud.errors import PartError
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay
from tests.tenbaud.flight.systems import NAMED, UNDISTURBED, A, B, C, flown, masses, pendulum


def system_of(kind: str) -> Any:
    import control
    import scipy.signal

    systems = {
        "control": control.ss(A, B, C, 0),
        "transfer function": scipy.signal.TransferFunction([1.0], [1.0, 0.5, 2.0]),
        "discrete": scipy.signal.StateSpace(A, B, C, [[0.0]]).to_discrete(0.01),
    }
    return systems[kind]


@pytest.mark.parametrize("system", ["control", "transfer function", "discrete"])
def test_when_a_system_is_flown_then_its_output_is_that_of_the_library(
    system: str, tmp_path: Path
) -> None:
    import control

    run = flown(system_of(system), tmp_path, reference=0.5, settings=UNDISTURBED)
    held = np.concatenate([run.values_of("input_1")[:-1], [0.0]])
    times = np.arange(len(held)) * 0.01
    expected = control.forced_response(control.c2d(control.ss(A, B, C, 0), 0.01), times, held)
    assert abs(expected.outputs - run.values_of("output_1")).max() < 1e-9
    assert run.summary["digest_checks"] == 40
    assert run.summary["desyncs"] == 0


def test_when_a_system_names_its_signals_then_the_run_has_these_names_and_units(tmp_path: Path) -> None:
    import control

    run = flown(control.ss(A, B, C, 0, **NAMED), tmp_path)
    assert {"angle", "estimate_rate", "motor"} <= set(run.names)
    assert (run.units["angle"], run.units["motor"], run.units["estimate_rate"]) == ("rad", "V", "rad/s")
    assert run.config.preset == "own"
    assert "reference" not in run.names, "without a reference no output follows anything"
    assert audit(tmp_path / "run").passed


@pytest.mark.parametrize(
    ("field", "value", "step", "right_is_exact"),
    [("left.counts_per_unit", 1e4, 1e-4, True), ("counts_per_turn", 1024, math.tau / 1024, False)],
)
def test_when_an_encoder_is_given_then_the_outputs_that_it_is_for_are_read_by_it(
    field: str, value: float, step: float, right_is_exact: bool, tmp_path: Path
) -> None:
    run = flown(masses(), tmp_path, settings={f"transmitter.encoders.{field}": value})
    counts = run.measured_left / step
    assert abs(counts - counts.round()).max() < 1e-6
    assert (run.measured_right == run.right).all() == right_is_exact


def test_when_coder_constants_are_given_then_they_are_flown(tmp_path: Path) -> None:
    import control

    coder = flown(control.ss(A, B, C, 0), tmp_path, settings={"coder.step": 0.9}).config.coder
    assert coder.model_dump()["step"] == 0.9


def test_when_a_run_is_moved_then_its_set_points_move_with_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import control

    monkeypatch.chdir(tmp_path)
    flown(control.ss(A, B, C, 0), Path("here"), reference=lambda t: 0.1 * t)
    Path("here").rename("there")
    assert replay(load_record(Path("there/run"))).equal
    assert audit(Path("there/run")).passed


@pytest.mark.parametrize(
    ("dt", "rate_baud", "over", "tick_s", "period_s", "bits"),
    [
        (0.0, None, {}, 0.01, 0.1, 1),
        (0.0, 30.0, {}, 0.008333334, 0.033333336, 1),
        (0.0, 0.5, {}, 0.01, 2.0, 1),
        (0.0, None, {"timing": {"tick_s": 0.02}, "coder": {"bits": 3}}, 0.02, 0.3, 3),
        (0.03, None, {}, 0.03, 0.12, 1),
        (0.5, None, {}, 0.5, 0.5, 5),
        (0.5, 40.0, {}, 0.5, 0.5, 15),
        (3.0, None, {}, 1.0, 2.0, 15),
        (0.0, 20.0, {"channel": {"rate_baud": 20}}, 0.01, 0.05, 1),
        (0.05, None, {"timing": {"tick_s": 0.01}}, 0.01, 0.1, 1),
    ],
)
def test_when_nothing_says_the_timing_then_it_follows_from_rate_and_step(
    dt: float,
    rate_baud: float | None,
    over: dict[str, Any],
    tick_s: float,
    period_s: float,
    bits: int,
) -> None:
    import control

    system = control.ss(A, B, C, 0)
    found = matrices(control.sample_system(system, dt) if dt else system)
    settings = settings_of(found, rate_baud, over)
    assert settings["timing"]["tick_s"] == pytest.approx(tick_s, abs=1e-12)
    assert settings["timing"]["symbol_period_s"] == pytest.approx(period_s, abs=1e-9)
    assert settings["coder"]["bits"] == bits
    assert bits / settings["timing"]["symbol_period_s"] <= settings["channel"]["rate_baud"]
    assert ("F" in settings["model"]) == (dt in (0.03, 0.5))


def test_when_a_system_is_not_linear_then_it_is_flown_as_it_is(tmp_path: Path) -> None:
    point = ([0.5, 0.0], [9.81 * math.sin(0.5)])
    run = flown(pendulum(), tmp_path, reference=0.55, operating_point=point)
    assert run.angle[0] == pytest.approx(0.5, abs=1e-3)
    assert run.angle[-100:].mean() == pytest.approx(0.55, abs=0.02)
    assert abs(run.error_live).max() < 0.03
    model = run.config.model.model_dump()
    assert model["A"][1] == pytest.approx((-9.81 * math.cos(0.5), -0.2))


def test_when_a_plant_is_not_linear_then_it_moves_as_its_equation_says(tmp_path: Path) -> None:
    import scipy.integrate

    settings = {**UNDISTURBED, "transmitter.plant.initial": 0.8}
    run = flown(pendulum(), tmp_path, settings=settings)
    state = np.array([0.8, 0.0])
    for tick in range(150):
        assert run.angle[tick] == pytest.approx(state[0], abs=1e-7)
        held = run.torque[tick]
        state = scipy.integrate.solve_ivp(
            lambda t, x, u=held: [x[1], -9.81 * math.sin(x[0]) - 0.2 * x[1] + u],
            (0.0, 0.01),
            state,
            rtol=1e-10,
            atol=1e-12,
        ).y[:, -1]


def test_when_a_preset_flies_another_plant_then_only_the_plant_is_exchanged(tmp_path: Path) -> None:
    import control

    falling = control.nlsys(
        lambda t, x, u, params: [x[1], 7.32**2 * math.sin(x[0]) + 4.0 * u[0]],
        lambda t, x, u, params: x[:1],
        inputs=1,
        outputs=1,
        states=2,
    )
    run = flown("pendulum-30baud", tmp_path, plant=falling)
    assert run.config.model.kind == "pendulum"
    assert 0.0 < abs(run.angle[-100:]).max() < 0.02


def discrete(kind: str) -> tuple[Any, Any]:
    """Return a motor in one of its forms, and what it is in steps of 0.01 s."""
    import control
    import scipy.signal

    motor = control.ss([[0.0, 1.0], [0.0, -4.0]], [[0.0], [4.0]], [[1.0, 0.0]], 0)
    stepped = control.c2d(motor, 0.01)
    forms = {
        "step of three ticks": control.sample_system(motor, 0.03),
        "scipy": scipy.signal.StateSpace(stepped.A, stepped.B, stepped.C, stepped.D, dt=0.01),
        "transfer function": scipy.signal.TransferFunction([4.0], [1.0, 4.0, 0.0]),
        "not linear": control.nlsys(
            lambda t, x, u, params: stepped.A @ x + stepped.B @ u,
            lambda t, x, u, params: x[:1],
            inputs=1,
            outputs=1,
            states=2,
            dt=0.01,
        ),
    }
    return forms[kind], stepped


@pytest.mark.parametrize("system", ["step of three ticks", "scipy", "transfer function", "not linear"])
def test_when_a_plant_is_discrete_then_it_moves_at_the_speed_of_its_own_time(
    system: str, tmp_path: Path
) -> None:
    import control

    plant, stepped = discrete(system)
    exact = {"transmitter.encoders.quantised": False}
    run = flown("servo-10baud", tmp_path, plant=plant, settings={**UNDISTURBED, **exact})
    held = np.concatenate([run.voltage[:-1], [0.0]])
    expected = control.forced_response(stepped, np.arange(len(held)) * 0.01, held)
    assert abs(expected.outputs).max() > 0.1
    assert abs(expected.outputs - run.angle).max() < 1e-9


class Law:
    """A controller of the context's set-point."""

    def __init__(self, context: ControllerContext) -> None:
        self.reference = context.reference

    def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
        return (8.0 * (self.reference.value(tick) - state[0]) - 3.0 * state[1] + 2.0 * state[0],)

    def references(self, tick: int) -> tuple[float | None, ...]:
        return (self.reference.value(tick),)


PID = {f"receiver.pid.{name}": value for name, value in (("proportional", 8.0), ("integral", 6.0))}


@pytest.mark.parametrize(
    ("controller", "settings"),
    [
        (None, {}),
        ([[6.0, 3.0]], {}),
        ([6.0, 3.0], {}),
        (Law, {}),
        ("pid", PID | {"receiver.pid.derivative": 4.0}),
    ],
    ids=["designed", "matrix", "row", "class", "pid"],
)
def test_when_a_controller_is_given_in_any_form_then_it_reaches_the_set_point(
    controller: Any, settings: dict[str, Any], tmp_path: Path
) -> None:
    import control

    given = {"duration_s": 12.0, **UNDISTURBED, **settings}
    run = flown(
        control.ss(A, B, C, 0, **NAMED), tmp_path, controller=controller, reference=0.4, settings=given
    )
    assert run.angle[-1] == pytest.approx(0.4, abs=0.02)


def test_when_an_object_controls_then_it_has_set_points_of_its_own(tmp_path: Path) -> None:
    import control

    class Own(Law):
        def __init__(self) -> None:
            pass

        def references(self, tick: int) -> tuple[float | None, ...]:
            return (0.1,)

        def command(self, tick: int, state: tuple[float, ...]) -> tuple[float, ...]:
            return (0.2,)

    system = control.ss(A, B, C, 0)
    assert flown(system, tmp_path, controller=Own()).reference[-1] == 0.1
    with pytest.raises(PartError, match="an object with set-points of its own"):
        flown(system, tmp_path / "again", controller=Own(), reference=1.0)


RAMP = np.linspace(0.0, 1.0, 400)


@pytest.mark.parametrize(
    ("reference", "left", "right"),
    [
        (0.5, 0.5, None),
        ([0.5, -0.2], 0.5, -0.2),
        (lambda t: (t, -t), 2.0, -2.0),
        (lambda t: t, 2.0, None),
        (np.column_stack([RAMP, -RAMP]), RAMP[200], -RAMP[200]),
        (([0.0, 1.5, 3.0], [[0.0, 0.1], [1.0, 0.2], [2.0, 0.3]]), 1.0, 0.2),
        ({"right": 0.3}, 0.0, 0.3),
        ({"left": RAMP, "right": lambda t: 2.0 * t}, RAMP[200], 4.0),
        ({"left": {"kind": "square", "amplitude": 0.5, "period_s": 3.0}, "right": -1.0}, -0.5, -1.0),
        ({"kind": "sine", "amplitude": 0.5, "period_s": 8.0}, 0.5, None),
        ({"right": {"kind": "step", "amplitude": 0.7, "start_s": 1.99}}, 0.0, 0.7),
    ],
)
def test_when_set_points_are_given_in_any_form_then_each_output_follows_its_own(
    reference: Any, left: float, right: float | None, tmp_path: Path
) -> None:
    outputs = (Signal("left", "m"), Signal("right", "m"))
    section = reference_settings(reference, outputs, 400, 0.01, tmp_path / "set.csv")
    config = load_config("own", None, {"receiver": {"reference": {"amplitude": 0.0, **section}}})
    signals = Signals(outputs, (InputSignal("push"),), outputs)
    first, second = build_references(config, signals)
    assert first is not None
    assert first.value(200) == pytest.approx(left, abs=1e-9)
    assert (None if second is None else second.value(200)) == (right and pytest.approx(right, abs=1e-9))


@pytest.mark.parametrize(
    ("given", "travel", "elevation"),
    [
        ({"elevation": 0.1}, 0.4, 0.1),
        ({"elevation": {"amplitude": 0.0}}, 0.4, math.radians(10.0)),
        ({"kind": "constant", "amplitude": 0.3}, 0.3, 0.1 + math.radians(10.0)),
    ],
)
def test_when_a_set_point_replaces_that_of_a_preset_then_nothing_of_it_stays(
    given: dict[str, Any], travel: float, elevation: float, tmp_path: Path
) -> None:
    run = flown("helicopter-10baud", tmp_path, reference=given, settings={"duration_s": 0.5})
    assert run.reference_travel[0] == travel
    assert run.reference_elevation[0] == pytest.approx(elevation, abs=1e-12)


def test_when_two_processes_fly_it_then_values_over_time_reach_both(tmp_path: Path) -> None:
    run = flown(masses(), tmp_path, reference=lambda t: 0.1 * t, link="zenoh")
    assert run.reference_left[-1] == pytest.approx(0.1 * run.time_s[-1])
    assert run.summary["link"] == "zenoh"
    assert run.summary["outputs"]["left"]["tracking_rms"] > 0.0


def test_when_a_run_is_plotted_then_every_output_and_input_has_a_panel(tmp_path: Path) -> None:
    figure: Any = flown(masses(), tmp_path, reference=[0.5, -0.2]).plot(tmp_path / "flight.png")
    labels = " ".join(panel.get_ylabel() for panel in figure.axes)
    for word in ("left", "right", "input 1", "error", "range", "bits"):
        assert word in labels
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert (tmp_path / "flight.png").stat().st_size > 10_000
