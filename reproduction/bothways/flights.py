"""Both ends of a flight with a narrow downlink, without sessions: the state machine and its hypotheses.

Each kind of chance has a separate stream, so that flights of one seed, whatever their downlink, have
the same disturbances and uplink faults. `full` is the same flight with the downlink "full", whose
commands and echoes are exact.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

from channel.codec.codec import ERASED, Codec, CodecState, Vector, Word
from channel.codec.downlink.machine import TwoWay, TwoWayState
from channel.codec.downlink.mirrored import Law
from channel.codec.lead import fly_sample
from reproduction.bothways.lines import CLEAN, Faults
from transmitter.session.narrow.hypotheses import Confirmed, Hypotheses, Settings

SCORED_FROM = 21
"""the first sample of the scores"""


class Body(Protocol):
    """A plant with its encoders."""

    @property
    def measured(self) -> Vector:
        """Return the outputs as they are measured now."""

    @property
    def true(self) -> Vector:
        """Return the outputs as they are now."""

    def step(self, command: Vector) -> None:
        """Hold a command for a tick."""


Targets = Callable[[int], Vector]
"""tick -> the set-points of the outputs that have one"""


@dataclass
class Result:
    """What a flight showed; errors are sums of squares over its samples and outputs."""

    samples: int = 0
    scored: int = 0
    error: float = 0.0
    tracking: float = 0.0
    largest: float = 0.0
    wrong: int = 0
    doubted: int = 0
    """confirmed samples of which another history leads to the same state"""
    confirmed: int = 0
    delays: list[int] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    rejoins: list[int] = field(default_factory=list)
    """samples in which one was asked for"""
    difference: float = 0.0
    """mean square of applied less commanded, summed over the samples"""
    cpu_s: float = 0.0
    """of the transmitter's list"""

    def score(self, true: Vector, estimate: Vector, targets: Vector) -> None:
        self.samples += 1
        if self.samples <= SCORED_FROM:
            return
        self.scored += 1
        for one, other in zip(true, estimate, strict=True):
            self.error += (one - other) ** 2
            self.largest = max(self.largest, abs(one - other))
        # Outputs with a set-point come first.
        for one, other in zip(true, targets, strict=False):
            self.tracking += (one - other) ** 2


Wants = Callable[[int, Vector], Vector]


class NarrowFlight:
    """One flight; `round_trip` in samples. `wanted`: what the receiver's source wants."""

    def __init__(
        self,
        machine: TwoWay,
        wanted: Wants,
        body: Body,
        targets: Targets,
        seed: int,
        faults: Faults = CLEAN,
        *,
        round_trip: int = 0,
        settings: Settings | None = None,
        keep: bool = False,
    ) -> None:
        self.machine = machine
        self.hypotheses = Hypotheses(machine, settings)
        self.state = machine.initial()
        self.result = Result()
        self.confirmed: list[Confirmed] = []
        self.truth: dict[int, tuple[Word, tuple[int, ...], TwoWayState]] = {}
        self.sample = 0
        self.plant = body
        self._targets = targets
        self._wanted = wanted
        self._up, self._down = faults.up(seed), faults.down(seed)
        self._round_trip = round_trip
        self._arriving: deque[tuple[int, tuple[int | None, ...]]] = deque()
        self._commands: list[Vector] = list(self.state.commands)
        self._start = 0
        self._rejoin_at: int | None = None
        self._last: Vector = machine.initial_command
        self._keep = keep

    def corrupt(self, at_receiver: bool) -> None:
        """Change one number of an end's state, by so little that rounding might have done it."""
        if at_receiver:
            self.state = _corrupted(self.state)
            return
        self.hypotheses.sabotage(_corrupted)

    def fly(self, samples: int) -> Result:
        for _ in range(samples):
            self._one()
        return self.result

    def _one(self) -> None:
        sample, hypotheses, machine = self.sample, self.hypotheses, self.machine
        if self._round_trip and self._arriving and self._arriving[0][0] == sample - self._round_trip:
            self._hear()
        waiting = hypotheses.rejoin is not None
        word: Word = ERASED
        if not waiting:
            begin = time.process_time()
            word = hypotheses.encode(self.plant.measured)
            hypotheses.sent(word)
            self.result.cpu_s += time.process_time() - begin
        alphabet = machine.codec.coder.alphabet
        came = self._up.carry_word(word or alphabet.symbols[:1] * alphabet.symbols_per_word, alphabet)
        taken = ERASED if word is ERASED else came
        flown, symbols = machine.fly(self.state, taken, self._wanted)
        self.truth[sample] = (taken, symbols, self.state)
        self.state = flown.state
        self._commands += flown.commands
        heard = tuple([self._down.carry(symbol, (0, 1)) for symbol in symbols])
        self._arriving.append((sample, heard))
        if not self._round_trip:
            self._hear()
        self._apply(sample)
        self.sample += 1
        codec = machine.codec
        self.result.score(
            self.plant.true,
            codec.model.measured(self.state.codec.model),
            self._targets(self.sample * codec.ticks_per_sample),
        )
        self._rejoin()

    def _hear(self) -> None:
        sample, heard = self._arriving.popleft()
        if sample < self._start or self.hypotheses.rejoin is not None:
            return
        begin = time.process_time()
        confirmed = self.hypotheses.heard(sample, heard)
        self.result.cpu_s += time.process_time() - begin
        for done in confirmed:
            word, symbols, before = self.truth[done.sample]
            self.result.confirmed += 1
            self.result.delays.append(done.lag_samples)
            same = (done.word, done.symbols, done.before) == (word, symbols, before)
            self.result.wrong += not same and done.doubt == 0.0
            self.result.doubted += done.doubt > 0.0
            if self._keep:
                self.confirmed.append(done)
        self.result.sizes.append(self.hypotheses.size)
        for old in [one for one in self.truth if one < self.hypotheses.next_confirmed - 1]:
            del self.truth[old]
        if self.hypotheses.rejoin is not None:
            self.result.rejoins.append(self.sample)
            self._rejoin_at = self.sample + 5 + 2 * self._round_trip

    def _apply(self, sample: int) -> None:
        ticks = self.machine.codec.ticks_per_sample
        applied = [self._last] * ticks
        if self.hypotheses.rejoin is None:
            begin = time.process_time()
            applied = [self.hypotheses.command(sample * ticks + at) for at in range(ticks)]
            self.result.cpu_s += time.process_time() - begin
        for command in applied:
            commanded = self._commands.pop(0)
            self.result.difference += sum(
                (one - other) ** 2 for one, other in zip(command, commanded, strict=True)
            ) / (len(command) * ticks)
            self.plant.step(command)
        self._last = applied[-1]

    def _rejoin(self) -> None:
        """Let the transmitter take the receiver's state, some samples after it asked for it."""
        if self._rejoin_at is not None and self.sample > self._rejoin_at:
            self._rejoin_at = None
            self.hypotheses.restart(self.state)
            self._start = self.sample
            self._arriving.clear()
            self.truth.clear()


def _corrupted(state: TwoWayState) -> TwoWayState:
    first, *others = state.codec.model
    model = (first + 1e-12, *others)
    return state._replace(codec=state.codec._replace(model=model))


def full(
    codec: Codec,
    law: Law,
    body: Body,
    targets: Targets,
    start: Vector,
    seed: int,
    samples: int,
    faults: Faults = CLEAN,
    *,
    round_trip: int = 0,
) -> Result:
    """Fly with exact commands and echoes, and the command lead of the round trip."""
    up, result, ticks = faults.up(seed), Result(), codec.ticks_per_sample
    state, memory, lead = codec.initial(), law.initial(), round_trip * codec.ticks_per_sample
    outputs = len(codec.model.measured(state.model))
    known: list[Vector] = [start] * lead
    past: deque[tuple[CodecState, tuple[int, ...]]] = deque(maxlen=max(1, round_trip))
    commands: deque[list[Vector]] = deque(maxlen=max(1, round_trip))

    def decide(tick: int, live: Vector) -> Vector:
        nonlocal memory
        wanted = targets(tick)
        wanted += (0.0,) * (outputs - len(wanted))
        command, memory = law.command(memory, wanted, codec.model.measured(live), live)
        return command

    for sample in range(samples):
        copy = state
        if round_trip > 1 and past:
            # The echo of the sample before the last `round_trip - 1` ones has come.
            recent = list(past)[-(round_trip - 1) :]
            copy = recent[0][0]
            for (_, word), flown_commands in zip(
                recent, list(commands)[-(round_trip - 1) :], strict=True
            ):
                copy = codec.step(copy, word, flown_commands)
        word = codec.encode(copy, body.measured)
        past.append((state, word))
        came = up.carry_word(word, codec.coder.alphabet)
        flown = fly_sample(codec, state, came, tuple(known), decide)
        known += flown.commands
        commands.append(known[:ticks])
        for command in known[:ticks]:
            body.step(command)
        del known[:ticks]
        state = flown.state
        result.score(body.true, codec.model.measured(state.model), targets((sample + 1) * ticks))
    return result
