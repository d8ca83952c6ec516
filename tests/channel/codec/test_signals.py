"""The description of a plant's signals: names, units, ranges, and what is refused."""

from __future__ import annotations

import pytest

from channel.codec.models.hold import HoldModel
from channel.codec.models.pitch import PitchModel, PitchParameters
from channel.codec.signals import InputSignal, Signal, Signals, signals_of, unit_suffix


class Cart:
    """A model from outside that names nothing."""

    state_size = 2
    input_size = 1

    def initial(self) -> tuple[float, ...]:
        """Return rest."""
        return (0.0, 0.0)

    def measured(self, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return the position."""
        return state[:1]


def test_a_model_names_its_signals_and_which_states_its_outputs_are() -> None:
    signals = signals_of(PitchModel(PitchParameters(), 0.01))
    assert [one.name for one in signals.inputs] == ["front", "rear"]
    assert [one.column for one in signals.outputs] == ["pitch_rad"]
    assert signals.output_states == (0,)
    assert signals.states[1].label == "pitch rate, rad/s"
    assert signals_of(HoldModel(0.01)).inputs == signals.inputs


def test_a_model_that_names_nothing_has_numbered_signals() -> None:
    signals = signals_of(Cart())
    assert [one.name for one in signals.states] == ["state_1", "state_2"]
    assert [one.name for one in signals.inputs] == ["input_1"]
    # What it measures is found by asking it: here its first state.
    assert signals.output_states == (0,)
    assert signals.inputs[0].largest == pytest.approx(32.767)


@pytest.mark.parametrize(
    ("unit", "suffix"),
    [
        ("", ""),
        ("rad", "rad"),
        ("rad/s", "rad_per_s"),
        ("V", "volts"),
        ("N m", "N_m"),
        ("m/s²", "m_per_s2"),
    ],
)
def test_a_unit_becomes_the_end_of_a_column_name(unit: str, suffix: str) -> None:
    assert unit_suffix(unit) == suffix


def test_names_that_are_none_or_doubled_and_empty_ranges_are_refused() -> None:
    with pytest.raises(ValueError, match="'Pitch angle' is no name"):
        Signal("Pitch angle")
    with pytest.raises(ValueError, match="signal angle: its range is 1 to -1"):
        Signal("angle", low=1.0, high=-1.0)
    with pytest.raises(ValueError, match="steps_per_unit is 0"):
        InputSignal("motor", steps_per_unit=0.0)
    angle = Signal("angle")
    with pytest.raises(ValueError, match="states: angle is named twice"):
        Signals((angle, angle), (), ())


def test_a_picture_is_one_of_those_drawn_for_that_number_of_outputs() -> None:
    arm, pendulum = Signal("arm", "rad"), Signal("pendulum", "rad")
    assert Signals((), (), (arm, pendulum), (None, None), "rotary pendulum").picture
    with pytest.raises(ValueError, match=r"'dial' is unknown or not for 2 output.s.; known are heli"):
        Signals((), (), (arm, pendulum), (None, None), "dial")
    with pytest.raises(ValueError, match="'cart' is unknown"):
        Signals((), (), (arm,), (None,), "cart")


def test_a_model_with_other_numbers_than_it_names_is_refused() -> None:
    model = Cart()
    model.signals = Signals((Signal("position"),), (), ())  # type: ignore[attr-defined]
    with pytest.raises(ValueError, match="the model has 2 states, and 1 are named"):
        signals_of(model)


def test_an_output_that_is_no_state_is_none_and_one_of_a_state_that_is_not_there_is_refused() -> None:
    cart = Cart()
    cart.measured = lambda state: (state[0] + state[1], state[1])  # type: ignore[method-assign, assignment]
    signals = signals_of(cart)
    assert signals.output_states == (None, 1)
    assert [signals.row(place) for place in range(2)] == [(1.0, 1.0), (0.0, 1.0)]
    cart.measured = lambda state: (state[0] * state[1], state[1])  # type: ignore[method-assign, assignment]
    assert signals_of(cart).row(0) == ()
    with pytest.raises(ValueError, match="output_rows have a coefficient per state"):
        Signals((Signal("a"),), (), (Signal("b"),), (None,), output_rows=((1.0, 2.0),))
    angle = Signal("angle")
    with pytest.raises(ValueError, match="there is no state 1"):
        Signals((angle,), (), (angle,), (1,))


def test_signals_of_one_group_or_else_of_one_unit_share_a_panel() -> None:
    motors = (InputSignal("front", "V", group="motors"), InputSignal("rear", "V", group="motors"))
    outputs = (Signal("arm", "rad"), Signal("speed", "rad/s"), Signal("pole_angle", "rad"))
    signals = Signals((), motors, outputs)
    assert signals.groups("inputs") == [("motors, V", [0, 1])]
    assert signals.groups("outputs") == [("arm, pole angle, rad", [0, 2]), ("speed, rad/s", [1])]
    mixed = Signals((), (), (Signal("angle", "rad", group="axis"), Signal("torque", group="axis")))
    assert mixed.groups("outputs") == [("angle, rad; torque", [0, 1])]


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    signals = signals_of(Cart())
    assert signals.index("outputs", "output_1") == 0
    with pytest.raises(ValueError, match="'speed' is none of the states: state_1, state_2"):
        signals.index("states", "speed")
