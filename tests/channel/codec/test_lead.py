"""One sample with command lead, against the codec and an independent free run."""

from __future__ import annotations

import pytest

from channel.codec.codec import ERASED, Codec, Vector, Word
from channel.codec.coders.zoom import ZoomCoder
from channel.codec.lead import fly_sample
from tests.channel.codec.parts import IMPULSE, PAPER, ConstantController, pitch_codec
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes

CODECS = {
    "held": pitch_codec(PAPER),
    "impulse": pitch_codec(IMPULSE),
    "two axes": Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), 10),
}
every_codec = pytest.mark.parametrize("codec", CODECS.values(), ids=CODECS.keys())


def words(codec: Codec, count: int) -> list[Word]:
    length = codec.coder.alphabet.symbols_per_word
    return [
        ERASED if sample % 7 == 5 else ((1, -1, 1, 1)[sample % 4],) * length for sample in range(count)
    ]


def command_of(tick: int) -> Vector:
    """A different command for every tick."""
    return (tick % 17 / 10.0, -(tick % 23) / 10.0)


@every_codec
def test_when_there_is_no_lead_then_live_and_coded_are_the_trace_of_the_codec(codec: Codec) -> None:
    state = codec.initial()
    for word in words(codec, 20):
        commands = [command_of(state.sample * 10 + index) for index in range(10)]
        after, states = codec.trace(state, word, commands)
        flown = fly_sample(codec, state, word, (), lambda tick, _: command_of(tick))
        assert flown.coded == flown.live == states
        assert flown.commands == commands
        assert flown.state == after
        state = after


@every_codec
@pytest.mark.parametrize("lead", [1, 3, 9, 10, 11, 13, 25])
def test_when_there_is_lead_then_live_states_are_a_free_run(codec: Codec, lead: int) -> None:
    state = codec.initial()
    for word in words(codec, 12):
        first = state.sample * 10
        asked: list[tuple[int, Vector]] = []

        def decide(tick: int, model: Vector, asked: list[tuple[int, Vector]] = asked) -> Vector:
            asked.append((tick, model))
            return command_of(tick)

        known = [command_of(first + index) for index in range(lead)]
        flown = fly_sample(codec, state, word, known, decide)

        own = [command_of(first + index) for index in range(10)]
        after, states = codec.trace(state, word, own)
        assert flown.state == after
        assert flown.coded == states

        # From the sample's end on, without any correction, under the commands of those ticks.
        free = [*states]
        model = after.model
        for index in range(10, 10 + lead):
            free.append(model)
            model = codec.model.tick(model, command_of(first + index), codec.nothing_held)
        assert flown.live == free[lead:]
        assert asked == [(first + lead + index, live) for index, live in enumerate(flown.live)]
        assert flown.commands == [command_of(first + lead + index) for index in range(10)]
        state = after


def test_when_samples_follow_each_other_then_the_controller_is_asked_for_every_tick_once() -> None:
    codec, lead = pitch_codec(), 13
    controller = ConstantController(1.0, -1.0)
    state = codec.initial()
    commands: list[Vector] = [(0.0, 0.0)] * lead
    for word in words(codec, 6):
        known = commands[state.sample * 10 :]
        flown = fly_sample(codec, state, word, known, controller.command)
        commands += flown.commands
        state = flown.state
    assert [tick for tick, _ in controller.asked] == list(range(lead, lead + 60))


def test_when_the_lead_differs_then_the_codec_state_does_not() -> None:
    codec = pitch_codec()
    state = codec.initial()
    states = []
    for lead in (10, 20):
        known = [(1.0, -1.0)] * lead
        states.append(fly_sample(codec, state, (1,), known, lambda *_: (5.0, 5.0)).state)
    assert states[0] == states[1]
