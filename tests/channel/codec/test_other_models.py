"""The codec with models that are not the paper's: a chaotic circuit, and two axes at once."""

from __future__ import annotations

import pytest

from channel.codec.codec import ERASED, Codec, Vector
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.models.pitch import PitchModel, PitchParameters
from tests.channel.codec.chua import (
    CHUA_TICK_S,
    CHUA_TICKS_PER_SAMPLE,
    CHUA_ZOOM,
    ChuaModel,
    ChuaPlant,
    advance,
)
from tests.channel.codec.parts import PAPER
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes, TwoAxesPlant

NOTHING: Vector = (0.0, 0.0, 0.0)


def chua_codec() -> Codec:
    return Codec(ChuaModel(CHUA_TICK_S), ZoomCoder(CHUA_ZOOM), CHUA_TICKS_PER_SAMPLE)


def chua_errors(samples: int, erase_every: int = 0) -> list[float]:
    """Return the largest error of any state at every tick."""
    codec, plant = chua_codec(), ChuaPlant(CHUA_TICK_S)
    state = codec.initial()
    errors = []
    for sample in range(samples):
        word = codec.encode(state, plant.measured)
        erased = erase_every and sample % erase_every == 0
        state, states = codec.trace(state, ERASED if erased else word, [()] * codec.ticks_per_sample)
        for model in states:
            pairs = zip(model, plant.state, strict=True)
            errors.append(max(abs(ours - theirs) for ours, theirs in pairs))
            plant.advance(())
    return errors


def test_when_chua_is_followed_at_20_bits_per_second_then_the_estimate_stays_on_it() -> None:
    errors = chua_errors(2000)
    assert max(errors[len(errors) // 4 :]) < 0.05


def test_when_a_fifth_of_the_symbols_is_erased_then_chua_is_still_followed() -> None:
    errors = chua_errors(2000, erase_every=5)
    assert max(errors[len(errors) // 4 :]) < 0.3


def test_when_no_symbol_comes_then_two_chua_circuits_part() -> None:
    left, right = (0.3, 0.1, -0.2), (0.3 + 1e-6, 0.1, -0.2)
    largest = 0.0
    for _ in range(20_000):
        left = advance(left, NOTHING, CHUA_TICK_S)
        right = advance(right, NOTHING, CHUA_TICK_S)
        largest = max(largest, abs(left[0] - right[0]))
    assert largest > 2.0


def test_when_two_axes_are_followed_then_one_word_of_two_symbols_serves_both() -> None:
    codec = Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), 4)
    assert codec.coder.alphabet.symbols_per_word == 2
    plant = TwoAxesPlant(0.01, (0.4, -0.2, 0.0, 0.3))
    state = codec.initial()
    errors = []
    for sample in range(600):
        word = codec.encode(state, plant.measured)
        push = 1.0 if (sample // 25) % 2 else -1.0
        commands = [(push, -0.5 * push)] * 4
        state, states = codec.trace(state, word, commands)
        for model, command in zip(states, commands, strict=True):
            pairs = zip(model[:2], plant.measured, strict=True)
            errors.append(max(abs(ours - theirs) for ours, theirs in pairs))
            plant.advance(command)
    assert max(errors[1200:]) < 0.05


class TwoPitches:
    """Two pitch models side by side; corrections of the first come first."""

    state_size = 8
    correction_size = 8
    input_size = 4

    def __init__(self) -> None:
        self.one = PitchModel(PitchParameters(), 0.01)
        self.other = PitchModel(PitchParameters(stiffness_per_s2=0.8), 0.01)

    def initial(self) -> Vector:
        return self.one.initial() + self.other.initial()

    def measured(self, state: Vector) -> Vector:
        return (state[0], state[4])

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        return self.one.tick(state[:4], command[:2], held[:2]) + self.other.tick(
            state[4:], command[2:], held[4:6]
        )


def test_when_two_pitch_axes_are_stacked_then_each_moves_as_if_alone() -> None:
    nothing = (0.0, 0.0)
    gains = ((4.1, 0.0), (8.6, 0.0), nothing, nothing, (0.0, 4.1), (0.0, 8.6), nothing, nothing)
    stacked = Codec(TwoPitches(), ZoomCoder(ZoomParameters(gains=gains)), 5)
    models = TwoPitches()
    alone = [Codec(model, ZoomCoder(PAPER), 5) for model in (models.one, models.other)]
    states = [codec.initial() for codec in alone]
    state = stacked.initial()
    for sample in range(120):
        word = (1 if sample % 3 else -1, 1 if sample % 5 < 3 else -1)
        commands = [(1.0, -1.0), (0.5, 0.25), (2.0, 0.0), (-1.0, 1.0), (0.0, 0.0)]
        both = [front + back for front, back in zip(commands, reversed(commands), strict=True)]
        state = stacked.step(state, word, both)
        states = [
            alone[0].step(states[0], word[:1], commands),
            alone[1].step(states[1], word[1:], commands[::-1]),
        ]
        assert state.model == states[0].model + states[1].model
    assert state.model[0] != pytest.approx(state.model[4])
