"""One copy corrupted in one bit, and what is written down about it."""

from __future__ import annotations

import math

import pytest

from channel.protocol.lockstep import INPUTS_KEPT, STATES_KEPT, History, unpacked
from channel.protocol.sabotage import SabotagedCodec, parse_sabotage
from tests.channel.codec.parts import pitch_codec

CODEC = pitch_codec()
COMMANDS = [(1.0, -1.0)] * 10


def test_when_a_sample_comes_then_one_bit_of_one_field_differs() -> None:
    corrupted = SabotagedCodec(CODEC, parse_sabotage("sample=3, field=range"))
    right = wrong = CODEC.initial()
    for sample in range(4):
        assert right == wrong
        right = CODEC.step(right, (1,), COMMANDS)
        wrong = corrupted.step(wrong, (1,), COMMANDS)
        assert wrong.sample == sample + 1
    assert wrong.model == right.model
    assert wrong.coder[0] == math.nextafter(right.coder[0], math.inf)
    assert CODEC.digest(wrong) != CODEC.digest(right)


@pytest.mark.parametrize("field", ["angle", "rate", "model.3", "coder.0"])
def test_when_a_field_exists_then_it_can_be_corrupted(field: str) -> None:
    corrupted = SabotagedCodec(CODEC, parse_sabotage(f"sample=0,field={field}"))
    state = CODEC.initial()
    assert corrupted.step(state, (1,), COMMANDS) != CODEC.step(state, (1,), COMMANDS)


@pytest.mark.parametrize(
    "text", ["", "sample=3", "field=range", "sample=-1,field=range", "sample=1,field=x"]
)
def test_when_the_text_makes_no_sense_then_it_says_how_to_write_it(text: str) -> None:
    with pytest.raises(ValueError, match="write sample=500,field=NAME"):
        parse_sabotage(text)


def test_when_a_field_does_not_exist_then_it_is_refused() -> None:
    with pytest.raises(ValueError, match="has 4 value"):
        SabotagedCodec(CODEC, parse_sabotage("sample=1,field=model.4"))


def test_when_history_is_asked_then_it_has_the_last_states_and_inputs() -> None:
    history = History(CODEC)
    state = CODEC.initial()
    states = []
    for sample in range(STATES_KEPT + 20):
        word = None if sample % 5 == 0 else (1,)
        state = CODEC.step(state, word, COMMANDS)
        states.append(state)
        history.add(2, word, state)
    assert history.state_after(STATES_KEPT + 19) == states[-1]
    assert history.state_after(20) == states[20]
    assert history.state_after(19) is None
    row = history.failure_row(2, 100, 0xABC, 0xDEF, CODEC.pack(states[99]))
    assert row[:4] == (100, 2, "0000000000000abc", "0000000000000def")
    assert row[4:8] == (states[100].model, states[100].coder, states[99].model, states[99].coder)
    assert row[8] == list(range(101 - INPUTS_KEPT, 101))
    assert row[9] == [0xFFFF if sample % 5 == 0 else 1 for sample in range(101 - INPUTS_KEPT, 101)]
    assert history.failure_row(2, 100, 1, 2, b"")[6:8] == (None, None)
    assert unpacked(CODEC, b"short") is None
