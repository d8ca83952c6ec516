"""One sample with command lead: what the receiver does with a word, and the transmitter repeats.

The command of tick `n + D` is decided when the codec stands at tick `n`. Its basis is the codec's own
state carried `D` ticks ahead by the model under the commands already given, with no correction
beyond the last known word. This *live* estimate is outside the codec state; at `D = 0` it is the
codec state. Both ends compute it here: the receiver to decide commands, the transmitter to know
afterwards what the receiver predicted.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from channel.codec.codec import Codec, CodecState, Vector
from channel.codec.words import Word

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


def fly_sample(
    codec: Codec, state: CodecState, word: Word, known: Sequence[Vector], decide: Decide
) -> FlownSample:
    """Consume one word, decide `N` commands and return what they rest on.

    `known` holds the `D` commands of ticks `kN ... kN + D - 1`, decided with earlier words.
    """
    count = codec.ticks_per_sample
    lead = len(known)
    first_tick = state.sample * count
    tick = codec.model.tick
    opened = codec.open(state, word)
    model, held = opened.model, opened.held
    coded: list[Vector] = []
    live: list[Vector] = []
    commands: list[Vector] = []
    closed: CodecState | None = None
    for index in range(count + lead):
        if index == count:
            closed = codec.close(state, opened, model)
            held = codec.nothing_held
        if index < count:
            coded.append(model)
        if index < lead:
            command = known[index]
        else:
            live.append(model)
            command = decide(first_tick + index, model)
            commands.append(command)
        model = tick(model, command, held)
    if closed is None:
        closed = codec.close(state, opened, model)
    return FlownSample(closed, coded, live, commands)
