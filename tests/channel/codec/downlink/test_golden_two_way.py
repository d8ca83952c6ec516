"""Pinned states of the two-way state machine, and its numerics probe: what both ends must agree on."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from channel.protocol.identity import numerics_probe
from tests.golden.regenerate import two_way_machines

GOLDEN = json.loads(
    (Path(__file__).resolve().parents[3] / "golden" / "two_way.json").read_text(encoding="utf-8")
)


@pytest.mark.parametrize("name", two_way_machines())
def test_every_bit_is_as_written(name: str) -> None:
    machine = two_way_machines()[name]
    probe, *rows = GOLDEN[name]
    assert numerics_probe(machine.codec, machine).hex() == probe
    assert probe != numerics_probe(machine.codec).hex()
    state = machine.initial()
    assert len(rows) == 60
    for sample, (word, symbols, digest) in enumerate(rows):
        state = machine.step(state, None if word is None else tuple(word), symbols).state
        assert f"{machine.digest(state):016x}" == digest, sample
