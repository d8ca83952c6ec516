"""The expected rows of both recordings, computed from the consumed words alone.

The receiver's half is its own session flown again (`refly`), the transmitter's half its own confirmed
copy fed with the echoes that come of it. So a row is expected to be what the node itself would write.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from channel.codec.codec import Vector
from channel.protocol.recording import RecordChannel
from tenbaud.build.flight import Agreement
from tenbaud.replay.record import Epoch
from tenbaud.replay.refly import Reflown
from transmitter.session.copies import Copies
from transmitter.session.records import ESTIMATE_CHANNEL, SAMPLE_CHANNEL, write_sample


@dataclass(slots=True)
class Expected:
    """The rows by their keys: every field that follows from words and slots."""

    samples: dict[int, dict[str, Any]] = field(default_factory=dict)
    """of either end"""
    estimates: dict[int, dict[str, Any]] = field(default_factory=dict)
    """of the transmitter"""
    commands: dict[int, dict[str, Any]] = field(default_factory=dict)
    """ticks of the receiver"""
    held: dict[int, Vector] = field(default_factory=dict)
    """first ticks of an epoch, before one was decided in it -> the command that is held"""
    place_of: dict[int, int] = field(default_factory=dict)
    """sample -> place of its epoch in the list"""


def expect(agreement: Agreement, epochs: Sequence[Epoch], flown: Sequence[Reflown]) -> Expected:
    """Return what the recordings must hold of a flight that was flown again."""
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
    rows = _Rows()
    write_sample(rows, agreement.terms, agreement.codec, copies.confirm(one.word, commands, digest))
    for channel, row in rows.written:
        values: dict[str, Any] = {
            name.name: value for name, value in zip(channel.fields, row, strict=True)
        }
        if channel is SAMPLE_CHANNEL:
            # What was sent, and when its echo came, does not follow from what was consumed.
            del values["word_sent"], values["lag_samples"]
            expected.samples[one.sample] = values
        else:
            expected.estimates[int(values["tick"])] = values
    for tick, reference, live, command in one.ticks:
        expected.commands[tick] = {
            "tick": tick,
            "reference": reference,
            "live_state": live,
            "command": command,
        }


class _Rows:
    """A recorder that keeps what it is given."""

    def __init__(self) -> None:
        self.written: list[tuple[RecordChannel, Sequence[object]]] = []

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[object]) -> None:
        """Keep samples and estimates."""
        if channel in (SAMPLE_CHANNEL, ESTIMATE_CHANNEL):
            self.written.append((channel, row))
