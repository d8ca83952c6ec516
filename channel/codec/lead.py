"""One sample with command lead: computed by the receiver, and repeated by the transmitter.

The command of tick `n + D` is computed when the codec is at tick `n`, from the codec's own state
advanced `D` ticks by the model under the commands already given, with no correction
beyond the last known word. This *live* estimate is outside the codec state; at `D = 0` it is the
codec state. Both ends compute it here: the receiver to decide commands, the transmitter to know
afterwards what the receiver predicted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from channel.codec.codec import Codec, CodecState, OpenSample, Vector, Word

Decide = Callable[[int, Vector], Vector]
"""(tick, live model state) -> command of that tick."""


class FlownSample(NamedTuple):
    """The result of one word."""

    state: CodecState
    """Codec state after the sample."""
    coded: list[Vector]
    """Codec's model state at ticks `kN ... (k+1)N - 1`."""
    live: list[Vector]
    """Predicted model state of ticks `kN + D ... (k+1)N + D - 1`."""
    commands: list[Vector]
    """Commands decided for those ticks."""


def fly_ticks(
    step: Any,
    close: Any,
    tick: Any,
    flight: Any,
    carried: Any,
    model: Any,
    held: Any,
    nothing: Any,
    first: int,
    count: int,
    lead: int,
) -> Any:
    """Carry a model state over the `count` ticks of a sample and `lead` more; return what is carried.

    The order of a sample's ticks is written only here: sessions run it as it is, and studies
    compile it with functions of their own. `flight` is handed to each of these:

    `step(flight, carried, at, within, ahead, model)` returns (carried, command of tick `at`). `within`:
    the tick is one of the sample's, `model` its coded state. `ahead`: `model` is the live state that
    the tick's command is to be decided from; else that command is known.
    `close(flight, carried, model)` gets the state after the sample's last tick, and returns `carried`.
    `tick(flight, carried, at, within, model, command, held)` returns (carried, state one tick later).
    """
    for index in range(count + lead):
        if index == count:
            carried = close(flight, carried, model)
            held = nothing
        carried, command = step(flight, carried, first + index, index < count, index >= lead, model)
        carried, model = tick(flight, carried, first + index, index < count, model, command, held)
    if lead == 0:
        carried = close(flight, carried, model)
    return carried


class _Sample(NamedTuple):
    """A sample that is being flown; the lists are those of `FlownSample`."""

    codec: Codec
    tick: Callable[[Vector, Vector, Vector], Vector]
    """of the codec's model"""
    state: CodecState
    opened: OpenSample
    known: Sequence[Vector]
    decide: Decide
    first_tick: int
    coded: list[Vector]
    live: list[Vector]
    commands: list[Vector]


def _step(
    flight: _Sample, closed: CodecState, at: int, within: bool, ahead: bool, model: Vector
) -> tuple[CodecState, Vector]:
    if within:
        flight.coded.append(model)
    if not ahead:
        return closed, flight.known[at - flight.first_tick]
    flight.live.append(model)
    command = flight.decide(at, model)
    flight.commands.append(command)
    return closed, command


def _close(flight: _Sample, closed: CodecState, model: Vector) -> CodecState:
    return flight.codec.close(flight.state, flight.opened, model)


def _tick(
    flight: _Sample,
    closed: CodecState,
    at: int,
    within: bool,
    model: Vector,
    command: Vector,
    held: Vector,
) -> tuple[CodecState, Vector]:
    return closed, flight.tick(model, command, held)


Fly = Callable[[Codec, CodecState, Word, Sequence[Vector], Decide], FlownSample]
"""`fly_sample`, or what gives the same sample."""


def fly_sample(
    codec: Codec, state: CodecState, word: Word, known: Sequence[Vector], decide: Decide
) -> FlownSample:
    """Consume one word, compute `N` commands and return them with their states.

    `known` holds the `D` commands of ticks `kN ... kN + D - 1`, decided with earlier words.
    """
    count = codec.ticks_per_sample
    opened = codec.open(state, word)
    first = state.sample * count
    flight = _Sample(codec, codec.model.tick, state, opened, known, decide, first, [], [], [])
    closed = fly_ticks(
        _step,
        _close,
        _tick,
        flight,
        state,
        opened.model,
        opened.held,
        codec.nothing_held,
        first,
        count,
        len(known),
    )
    return FlownSample(closed, flight.coded, flight.live, flight.commands)
