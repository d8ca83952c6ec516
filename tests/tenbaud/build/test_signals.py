"""What a configuration gives for the inputs and outputs of its model, and which errors it gets."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from channel.codec.codec import Vector
from channel.codec.signals import InputSignal, Signal, Signals
from plant_sim.encoder import Encoder, ExactReader
from receiver.controllers.pid import PidLoops
from receiver.controllers.state_feedback import StateFeedback
from tenbaud.build.controllers import build_controller
from tenbaud.build.flight import agree
from tenbaud.build.parts import Parts
from tenbaud.build.references import build_references, values_of
from tenbaud.build.rig import build_axes, build_motors
from tenbaud.build.signals import build_encoders, build_limits, soft_limits
from tenbaud.config.load import ConfigError, load_config, nested
from tenbaud.config.schema import FlightConfig

TICK_S = 0.01
CART = Signals(
    states=(
        Signal("position", "m"),
        Signal("tilt", "rad"),
        Signal("position_rate", "m/s"),
        Signal("tilt_rate", "rad/s"),
    ),
    inputs=(InputSignal("force", "N", -20.0, 20.0), InputSignal("brake", "%", -100.0, 100.0, "", 100)),
    outputs=(Signal("position", "m", -2.0, 2.0), Signal("tilt", "rad")),
)


class Cart:
    """Two double integrators, each with an input of its own."""

    state_size, correction_size, input_size = 4, 4, 2
    signals = CART

    def initial(self) -> Vector:
        return (0.0,) * 4

    def measured(self, state: Vector) -> Vector:
        return state[:2]

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        x, a, v, w = state
        return (
            x + TICK_S * v,
            a + TICK_S * w,
            v + TICK_S * (command[0] + held[2]),
            w + TICK_S * (0.1 * command[1] + held[3]),
        )


def own(**settings: Any) -> FlightConfig:
    dotted = {name.replace("__", "."): value for name, value in settings.items()}
    return load_config("tuned-10baud", None, nested(dotted))


def test_limits_are_one_for_all_or_one_for_each_or_the_ranges() -> None:
    limits = build_limits(own(limits__command_max=[3.0, 50.0]), CART)
    assert limits.command_max == (3.0, 50.0)
    assert build_limits(own(), CART).command_max == (20.0, 100.0)
    assert limits.slew_per_tick == (10.0, 10.0)


def test_soft_limits_are_given_by_name_too() -> None:
    assert soft_limits(own(transmitter__soft_limits={"tilt": 0.5}), CART) == (math.inf, 0.5)
    assert soft_limits(own(transmitter__soft_limits=0.5), CART) == (0.5, 0.5)
    assert soft_limits(own(), CART) == (math.inf, math.inf)


def test_an_encoder_counts_turns_of_an_angle_and_units_of_anything_else() -> None:
    position, tilt = build_encoders(own(), CART)
    assert (position, tilt) == (ExactReader(), Encoder(4096))
    changes = {"position": {"counts_per_unit": 2000.0}, "sign": -1, "counts_per_turn": 360}
    position, tilt = build_encoders(own(transmitter__encoders=changes), CART)
    assert position.read(0.10026) == (201, pytest.approx(0.1005))
    assert tilt == Encoder(360, -1)
    off = own(transmitter__encoders__quantised=False)
    assert build_encoders(off, CART)[1].read(0.123) == (math.floor(0.123 * 2**40), 0.123)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"limits__command_max": [1.0, 2.0, 3.0]}, r"3 values; the plant has 2 input.*force, brake"),
        ({"limits__command_max": [40.0, 1.0]}, r"input force is 40 N.*at most 32\.767"),
        ({"limits__command_max": [1.0, 400.0]}, r"input brake is 400 %.*at most 327\.67"),
    ],
)
def test_limits_that_do_not_fit_name_the_input(settings: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        build_limits(own(**settings), CART)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"transmitter__soft_limits": [1.0]}, r"1 values, and the plant 2 output.*position, tilt"),
        ({"transmitter__soft_limits": {"pitch": 1.0}}, r"soft_limits\.pitch: .* position, tilt"),
    ],
)
def test_soft_limits_that_do_not_fit_name_the_outputs(settings: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        soft_limits(own(**settings), CART)


@pytest.mark.parametrize(
    ("section", "text"),
    [
        ({"pitch": {"sign": -1}}, r"encoders\.pitch: the plant's output\(s\) are position, tilt"),
        ({"position": {"counts_per_turn": 100}}, "output position is in m, which has no turns"),
        ({"tilt": {"counts_per_turn": 8, "counts_per_unit": 8.0}}, "not both"),
    ],
)
def test_encoders_that_contradict_the_output_name_it(section: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        build_encoders(own(transmitter__encoders=section), CART)


def test_an_unknown_field_is_not_taken_for_a_name() -> None:
    with pytest.raises(ConfigError, match=r"encoders\.counts_per_trun: unknown field; did you mean"):
        own(transmitter__encoders__counts_per_trun=100)


def test_each_output_has_a_set_point_of_its_own(tmp_path: Path) -> None:
    table = tmp_path / "tilt.csv"
    table.write_text("time_s,tilt_rad\n0,0.1\n1,0.2\n")
    settings = {"kind": "step", "amplitude": 0.5, "start_s": 1.0}
    both = own(receiver__reference=settings | {"tilt": {"kind": "csv", "file": str(table)}})
    values = values_of(build_references(both, CART))
    assert (values(0), values(100)) == ((0.0, 0.1), (0.5, 0.2))
    assert values_of(build_references(own(receiver__reference=settings), CART))(100) == (0.5, None)
    with pytest.raises(ConfigError, match=r"receiver\.reference\.yaw: .* position, tilt"):
        build_references(own(receiver__reference={"yaw": {"kind": "constant"}}), CART)


def test_the_slowest_set_point_says_where_errors_begin_to_count() -> None:
    slow = {"period_s": 10.0, "tilt": {"kind": "sine", "period_s": 30.0, "amplitude": 0.1}}
    config = own(receiver__reference=slow, limits__command_max=1.0)
    agreement = agree(config, "virtual", Parts(model=Cart(), coder=Signs()))
    assert agreement.window_start_tick == 3000


class Signs:
    """A coder of two signs, so that the model of two outputs makes a codec."""

    impulse, uses_rates = True, False

    def __init__(self) -> None:
        from channel.codec.codec import Alphabet

        self.alphabet = Alphabet((-1, 1), 1)

    def initial(self) -> Vector:
        return ()

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        return (1 if measurement[0] >= predicted[0] else -1,)

    def decode(self, coder: Vector, state: Vector, word: Any) -> tuple[Vector, Vector]:
        return (0.01 * word[0] if word else 0.0, 0.0, 0.0, 0.0), ()

    def ranges(self, coder: Vector) -> Vector:
        return (0.01, 0.01)


def test_pid_loops_steer_any_output_by_any_inputs() -> None:
    loops = [
        {"output": "position", "inputs": {"force": 1.0}, "proportional": 2.0},
        {"output": "tilt", "inputs": {"brake": -1.0}, "proportional": 1.0, "unit": "%/deg"},
    ]
    config = own(receiver__pid__loops=loops, receiver__reference={"kind": "constant", "amplitude": 1.0})
    law = build_controller(config, model=Cart())
    assert isinstance(law, PidLoops)
    assert law.references(0) == (1.0, 0.0)
    force, brake = law.command(0, (0.25, math.radians(3.0), 0.0, 0.0))
    assert (force, brake) == (pytest.approx(1.5), pytest.approx(3.0))


@pytest.mark.parametrize(
    ("pid", "text"),
    [
        ({"loops": [{"output": "yaw"}]}, r"loops\.0: 'yaw' is none of the outputs: position, tilt"),
        ({"loops": [{"inputs": {"motor": 1.0}}]}, "'motor' is none of the inputs: force, brake"),
        ({"loops": [{"unit": "V/m"}]}, r"unit = 'V/m', and the input is in N.*give 'N/m'"),
        ({"unit": "N/rad"}, "'N/rad'; it must be per m"),
        ({"loops": [{"rate": "speed"}]}, "'speed' is none of the states"),
        ({"loops": [{}, {}]}, "two of them steer the output position"),
    ],
)
def test_loops_that_do_not_fit_name_the_signal(pid: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        build_controller(own(receiver__pid=pid), model=Cart())


def feedback(**section: Any) -> Iterator[Any]:
    settings: dict[str, Any] = {"receiver__controller": "state_feedback"}
    settings |= {f"receiver__state_feedback__{name}": value for name, value in section.items()}
    reference = {"kind": "constant", "amplitude": 0.2, "tilt": {"kind": "constant", "amplitude": -0.1}}
    yield build_controller(own(receiver__reference=reference, **settings), model=Cart())


@pytest.mark.parametrize("integral", [{}, {"position": 2.0, "tilt": 1.0}])
def test_a_designed_feedback_brings_every_output_to_its_set_point(integral: dict[str, float]) -> None:
    (law,) = feedback(integral_weights=integral, state_weights={"position": 1.0, "tilt": 1.0})
    assert isinstance(law, StateFeedback)
    model, state = Cart(), (0.0,) * 4
    push = (0.5, 0.0) if integral else (0.0, 0.0)
    for tick in range(6000):
        wanted = law.command(tick, state)
        moved = tuple(value + more for value, more in zip(wanted, push, strict=True))
        state = model.tick(state, moved, (0.0,) * 4)
    assert law.references(0) == (0.2, -0.1)
    assert model.measured(state) == pytest.approx((0.2, -0.1), abs=1e-3)


def test_an_integral_rests_while_its_inputs_are_at_their_limits() -> None:
    (law,) = feedback(integral_weights={"position": 5.0})
    for tick in range(200):
        law.command(tick, (-50.0, 0.0, 0.0, 0.0))
    assert law.integrals == [0.0, 0.0]
    law.command(200, (0.1, -0.1, 0.0, 0.0))
    assert law.integrals[0] > 0.0


@pytest.mark.parametrize(
    ("section", "text"),
    [
        ({"gains": [[1.0, 2.0]]}, r"gains has 1 row.*2 input\(s\), a row each, and a row needs 4"),
        ({"state_weights": {"yaw": 1.0}}, r"state_weights\.yaw: .*position, tilt, position_rate"),
        ({"input_weights": {"motor": 1.0}}, r"input_weights\.motor: .*force, brake"),
        ({"integral_weights": {"tilt_rate": 1.0}}, r"integral_weights\.tilt_rate: .*position, tilt"),
    ],
)
def test_a_feedback_that_does_not_fit_names_the_signal(section: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        next(feedback(**section))


def test_a_motion_out_of_reach_is_refused_with_its_state() -> None:
    class Loose(Cart):
        def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
            return super().tick(state, (command[0], 0.0), held)

    config = own(receiver__controller="state_feedback")
    with pytest.raises(
        ConfigError, match=r"eigenvalue 1 per tick, mostly of tilt_rate: .* controllable"
    ):
        build_controller(config, model=Loose())


def test_a_rig_is_wired_by_the_names_of_its_signals() -> None:
    bridge = {
        "axes": ["tilt", "spare", "position"],
        "position": {"counts_per_unit": 1000.0, "channel": 4},
        "motors": {"brake": {"channel": 3, "sign": -1, "scale": 0.1}},
    }
    config = own(transmitter__bridge=bridge)
    tilt, spare, position = build_axes(config, CART)
    assert [(one.name, one.channel) for one in (tilt, spare, position)] == [
        ("tilt", 0),
        ("spare", 1),
        ("position", 4),
    ]
    assert position.encoder((0,) * 5).angle_rad(500) == 0.5
    motors = build_motors(config, CART, 2)
    assert motors.to_device((2.0, 50.0)) == (2.0, 0.0, 0.0, -5.0)


@pytest.mark.parametrize(
    ("bridge", "text"),
    [
        ({"axes": ["tilt"]}, "position must be among them"),
        ({"axes": ["tilt", "position"]}, "position: the output is in m, which has no turns"),
    ],
)
def test_a_wiring_that_does_not_fit_names_the_output(bridge: dict[str, Any], text: str) -> None:
    with pytest.raises(ConfigError, match=text):
        build_axes(own(transmitter__bridge=bridge), CART)


def test_motors_of_no_input_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"motors\.front: the plant's input\(s\) are force, brake"):
        build_motors(own(transmitter__bridge__motors={"front": {"channel": 1}}), CART, 2)
    with pytest.raises(ConfigError, match="the inputs force, brake are on the outputs"):
        build_motors(own(transmitter__bridge__motors={"channels": [1, 1]}), CART, 2)
