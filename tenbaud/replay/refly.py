"""A flight again from its symbols: `refly` by the receiver's own session, symbols in, commands out.

Nothing here knows what was recorded but the words, the state that each epoch starts from and the
controller. Symbols arrive when they are due, or later by what the caller says; as long as that is
within their deadlines, it must not matter.

`flown_again` steps the state machine of a narrow downlink with its recorded symbols instead, so that
nothing needs to be known of the controller. Whether they follow from it is what `refly` answers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from channel.codec.codec import Codec, CodecState, Vector, Word
from channel.codec.downlink.machine import TwoWay, TwoWaySample, TwoWayState
from channel.codec.lead import Fly, fly_sample
from channel.errors import CodecDiverged
from channel.protocol.frames import Hello, Symbol, Welcome
from channel.protocol.terms import Terms
from receiver.controllers.base import Controller
from receiver.session.session import ReceiverSession
from tenbaud.build.downlink import with_codec
from tenbaud.build.flight import Agreement
from tenbaud.recording.memory import MemoryRecorder
from tenbaud.replay.pack import Epoch

Delay = Callable[[int], int]
"""slot -> how long after its due time the symbol comes, in ns, from 0 to the deadline allowance"""


class Reflown(NamedTuple):
    """One sample, flown again."""

    place: int
    """of its epoch among those flown, from 0"""
    sample: int
    word: Word
    model: Vector
    coder: Vector
    digest: str
    ticks: list[tuple[int, tuple[float | None, ...], Vector, Vector]]
    """(tick, reference, live state, command) of the ticks decided with it"""
    symbols: tuple[int, ...] = ()
    """of a narrow downlink: those of the sample"""
    before: TwoWayState | None = None
    both: TwoWaySample | None = None
    """of a narrow downlink, where its state machine was stepped: X before the sample, and the sample"""


def refly(
    agreement: Agreement,
    controller: Controller,
    epochs: Sequence[Epoch],
    delay: Delay = lambda _slot: 0,
    fly: Fly = fly_sample,
) -> Iterator[Reflown]:
    """Yield the samples of a flight, flown again from the words of its epochs.

    `fly` computes the samples of a downlink that is not narrow.
    """
    for place, epoch in enumerate(epochs):
        yield from _refly_epoch(agreement, controller, place, epoch, delay, fly)


class _Starting(Codec):
    """The same codec, but for the state that it starts from."""

    def __init__(self, codec: Codec, start: CodecState) -> None:
        super().__init__(codec.model, codec.coder, codec.ticks_per_sample)
        self._start = start

    def initial(self) -> CodecState:
        return self._start


class _StartingTwoWay(TwoWay):
    """The same state machine, but for the state that it starts from."""

    def __init__(self, machine: TwoWay, start: TwoWayState) -> None:
        vars(self).update(vars(machine))
        self._start = start

    def initial(self, sample: int = 0) -> TwoWayState:
        return self._start


def _refly_epoch(
    agreement: Agreement, controller: Controller, place: int, epoch: Epoch, delay: Delay, fly: Fly
) -> Iterator[Reflown]:
    terms = replace(agreement.terms, initial_command=epoch.hold)
    codec = _Starting(agreement.codec, epoch.start)
    rows = MemoryRecorder(topics=("sample", "tick", "down_symbols"))
    machine = with_codec(agreement.two_way, codec)
    if machine is not None and epoch.two_way is not None:
        machine = _StartingTwoWay(machine, epoch.two_way)
    identity = agreement.identity
    session = ReceiverSession(codec, terms, controller, identity, 1, rows, two_way=machine, fly=fly)
    hello = Hello(1, identity.version, identity.config_digest, identity.numerics_probe)
    (welcome,) = session.on_frame(hello, 0)
    if not isinstance(welcome, Welcome):
        raise AssertionError(f"a session refused its own identity: {welcome}")
    alphabet = codec.coder.alphabet
    count = terms.symbols_per_word
    # A word of many symbols is erased though some of them came. Without any, nothing would ever be due
    # in an epoch whose words were all erased.
    some = alphabet.symbols[: 1 if count > 1 else 0]
    last = epoch.start.sample + len(epoch.words)
    now_ns = 0
    for sample, word in enumerate(epoch.words, epoch.start.sample):
        for index, symbol in enumerate(some if word is None else word):
            slot = sample * count + index
            due_ns = terms.slot_ns(slot) + terms.symbol_delay_ns + terms.uplink_line_ns
            now_ns = max(now_ns, due_ns + delay(slot))
            _let_deadlines_pass(session, now_ns)
            frame = Symbol(welcome.session, welcome.epoch, slot, alphabet.symbol_number(symbol))
            session.on_frame(frame, now_ns)
            session.flush_records()
            yield from _taken(rows, place)
    # Erasures after the last symbol: their deadlines pass one by one.
    deadline = session.next_deadline()
    while session.state.sample < last and deadline is not None:
        session.on_deadline(deadline)
        session.flush_records()
        yield from _taken(rows, place)
        deadline = session.next_deadline()


def _let_deadlines_pass(session: ReceiverSession, now_ns: int) -> None:
    deadline = session.next_deadline()
    if deadline is not None and deadline < now_ns:
        session.on_deadline(now_ns - 1)


def _taken(rows: MemoryRecorder, place: int) -> Iterator[Reflown]:
    samples, ticks = rows.taken("sample"), rows.taken("tick")
    down = [tuple(symbols) for _, symbols in rows.taken("down_symbols")] or [()] * len(samples)
    per_sample = len(ticks) // len(samples) if samples else 0
    for index, (sample, word, _, model, coder, digest, _) in enumerate(samples):
        own: Any = [tuple(row) for row in ticks[index * per_sample : (index + 1) * per_sample]]
        yield Reflown(place, sample, word, model, coder, digest, own, down[index])


def flown_again(
    agreement: Agreement, controller: Controller, epochs: Sequence[Epoch], fly: Fly = fly_sample
) -> Iterator[Reflown]:
    """Yield the samples of a flight; where it is narrow the controller gives its set-points only."""
    machine = agreement.two_way
    if machine is None:
        yield from refly(agreement, controller, epochs, fly=fly)
        return
    for place, epoch in enumerate(epochs):
        yield from _stepped(machine, agreement.terms, controller, place, epoch)


def _stepped(
    machine: TwoWay, terms: Terms, controller: Controller, place: int, epoch: Epoch
) -> Iterator[Reflown]:
    state = epoch.two_way
    assert state is not None
    for word, given in zip(epoch.words, epoch.symbols, strict=True):
        commands = given[: machine.commands_in(state)]
        try:
            both = machine.step(state, word, commands)
        except (ArithmeticError, ValueError) as error:
            raise CodecDiverged(f"in sample {state.sample}: {error}") from error
        hashes = machine.hash_symbols(state, machine.digest(state), commands, word)
        after = both.state
        yield Reflown(
            place,
            state.sample,
            word,
            after.codec.model,
            after.codec.coder,
            f"{machine.digest(after):016x}",
            _ticks(terms, state.sample, controller, zip(both.live, both.commands, strict=True)),
            (*commands, *hashes),
            state,
            both,
        )
        state = after


def _ticks(
    terms: Terms, sample: int, controller: Controller, decided: Iterable[tuple[Vector, Vector]]
) -> list[tuple[int, tuple[float | None, ...], Vector, Vector]]:
    """Return the ticks that were decided with a sample, as the receiver records them."""
    first = sample * terms.ticks_per_sample + terms.lead_ticks
    none = (None,) * len(terms.signals.outputs)
    found = []
    for tick, (live, command) in enumerate(decided, first):
        references = controller.references(tick)
        found.append((tick, (*references, *none[len(references) :]), live, command))
    return found
