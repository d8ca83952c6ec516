"""Mirrored law: the law is part of the shared state, and only set-points go down, as words.

While nothing changes, command symbols are 0. A 1 announces a word. Its bits, most significant first,
say how many samples ago the set-point changed (where not every sample has a command symbol, and the
queue is long enough for it to matter), which of the steered outputs it is for (where there are
several), and the set-point: each bit halves the range low ... high of its output, and leaves the
middle as the set-point.

A set-point takes effect `queue` samples after it changed. A word that is complete by then acts at its
exact time; one that is not acts with the bits that have come. Set-points that are known `queue`
samples ahead are sent that much earlier, and so lose no time at all.

State: set-points in force, set-points as decoded, the word (age, bits left, samples ago, output,
middle, half width), the queue (oldest first, all outputs of a sample together), the law's memory.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

from channel.codec.codec import STATE_MAX, Vector
from channel.codec.downlink.layout import Layout

AGE, LEFT, BACK, OUTPUT, MIDDLE, HALF = range(6)
WORD = 6
BITS_MAX = 24


class Law(Protocol):
    """A law in the codec's arithmetic. Every method is pure."""

    def initial(self) -> Vector:
        """Return the memory that the law starts with."""

    def command(
        self, memory: Vector, targets: Vector, outputs: Vector, state: Vector
    ) -> tuple[Vector, Vector]:
        """Return (command of a tick, next memory). `targets` has a set-point for each output."""


class SetPointRange(NamedTuple):
    """The set-points of one output."""

    output: int
    low: float
    high: float
    start: float = 0.0
    """before the first word"""


class MirroredLaw:
    """A `Scheme`; see the module's text. `outputs`: how many the model has; those steered have a range.

    ValueError, with the numbers, for words that cannot be.
    """

    asks_every_tick = False

    def __init__(
        self,
        law: Law,
        ranges: Sequence[SetPointRange],
        outputs: int,
        bits: int,
        queue: int,
        layout: Layout,
    ) -> None:
        if not 1 <= bits <= BITS_MAX or queue < 0 or not ranges:
            raise ValueError(
                f"a set-point word has 1 to {BITS_MAX} bits, a queue of at least 0 samples and an "
                f"output to steer; got {bits} bits, a queue of {queue} and {len(ranges)} output(s)"
            )
        for one in ranges:
            if not -STATE_MAX < one.low <= one.start <= one.high < STATE_MAX or one.low == one.high:
                raise ValueError(
                    f"the set-points of output {one.output} start at {one.start:g} in a range of "
                    f"{one.low:g} to {one.high:g}; the range must hold the start and not be empty"
                )
        if sorted({one.output for one in ranges} & set(range(outputs))) != sorted(
            [one.output for one in ranges]
        ):
            raise ValueError(
                f"outputs {[one.output for one in ranges]} are steered; there are {outputs}, and each "
                "has one range at most"
            )
        self.law = law
        self.ranges = tuple(ranges)
        self.bits = bits
        self.queue = queue
        self.outputs = outputs
        self.address_bits = (len(self.ranges) - 1).bit_length()
        self.back_max = layout.command_period - 1
        self.back_bits = self.back_max.bit_length()
        self.queue_needed = layout.word_samples(self.word_symbols) + self.back_max
        """samples ahead of which a set-point must be known to act at its exact time"""
        if queue < self.queue_needed:
            # Bits that change nothing in the end could never be confirmed.
            self.back_max = self.back_bits = 0
        count = len(self.ranges)
        self._word = 2 * count
        self._queue = self._word + WORD
        self._memory = self._queue + queue * count
        self._memory_size = len(law.initial())

    @property
    def word_symbols(self) -> int:
        """Return the symbols of a whole word."""
        return 1 + self.back_bits + self.address_bits + self.bits

    def quantum(self, place: int) -> float:
        """Return how far two neighbouring set-points of one range lie apart."""
        one = self.ranges[place]
        return (one.high - one.low) / (1 << self.bits)

    def initial(self) -> Vector:
        start = tuple([one.start for one in self.ranges])
        return start + start + (0.0,) * WORD + start * self.queue + self.law.initial()

    def word_age(self, down: Vector) -> int:
        return int(down[self._word + AGE])

    def is_idle(self, down: Vector) -> bool:
        return down[self._word + LEFT] == 0.0

    def encode(self, down: Vector, wanted: Callable[[int], Vector], live: Vector) -> int:
        """Return the next bit of the set-points that were wanted when the word began.

        `wanted` gives one for each output of the model.
        """
        word = down[self._word : self._word + WORD]
        left = int(word[LEFT])
        age = int(word[AGE])
        targets = wanted(age)
        if left == 0:
            return 0 if self._worst(down, targets) < 0 else 1
        worst = self._worst(down, targets)
        worst = worst if worst > 0 else 0
        if left > self.address_bits + self.bits:
            shift = left - self.address_bits - self.bits - 1
            return self._changed_ago(wanted, age, worst) >> shift & 1
        if left > self.bits:
            return worst >> (left - self.bits - 1) & 1
        place = int(word[OUTPUT])
        place = place if place < len(self.ranges) else len(self.ranges) - 1
        return 1 if targets[self.ranges[place].output] >= word[MIDDLE] else 0

    def _changed_ago(self, wanted: Callable[[int], Vector], age: int, place: int) -> int:
        """Return for how many samples before the word began its set-point was wanted already."""
        output = self.ranges[place].output
        target = wanted(age)[output]
        back = 0
        while back < self.back_max:
            off = wanted(age + back + 1)[output] - target
            if not -0.5 * self.quantum(place) <= off <= 0.5 * self.quantum(place):
                break
            back += 1
        return back

    def _worst(self, down: Vector, wanted: Vector) -> int:
        """Return which set-point is furthest off, in quanta; -1: none is by more than rounding is."""
        count = len(self.ranges)
        best, worst = -1, 0.5 + 1e-9
        for place in range(count):
            one = self.ranges[place]
            value = wanted[one.output]
            value = one.low if value < one.low else value
            value = one.high if value > one.high else value
            off = (value - down[count + place]) / self.quantum(place)
            off = off if off >= 0.0 else -off
            if off > worst:
                best, worst = place, off
        return best

    def take(self, down: Vector, symbol: int) -> Vector:
        word, count = self._word, len(self.ranges)
        after = list(down)
        left = int(down[word + LEFT])
        if left == 0:
            if symbol:
                after[word + LEFT] = float(self.word_symbols - 1)
                self._open_word(after)
            return tuple(after)
        after[word + LEFT] = left - 1.0
        if left > self.bits:
            at = word + (BACK if left > self.address_bits + self.bits else OUTPUT)
            after[at] = 2.0 * down[at] + symbol
            self._open_word(after)
            return tuple(after)
        half = 0.5 * down[word + HALF]
        middle = down[word + MIDDLE] + (half if symbol else -half)
        place = int(down[word + OUTPUT])
        if place < count:
            # The samples since it changed were given the set-point before it; now it is known better.
            after[count + place] = middle
            samples = int(down[word + AGE] + down[word + BACK])
            for back in range(1, (samples if samples < self.queue else self.queue) + 1):
                after[self._queue + (self.queue - back) * count + place] = middle
        after[word + MIDDLE] = middle
        after[word + HALF] = half
        if left == 1:
            after[word : word + WORD] = [0.0] * WORD
        return tuple(after)

    def _open_word(self, after: list[float]) -> None:
        """Begin with the whole range of the output that the word is about."""
        place = int(after[self._word + OUTPUT])
        one = self.ranges[place if place < len(self.ranges) else 0]
        after[self._word + MIDDLE] = 0.5 * (one.low + one.high)
        after[self._word + HALF] = 0.5 * (one.high - one.low)

    def guess(self, down: Vector) -> Vector:
        """Return the state without news: a bit of a word is left for later."""
        return down

    def settle(self, down: Vector) -> Vector:
        word, count = self._word, len(self.ranges)
        after = list(down)
        if down[word + LEFT] > 0.0:
            after[word + AGE] = down[word + AGE] + 1.0
        if self.queue == 0:
            after[:count] = down[count:word]
            return tuple(after)
        after[:count] = down[self._queue : self._queue + count]
        after[self._queue : self._memory] = [
            *down[self._queue + count : self._memory],
            *down[count:word],
        ]
        return tuple(after)

    def command(self, down: Vector, outputs: Vector, live: Vector) -> tuple[Vector, Vector]:
        targets = [0.0] * self.outputs
        for place in range(len(self.ranges)):
            targets[self.ranges[place].output] = down[place]
        command, memory = self.law.command(down[self._memory :], tuple(targets), outputs, live)
        return command, down[: self._memory] + memory

    def is_state(self, down: Vector) -> bool:
        if len(down) != self._memory + self._memory_size:
            return False
        for value in down:
            if not -STATE_MAX < value < STATE_MAX:
                return False
        age, left, back, output = down[self._word : self._word + MIDDLE]
        for value in (age, left, back, output):
            if value < 0.0 or value != int(value):
                return False
        return left < self.word_symbols and output < 1 << self.address_bits and back <= self.back_max
