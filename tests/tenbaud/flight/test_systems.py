"""Plants from python-control and scipy, flown and refused; gains, classes and set-points."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import scipy.integrate
import scipy.signal

from channel.codec.signals import InputSignal, Signal, Signals
from receiver.controllers.base import ControllerContext
from tenbaud import Run, fly
from tenbaud.audit.audit import audit
from tenbaud.build.given import reference_settings
from tenbaud.build.references import build_references
from tenbaud.config.load import load_config
from tenbaud.design.settings import settings_of
from tenbaud.design.systems import matrices
from tenbaud.errors import ConfigError, PartError

A, B, C = [[0.0, 1.0], [-2.0, -0.5]], [[0.0], [1.0]], [[1.0, 0.0]]
SECONDS = 4.0
NAMED = {
    "states": ["Angle [rad]", "rate (rad/s)"],
    "inputs": ["motor, V"],
    "outputs": ["angle [rad]"],
}
UNDISTURBED = {"transmitter.plant.disturbance": ""}


def flown(system: Any, folder: Path, **given: Any) -> Run:
    settings = {"duration_s": SECONDS, **given.pop("settings", {})}
    return fly(system, settings=settings, out=folder / "run", **given)


def pendulum(gravity: float = 9.81, drift: float = 0.0) -> Any:
    """A pendulum that hangs, with friction; `drift` turns its gravity with time."""

    def dynamics(t: float, x: Any, u: Any, params: Any) -> list[float]:
        return [x[1], -gravity * math.sin(x[0] + drift * t) - 0.2 * x[1] + u[0]]

    signals = {
        "inputs": ["torque [N m]"],
        "outputs": ["angle [rad]"],
        "states": ["angle [rad]", "rate"],
    }
    return control.nlsys(dynamics, lambda t, x, u, params: x[:1], **signals)


@pytest.mark.parametrize(
    "system",
    [
        control.ss(A, B, C, 0),
        scipy.signal.TransferFunction([1.0], [1.0, 0.5, 2.0]),
        scipy.signal.StateSpace(A, B, C, [[0.0]]).to_discrete(0.01),
    ],
    ids=["control", "transfer function", "discrete"],
)
def test_when_a_system_is_flown_then_its_output_is_that_of_the_library(
    system: Any, tmp_path: Path
) -> None:
    run = flown(system, tmp_path, reference=0.5, settings=UNDISTURBED)
    held = np.concatenate([run.values_of("input_1")[:-1], [0.0]])
    times = np.arange(len(held)) * 0.01
    expected = control.forced_response(control.c2d(control.ss(A, B, C, 0), 0.01), times, held)
    assert abs(expected.outputs - run.values_of("output_1")).max() < 1e-9
    assert run.summary["digest_checks"] == 40
    assert run.summary["desyncs"] == 0


def test_when_a_system_names_its_signals_then_the_run_has_these_names_and_units(tmp_path: Path) -> None:
    run = flown(control.ss(A, B, C, 0, **NAMED), tmp_path)
    assert {"angle", "estimate_rate", "motor"} <= set(run.names)
    assert (run.units["angle"], run.units["motor"], run.units["estimate_rate"]) == ("rad", "V", "rad/s")
    assert run.config.preset == "own"
    assert "reference" not in run.names, "without a reference no output follows anything"
    assert audit(tmp_path / "run").passed


@pytest.mark.parametrize(
    ("dt", "rate_baud", "over", "tick_s", "period_s", "bits"),
    [
        (0.0, None, {}, 0.01, 0.1, 1),
        (0.0, 30.0, {}, 0.008333334, 0.033333336, 1),
        (0.0, 0.5, {}, 0.01, 2.0, 1),
        (0.0, None, {"timing": {"tick_s": 0.02}, "coder": {"bits": 3}}, 0.02, 0.3, 3),
        (0.03, None, {}, 0.03, 0.12, 1),
        (0.5, None, {}, 0.5, 0.5, 5),
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


@pytest.mark.parametrize(
    ("system", "given", "text"),
    [
        (
            control.ss(A, B, C, [[0.5]], **NAMED),
            {},
            r"D is not zero: output angle \[rad\] has 0\.5 of inp",
        ),
        (control.ss(A, B, C, 0, True), {}, "discrete and its dt is not given"),
        (control.ss([], [], [], [[1.0]]), {}, "no states"),
        (control.ss(A, B, C, 0, states=["a", "a"]), {}, r"2 state\(s\) and names 1: a"),
        (control.ss(A, B, C, 0, states=["a b", "A_b"]), {}, "states: a_b is named twice"),
        (control.ss(A, B, C, 0, states=["a!", "b"]), {}, "'a!' is no name of a signal"),
        (
            control.ss(A, B, C, 0, states=["a [rad]", "b"], outputs=["y [deg]"]),
            {},
            "units contradict: the output y is the state a, and they are in deg and rad",
        ),
        (
            control.ss([[0.0, 1.0], [0.0, -1.0]], B, [[0.0, 1.0]], 0),
            {},
            r"eigenvalue 0 1/s, mostly of state_1, .*\(A, C\) is not observable",
        ),
        (
            control.ss([[1.0, 0.0], [0.0, -1.0]], B, [[1.0, 1.0]], 0, states=["up", "down"]),
            {},
            r"eigenvalue 1 1/s, mostly of up, .*\(A, G\) is not controllable",
        ),
        (
            control.ss([[1.0, 0.0], [0.0, -1.0]], B, [[1.0, 1.0]], 0, states=["up", "down"]),
            {"settings": {"model.G": [[1.0], [1.0]], "model.densities": [1e-3]}},
            r"eigenvalue 1\.01\d+ per tick, mostly of up: the pair \(A, B\) is not controllable",
        ),
        (
            control.ss([[0.0, 1.0], [53.6, 0.0]], B, C, 0, states=["angle", "rate"]),
            {},
            r"10 bit/s are too few: .* rate fastest by 7\.321 1/s, .*more than 10\.56 bit/s",
        ),
        (
            control.sample_system(control.ss(A, B, C, 0), 0.05),
            {"settings": {"timing.tick_s": 0.02}},
            r"dt = 0\.05 s .* is 2\.5 ticks of timing\.tick_s = 0\.02 s",
        ),
        (pendulum(drift=0.1), {}, r"not autonomous: d/dt of state rate is .* at 0 s and .* at 0\.37 s"),
        (
            pendulum(),
            {"operating_point": ([0.5, 0.0], [0.0])},
            r"no rest: state rate moves by -4\.70316 a second",
        ),
        (pendulum(), {"operating_point": ([0.5], [0.0])}, r"states \[0\.5\]; 2 finite numbers"),
        (pendulum(), {"operating_point": 3.0}, "must be a pair"),
        (control.ss(A, B, C, 0), {"operating_point": ([0, 0], [0])}, "this one has matrices"),
        (control.ss(A, B, C, 0), {"controller": [[1.0, 2.0, 3.0]]}, "1 row.* of 3 .* a row needs 2"),
        (
            control.ss(A, B, C, 0),
            {"controller": [-1.0, -2.0]},
            r"do not hold the plant: .* factor 1\.00\d+ per tick, mostly of state_1",
        ),
        (
            control.ss(A, B, C, 0),
            {"controller": {"k": 1.0}},
            "dict. is no controller: it has no method",
        ),
        (control.ss(A, B, C, 0), {"reference": "up"}, "reference: could not convert"),
        (control.ss(A, B, C, 0), {"reference": {"yaw": 1.0}}, "'yaw' is none of the outputs: output_1"),
        (
            control.ss(A, B, C, 0),
            {"reference": ([0, 1], [1.0])},
            "2 rising times are needed for 1 rows",
        ),
        (
            control.ss(A, B, C, 0),
            {"reference": np.zeros((9, 2))},
            "2 values at a time, and there are 1 output",
        ),
        (
            control.ss(A, B, C, 0),
            {"reference": lambda t: math.nan if t > 1.0 else 0.0},
            r"reference of output_1 is nan at 1\.01 s",
        ),
        ("tuned-10baud", {"rate_baud": 20.0}, "a preset says them itself"),
        (3.0, {}, "a float is neither the name of a preset nor a plant"),
    ],
)
def test_when_a_plant_cannot_be_flown_then_the_error_names_signal_and_number(
    system: Any, given: dict[str, Any], text: str, tmp_path: Path
) -> None:
    with pytest.raises(ConfigError, match=text):
        flown(system, tmp_path, **given)
    assert not (tmp_path / "run").exists()


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
    given = {"duration_s": 12.0, **UNDISTURBED, **settings}
    run = flown(
        control.ss(A, B, C, 0, **NAMED), tmp_path, controller=controller, reference=0.4, settings=given
    )
    assert run.angle[-1] == pytest.approx(0.4, abs=0.02)


def test_when_an_object_controls_then_it_has_set_points_of_its_own(tmp_path: Path) -> None:
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


MASSES = control.ss(
    [[0, 1, 0, 0], [-3, -1, 1, 0], [0, 0, 0, 1], [1, 0, -3, -1]],
    [[0, 0], [1, 0], [0, 0], [0, 1]],
    [[1, 0, 0, 0], [0, 0, 1, 0]],
    0,
    states=["left", "left_rate", "right", "right_rate"],
)
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


def test_when_two_processes_fly_it_then_values_over_time_reach_both(tmp_path: Path) -> None:
    run = flown(MASSES, tmp_path, reference=lambda t: 0.1 * t, link="zenoh")
    assert run.reference_left[-1] == pytest.approx(0.1 * run.time_s[-1])
    assert run.summary["link"] == "zenoh"
    assert run.summary["outputs"]["left"]["tracking_rms"] > 0.0


def test_when_a_run_is_plotted_then_every_output_and_input_has_a_panel(tmp_path: Path) -> None:
    figure: Any = flown(MASSES, tmp_path, reference=[0.5, -0.2]).plot(tmp_path / "flight.png")
    labels = " ".join(panel.get_ylabel() for panel in figure.axes)
    for word in ("left", "right", "input 1", "error", "range", "bits"):
        assert word in labels
    assert figure._repr_png_().startswith(b"\x89PNG")
    assert (tmp_path / "flight.png").stat().st_size > 10_000
