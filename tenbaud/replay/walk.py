"""The samples of one walk through a flight, so that others that must be equal need not compute them.

A sample follows from the state before it, its word and its commands. A walk with the symbols at other
times asks for the same samples again, if the times do not matter; only what it asks for in another way
has to be computed.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from typing import NamedTuple

from channel.codec.codec import Codec, CodecState, Vector, Word
from channel.codec.lead import Decide, FlownSample, Fly, fly_sample
from tenbaud.replay.bits import is_same


class _Call(NamedTuple):
    """What was asked for, and the answer."""

    state: CodecState
    word: Word
    known: Sequence[Vector]
    flown: FlownSample


class Walk:
    """Remembers the samples of a walk: `first` computes them, `again()` gives them to another one."""

    def __init__(self) -> None:
        self._calls: list[_Call] = []

    def first(
        self, codec: Codec, state: CodecState, word: Word, known: Sequence[Vector], decide: Decide
    ) -> FlownSample:
        """Compute a sample as `fly_sample` does, and remember it."""
        flown = fly_sample(codec, state, word, known, decide)
        self._calls.append(_Call(state, word, known, flown))
        return flown

    def again(self) -> Fly:
        """Return what flies the samples of another walk in their order.

        Each is the remembered one if its inputs are equal to the last bit, and is computed if not.
        """
        calls = iter(self._calls)

        def fly(
            codec: Codec, state: CodecState, word: Word, known: Sequence[Vector], decide: Decide
        ) -> FlownSample:
            call = next(calls, None)
            if call is None or not _is_asked_again(call, state, word, known):
                return fly_sample(codec, state, word, known, decide)
            flown, first = call.flown, state.sample * codec.ticks_per_sample + len(known)
            decided: dict[int, Vector] = {}
            for tick, live, command in zip(count(first), flown.live, flown.commands, strict=False):
                decided[tick] = decide(tick, live)
                if not is_same(decided[tick], command):
                    break
            else:
                return flown
            # A controller is asked once for a tick.
            return fly_sample(
                *(codec, state, word, known),
                lambda tick, live: decided[tick] if tick in decided else decide(tick, live),
            )

        return fly


def _is_asked_again(call: _Call, state: CodecState, word: Word, known: Sequence[Vector]) -> bool:
    if word != call.word or len(known) != len(call.known):
        return False
    pairs = zip((*state, *known), (*call.state, *call.known), strict=True)
    return all(is_same(one, other) for one, other in pairs)
