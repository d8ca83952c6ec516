"""The transmitter's two copies of the codec, and the order in which echoes reach them.

The *confirmed* copy advances on echoes only: the words that the receiver consumed, not those sent.
Only its state is digested. While echoes are on their way the next symbol is formed on the
*provisional* copy: the confirmed one advanced with the words sent and the commands known, a missing
one assumed equal to the last. A wrong assumption costs one poor bit and never lockstep, because the
next echo replaces it.

Every command frame repeats the echoes of earlier samples, so the next frames replace a lost one. On a
line with variable delay a later frame may overtake an earlier one by more than it repeats: its echoes
wait in `EchoOrder` until the earlier frame has come, or can no longer come.
"""

from __future__ import annotations

import sys
from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from channel.codec.codec import ERASED, Codec, CodecState, Vector, Word
from channel.codec.lead import FlownSample, fly_sample
from channel.errors import CodecDiverged
from channel.protocol.frames import Echo
from channel.protocol.limits import from_steps
from channel.protocol.terms import Terms

CANNOT_FLY = (CodecDiverged, ArithmeticError, LookupError, ValueError)
"""The exceptions of a copy in a state that it cannot continue from."""


class Confirmed(NamedTuple):
    """One sample whose word, as the receiver consumed it, is known."""

    sample: int
    before: CodecState
    word_sent: Word
    word: Word
    """as the receiver consumed it"""
    flown: FlownSample
    live: list[Vector | None]
    """predicted states of the sample's ticks, as the receiver had them; None for ticks below D"""
    digest: int
    """of our copy after the sample"""
    peer_digest: int
    """of the receiver's"""
    peer_mask: int
    """which of its bits the receiver sent; the others are taken from ours"""
    lag_samples: int
    """samples beyond this one when it was confirmed: sent, or on the narrow downlink heard of"""
    about: tuple[int, ...] | None = None
    """the output that each symbol codes, set by `Copies.explained`"""


def commands_of(echo: Echo, terms: Terms) -> list[Vector]:
    """Return the commands of an echo within bounds, one for each tick."""
    inputs = len(terms.signals.inputs)
    return [
        from_steps(echo.steps[index * inputs : (index + 1) * inputs], terms.signals)
        for index in range(terms.ticks_per_sample)
    ]


class Copies:
    """Confirmed and provisional copy, the words sent, and the commands that prediction needs."""

    def __init__(self, codec: Codec, terms: Terms) -> None:
        self.codec = codec
        self.terms = terms
        self.confirmed = codec.initial()
        self._commands: deque[Vector] = deque([terms.initial_command] * terms.lead_ticks)
        """of the ticks from the confirmed sample's first one on"""
        self._sent: deque[Word] = deque()
        """of the samples from the confirmed one on; ERASED where none was"""
        self._provisional = self.confirmed
        self._assumed: deque[tuple[Word, list[Vector]]] = deque()
        """inputs that the provisional copy took for the samples since the confirmed one"""
        self._last_command = terms.initial_command
        self._live: deque[Vector | None] = deque([None] * terms.lead_ticks)

    def restart(self, state: CodecState, hold: Vector) -> None:
        """Take a new common state; the `D` ticks from its first one on have the command `hold`."""
        self.confirmed = self._provisional = state
        self._commands = deque([hold] * self.terms.lead_ticks)
        self._last_command = hold
        self._live = deque([None] * self.terms.lead_ticks)
        self._sent.clear()
        self._assumed.clear()

    @property
    def next_sample(self) -> int:
        return self.confirmed.sample + len(self._sent)

    @property
    def lag_samples(self) -> int:
        """Return how many samples have been sent and not yet confirmed."""
        return len(self._sent)

    def state_before_next(self) -> CodecState:
        """Return the provisional codec state before `next_sample`."""
        while self._provisional.sample < self.next_sample:
            sample = self._provisional.sample
            word = self._sent[sample - self.confirmed.sample]
            commands = self._best_commands(sample)
            self._assumed.append((word, commands))
            self._provisional = self.codec.step(self._provisional, word, commands)
        return self._provisional

    def sent(self, word: Word) -> None:
        self._sent.append(word)

    def skip_to(self, sample: int) -> int:
        """Note that no words were sent for the samples before this one; return how many."""
        missed = max(0, sample - self.next_sample)
        self._sent.extend([ERASED] * missed)
        return missed

    def confirm(
        self, word: Word, commands: list[Vector], peer_digest: int, peer_mask: int = 2**64 - 1
    ) -> Confirmed:
        """Advance the confirmed copy by the echo of its next sample.

        `commands` are those of ticks `kN + D ... (k+1)N + D - 1`; of the receiver's digest the bits of
        `peer_mask` are known.
        """
        before = self.confirmed
        arriving = iter(commands)
        flown = fly_sample(
            self.codec, before, word, tuple(self._commands), lambda _tick, _state: next(arriving)
        )
        self._commands.extend(commands)
        self._last_command = commands[-1]
        self._live.extend(flown.live)
        ticks = range(self.terms.ticks_per_sample)
        taken = [self._commands.popleft() for _ in ticks]
        live = [self._live.popleft() for _ in ticks]
        lag = len(self._sent)
        sent = self._sent.popleft() if self._sent else ERASED
        self.confirmed = flown.state
        self._keep_provisional(word, taken)
        digest = self.codec.digest(flown.state)
        peer = digest & ~peer_mask | peer_digest
        return Confirmed(before.sample, before, sent, word, flown, live, digest, peer, peer_mask, lag)

    def explained(self, done: Confirmed) -> Confirmed:
        """Return a confirmed sample with the outputs of its symbols; no state depends on them."""
        return done._replace(about=self.codec.about(done.before, done.word, done.flown.coded[0]))

    def _keep_provisional(self, word: Word, taken: list[Vector]) -> None:
        """Restart the provisional copy unless all its assumptions were correct."""
        if self._assumed and self._assumed.popleft() == (word, taken):
            first = self.confirmed.sample
            if all(
                commands == self._best_commands(first + index)
                for index, (_, commands) in enumerate(self._assumed)
            ):
                return
        self._assumed.clear()
        self._provisional = self.confirmed

    def _best_commands(self, sample: int) -> list[Vector]:
        """Return the commands of a sample's ticks, the last known one where one is missing."""
        count = self.terms.ticks_per_sample
        start = (sample - self.confirmed.sample) * count
        known = [
            self._commands[index] for index in range(start, min(start + count, len(self._commands)))
        ]
        return known + [self._last_command] * (count - len(known))


class EchoOrder:
    """Holds the echoes that came early; times are ticks.

    `overtaking_ticks`: how long after a frame one may come that was sent before it. `ahead_samples`:
    an echo that is further ahead of the expected one is not kept.
    """

    def __init__(self, overtaking_ticks: int, ahead_samples: int) -> None:
        self._overtaking_ticks = overtaking_ticks
        self._ahead_samples = ahead_samples
        self._end_sample = sys.maxsize
        self._early: dict[int, Echo] = {}
        self._missing: int | None = None
        """sample whose echo a later frame has shown to be lost or overtaken"""
        self._until_tick = 0
        """when it can no longer come"""

    def add(self, echoes: Sequence[Echo], expected: int, tick: int, sample: int) -> None:
        """Take the echoes of a frame; `expected` is the sample whose echo is next.

        `sample` is the one that the clock stands in: no later one is kept, or a forged
        echo would wait here for long.
        """
        latest = expected + self._ahead_samples
        if echoes[0].sample > expected:
            latest = min(latest, sample)
        for echo in echoes:
            repeated = not echo.digest_mask and echo.sample in self._early
            if expected <= echo.sample <= latest and not repeated:
                self._early[echo.sample] = echo
        if echoes[0].sample > expected and self._missing != expected:
            self._missing, self._until_tick = expected, tick + self._overtaking_ticks

    def take(self, expected: int) -> Echo | None:
        """Return the echo of this sample, which is then held no longer."""
        return self._early.pop(expected, None) if expected < self._end_sample else None

    def end_before(self, sample: int) -> None:
        """Take no echo of this sample or a later one: they are not flown."""
        self._end_sample = sample

    def is_lost(self, expected: int, tick: int) -> bool:
        """Return whether the echo of this sample, which was flown, can no longer come."""
        return self._missing == expected < self._end_sample and tick >= self._until_tick

    def clear(self) -> None:
        """Forget everything: a new epoch begins."""
        self._early.clear()
        self._missing = None
