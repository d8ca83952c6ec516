"""Both ends of a flight with a narrow downlink, without sessions: the state machine and its hypotheses.

The plant is the pitch axis, `mismatch` off from the model, pushed by white torque. Each kind of
chance has a separate stream, so that flights of one seed, whatever their downlink, have the same
pushes and uplink faults. `full` is the same flight with today's downlink, whose commands and echoes
are exact.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random

from channel.codec.codec import ERASED, Alphabet, Codec, CodecState, Vector, Word
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.downlink.coded import CodedCommands, CodedDirection
from channel.codec.downlink.laws import MirroredLoop, MirroredPid
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay, TwoWayState
from channel.codec.downlink.mirrored import Law, MirroredLaw, SetPointRange
from channel.codec.laws import PidConstants
from channel.codec.lead import fly_sample
from channel.codec.models.pitch import PitchModel, PitchParameters, pitch_constants, pitch_tick
from receiver.controllers.pid import PAPER_GAINS
from transmitter.session.narrow.hypotheses import Confirmed, Hypotheses, Settings

TICK_S = 0.01
TICKS = 10
HALF_PERIOD_SAMPLES = 125
LIMITS = (5.0, 5.0)
NO_SLEW = (math.inf, math.inf)
START = (0.0, 0.0)


def tuned_codec() -> Codec:
    """Return the pitch codec of the trial: a sign a sample, a range that adapts, impulses."""
    coder = ZoomCoder(
        ZoomParameters(
            initial_range=0.05,
            minimum_range=0.015,
            decay=0.9,
            window=3,
            gains=((0.6,), (4.0,)),
            impulse=True,
        )
    )
    return Codec(PitchModel(PitchParameters(), TICK_S), coder, TICKS)


def paper_law() -> MirroredPid:
    """Return the paper's PID law as it is mirrored."""
    constants = PidConstants(*PAPER_GAINS.per_tick(TICK_S), (0.5, -0.5), True)
    return MirroredPid((MirroredLoop(constants, 0, 1),), LIMITS, START, TICK_S)


def mirrored(layout: Layout, queue: int, lead_ticks: int = 0, bits: int = 9) -> TwoWay:
    """Return the state machine with the law in it."""
    ranges = (SetPointRange(0, -2.0, 2.0),)
    scheme = MirroredLaw(paper_law(), ranges, 1, bits, queue, layout)
    return TwoWay(tuned_codec(), scheme, layout, lead_ticks, START, LIMITS, NO_SLEW)


def coded(layout: Layout, direction: CodedDirection, lead_ticks: int = 0) -> TwoWay:
    """Return the state machine with coded commands: the difference of the motors, which is the push."""
    scheme = CodedCommands(START, (direction,))
    return TwoWay(tuned_codec(), scheme, layout, lead_ticks, START, LIMITS, NO_SLEW)


def square(tick: int) -> float:
    """Return the paper's set-point."""
    odd = tick // (TICKS * HALF_PERIOD_SAMPLES) % 2
    return -math.pi / 2 if odd else math.pi / 2


class Line:
    """Loses and flips symbols one by one, or in bursts (chance to enter, chance to leave)."""

    def __init__(
        self, seed: str, loss: float = 0.0, flip: float = 0.0, burst: tuple[float, float] = (0.0, 1.0)
    ) -> None:
        self._random = Random(seed)
        self._loss, self._flip = loss, flip
        self._enter, self._leave = burst
        self._lost = False

    def carry(self, symbol: int, symbols: Sequence[int]) -> int | None:
        chance = self._random.random()
        self._lost = chance >= self._leave if self._lost else chance < self._enter
        lost, flipped = self._random.random() < self._loss, self._random.random() < self._flip
        other = self._random.randrange(len(symbols) - 1)
        if self._lost or lost:
            return None
        if not flipped:
            return symbol
        return [one for one in symbols if one != symbol][other]

    def carry_word(self, word: tuple[int, ...], alphabet: Alphabet) -> Word:
        came = [self.carry(symbol, alphabet.symbols) for symbol in word]
        return ERASED if None in came else tuple([one for one in came if one is not None])


@dataclass(frozen=True)
class Faults:
    """Of both directions: (loss, flip, burst) each."""

    loss_up: float = 0.0
    loss_down: float = 0.0
    flip_up: float = 0.0
    flip_down: float = 0.0
    burst_up: tuple[float, float] = (0.0, 1.0)
    burst_down: tuple[float, float] = (0.0, 1.0)

    @classmethod
    def both(cls, loss: float = 0.0, flip: float = 0.0) -> Faults:
        return cls(loss, loss, flip, flip)

    def up(self, seed: int) -> Line:
        return Line(f"up {seed}", self.loss_up, self.flip_up, self.burst_up)

    def down(self, seed: int) -> Line:
        return Line(f"down {seed}", self.loss_down, self.flip_down, self.burst_down)


class Pitch:
    """The plant, and what it has shown."""

    def __init__(self, seed: int, noise: float, mismatch: float) -> None:
        true = PitchParameters()
        scale = 1.0 + mismatch
        self._constants = pitch_constants(
            PitchParameters(
                true.rate_damping_per_s * scale,
                true.stiffness_per_s2 * scale,
                true.torque_gain_rad_per_v_s2 * scale,
                true.equilibrium_rad,
                true.motor_lag_s,
            ),
            TICK_S,
        )
        self._random = Random(f"plant {seed}")
        self._deviation = math.sqrt(noise / TICK_S)
        self.state: Vector = (0.0, 0.0, 0.0, 0.0)

    def step(self, command: Vector) -> None:
        torque = self._random.gauss(0.0, self._deviation)
        self.state = pitch_tick(self.state, command, (0.0, torque), self._constants)


@dataclass
class Result:
    """What a flight showed; errors are mean squares over its samples, in rad."""

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
    """mean square of applied less commanded, V"""

    def score(self, sample: int, angle: float, estimate: float) -> None:
        self.samples += 1
        if sample <= 20:
            return
        self.scored += 1
        self.error += (angle - estimate) ** 2
        self.largest = max(self.largest, abs(angle - estimate))
        self.tracking += (angle - square(sample * TICKS)) ** 2


Wants = Callable[[int, Vector], Vector]


class NarrowFlight:
    """One flight; `round_trip` in samples. `wanted`: what the receiver's source wants."""

    def __init__(
        self,
        machine: TwoWay,
        wanted: Wants,
        seed: int,
        faults: Faults = Faults(),
        *,
        round_trip: int = 0,
        noise: float = 2e-3,
        mismatch: float = 0.1,
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
        self.plant = Pitch(seed, noise, mismatch)
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
            word = hypotheses.encode(self.plant.state[:1])
            hypotheses.sent(word)
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
        self.result.score(sample, self.plant.state[0], self.state.codec.model[0])
        self._rejoin()

    def _hear(self) -> None:
        sample, heard = self._arriving.popleft()
        if sample < self._start or self.hypotheses.rejoin is not None:
            return
        for done in self.hypotheses.heard(sample, heard):
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
        for tick in range(sample * TICKS, (sample + 1) * TICKS):
            if self.hypotheses.rejoin is None:
                self._last = self.hypotheses.command(tick)
            commanded = self._commands.pop(0)
            self.result.difference += sum(
                (one - other) ** 2 for one, other in zip(self._last, commanded, strict=True)
            ) / (2 * TICKS)
            self.plant.step(self._last)

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
    seed: int,
    samples: int,
    faults: Faults = Faults(),
    *,
    round_trip: int = 0,
    noise: float = 2e-3,
    mismatch: float = 0.1,
) -> Result:
    """Fly with exact commands and echoes, and the command lead of the round trip."""
    plant, up, result = Pitch(seed, noise, mismatch), faults.up(seed), Result()
    state, memory, lead = codec.initial(), law.initial(), round_trip * TICKS
    known: list[Vector] = [START] * lead
    past: deque[tuple[CodecState, tuple[int, ...]]] = deque(maxlen=max(1, round_trip))
    commands: deque[list[Vector]] = deque(maxlen=max(1, round_trip))
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
        word = codec.encode(copy, plant.state[:1])
        past.append((state, word))

        def decide(tick: int, live: Vector) -> Vector:
            nonlocal memory
            targets = (square(tick),)
            command, memory = law.command(memory, targets, codec.model.measured(live), live)
            return command

        flown = fly_sample(
            codec, state, up.carry_word(word, codec.coder.alphabet), tuple(known), decide
        )
        known += flown.commands
        commands.append(known[:TICKS])
        for command in known[:TICKS]:
            plant.step(command)
        del known[:TICKS]
        state = flown.state
        result.score(sample, plant.state[0], state.model[0])
    return result
