"""The expected rows of both recordings, computed from the consumed words alone.

The receiver's half is its own session flown again (`refly`), the transmitter's half its own confirmed
copy fed with the echoes that come of it. So a row is expected to be what the node itself would write.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from channel.codec.codec import Vector
from tenbaud.build.flight import Agreement
from tenbaud.recording.memory import MemoryRecorder
from tenbaud.replay.record import Epoch
from tenbaud.replay.refly import Reflown
from tenbaud.replay.rows import KINDS
from transmitter.session.copies import Copies
from transmitter.session.records import write_sample


@dataclass(slots=True)
class Expected:
    """The rows by their keys, as `tenbaud.replay.rows` reads them."""

    samples: dict[int, Any] = field(default_factory=dict)
    """the transmitter's; its sent words and the echoes' times do not follow from the words"""
    estimates: dict[int, Any] = field(default_factory=dict)
    """of the transmitter"""
    commands: dict[int, Any] = field(default_factory=dict)
    """ticks of the receiver"""
    held: dict[int, Vector] = field(default_factory=dict)
    """first ticks of an epoch, before one was decided in it -> the command that is held"""
    place_of: dict[int, int] = field(default_factory=dict)
    """sample -> place of its epoch in the list"""


def expect(agreement: Agreement, epochs: Sequence[Epoch], flown: Sequence[Reflown]) -> Expected:
    """Return the rows that the recordings of a replayed flight must hold."""
    expected = Expected()
    copies: list[Copies] = []
    for epoch in epochs:
        _hold(agreement, epoch, expected)
        copies.append(Copies(agreement.codec, agreement.terms))
        copies[-1].restart(epoch.start, epoch.hold)
    for one in flown:
        expected.place_of[one.sample] = one.place
        _add(agreement, copies[one.place], one, expected)
    return expected


def _hold(agreement: Agreement, epoch: Epoch, expected: Expected) -> None:
    first = epoch.start.sample * agreement.terms.ticks_per_sample
    for tick in range(first, first + agreement.terms.lead_ticks):
        expected.held[tick] = epoch.hold


def _add(agreement: Agreement, copies: Copies, one: Reflown, expected: Expected) -> None:
    digest = int(one.digest, 16)
    commands = [command for _, _, _, command in one.ticks]
    rows = MemoryRecorder()
    done = copies.explained(copies.confirm(one.word, commands, digest))
    write_sample(rows, agreement.terms, agreement.codec, done)
    for topic, found in (("sample", expected.samples), ("estimate", expected.estimates)):
        for row in rows.taken(topic):
            found[row[0]] = KINDS["transmitter"][topic].record._make(row)
    for row in one.ticks:
        expected.commands[row[0]] = KINDS["receiver"]["tick"].record._make(row)
