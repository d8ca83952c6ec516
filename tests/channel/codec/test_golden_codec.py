"""Pinned states of the codec: a changed bit here is a changed wire format."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from channel.protocol.limits import from_steps
from tests.golden.regenerate import GOLDEN_CODECS, codec_vectors

GOLDEN = json.loads(
    (Path(__file__).resolve().parents[2] / "golden" / "codec.json").read_text(encoding="utf-8")
)


@pytest.mark.parametrize("name", GOLDEN_CODECS)
def test_when_the_golden_inputs_are_flown_then_every_bit_is_as_written(name: str) -> None:
    codec = GOLDEN_CODECS[name]
    state = codec.initial()
    rows = GOLDEN[name]
    assert len(rows) == 60
    for sample, (word, steps, digest, model, coder) in enumerate(rows):
        commands = [
            from_steps(steps[2 * tick : 2 * tick + 2], PITCH_SIGNALS)
            for tick in range(codec.ticks_per_sample)
        ]
        state = codec.step(state, None if word is None else tuple(word), commands)
        assert [value.hex() for value in state.model] == model, f"sample {sample}"
        assert [value.hex() for value in state.coder] == coder, f"sample {sample}"
        assert f"{codec.digest(state):016x}" == digest, f"sample {sample}"


def test_when_the_golden_file_is_generated_again_then_it_is_the_same() -> None:
    assert json.loads(json.dumps(codec_vectors())) == GOLDEN


def test_when_the_golden_inputs_are_looked_at_then_they_hold_erasures_and_both_signs() -> None:
    for name, rows in GOLDEN.items():
        words = [row[0] for row in rows]
        symbols = GOLDEN_CODECS[name].coder.alphabet.symbols
        assert {None if word is None else word[0] for word in words} == {None, *symbols}
