"""A flight again from all its symbols: the words that went up and, where it is narrow, the downlink's.

With a narrow downlink the state machine is stepped with the recorded symbols, so that nothing needs to
be known of the controller. Whether the symbols follow from the controller is another question, which
`refly` answers.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from channel.codec.codec import Vector
from channel.codec.downlink.machine import TwoWay
from channel.errors import CodecDiverged
from channel.protocol.terms import Terms
from receiver.controllers.base import Controller
from tenbaud.build.flight import Agreement
from tenbaud.replay.pack import Epoch
from tenbaud.replay.refly import Reflown, refly


def flown_again(
    agreement: Agreement, controller: Controller, epochs: Sequence[Epoch]
) -> Iterator[Reflown]:
    """Yield the samples of a flight; where it is narrow the controller gives its set-points only."""
    machine = agreement.two_way
    if machine is None:
        yield from refly(agreement, controller, epochs)
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
