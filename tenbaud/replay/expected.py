"""The expected rows of both recordings, computed from the consumed words alone.

The receiver's half is its own session flown again (`refly`), the transmitter's half its own confirmed
copy fed with the echoes that come of it. So a row is expected to be what the node itself would write.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from channel.codec.codec import Vector, Word
from channel.codec.downlink.machine import TwoWay
from channel.codec.lead import FlownSample
from channel.protocol.terms import Terms
from tenbaud.build.flight import Agreement
from tenbaud.recording.kinds import KINDS
from tenbaud.recording.memory import MemoryRecorder
from tenbaud.replay.pack import Epoch
from tenbaud.replay.refly import Reflown
from transmitter.session.copies import Confirmed, Copies
from transmitter.session.records import write_sample


class Own(NamedTuple):
    """What a transmitter with a narrow downlink knows of a confirmed sample."""

    word: Word
    symbols: tuple[int, ...]
    commands: Vector


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
    confirmed: dict[int, Own] = field(default_factory=dict)
    """with a narrow downlink, the transmitter's: sample -> word, symbols and commands"""


def expect(agreement: Agreement, epochs: Sequence[Epoch], flown: Sequence[Reflown]) -> Expected:
    """Return the rows that the recordings of a replayed flight must hold."""
    expected = Expected()
    copies: list[Copies | Confirming] = []
    for epoch in epochs:
        _hold(agreement, epoch, expected)
        if agreement.two_way is not None:
            copies.append(Confirming(agreement.two_way, agreement.terms))
            continue
        echoed = Copies(agreement.codec, agreement.terms)
        echoed.restart(epoch.start, epoch.hold)
        copies.append(echoed)
    for one in flown:
        expected.place_of[one.sample] = one.place
        _add(agreement, copies[one.place], one, expected)
    return expected


class Confirming:
    """What a transmitter with a narrow downlink makes of its confirmed samples, of one epoch."""

    def __init__(self, machine: TwoWay, terms: Terms) -> None:
        self._machine, self._terms = machine, terms
        self._live: deque[Vector | None] = deque([None] * terms.lead_ticks)

    def explained(self, one: Reflown, digest: int) -> Confirmed:
        """Return the next sample."""
        codec, before, both = self._machine.codec, one.before, one.both
        assert before is not None
        assert both is not None
        self._live.extend(both.live)
        live = [self._live.popleft() for _ in range(self._terms.ticks_per_sample)]
        flown = FlownSample(both.state.codec, both.coded, both.live, both.commands)
        about = codec.about(before.codec, one.word, both.coded[0])
        return Confirmed(
            one.sample, before.codec, None, one.word, flown, live, digest, digest, 0, 0, about
        )


def _commands_of(one: Reflown, terms: Terms) -> Vector:
    """Return the commands of a sample's own ticks."""
    assert one.before is not None
    assert one.both is not None
    known = (*one.before.commands, *one.both.commands)[: terms.ticks_per_sample]
    return tuple([value for command in known for value in command])


def _hold(agreement: Agreement, epoch: Epoch, expected: Expected) -> None:
    first = epoch.start.sample * agreement.terms.ticks_per_sample
    lead = agreement.terms.lead_ticks
    held = (epoch.hold,) * lead if epoch.two_way is None else epoch.two_way.commands
    expected.held |= dict(enumerate(held, first))


def _add(agreement: Agreement, copies: Copies | Confirming, one: Reflown, expected: Expected) -> None:
    digest = int(one.digest, 16)
    rows = MemoryRecorder()
    if isinstance(copies, Confirming):
        done = copies.explained(one, digest)
        own = (one.word, one.symbols, _commands_of(one, agreement.terms))
        expected.confirmed[one.sample] = Own(*own)
    else:
        commands = [command for _, _, _, command in one.ticks]
        done = copies.explained(copies.confirm(one.word, commands, digest))
    write_sample(rows, agreement.terms, agreement.codec, done)
    for topic, found in (("sample", expected.samples), ("estimate", expected.estimates)):
        for row in rows.taken(topic):
            found[row[0]] = KINDS["transmitter"][topic].record._make(row)
    for row in one.ticks:
        expected.commands[row[0]] = KINDS["receiver"]["tick"].record._make(row)
