"""Mirrored law: the law is part of the shared state, and only set-points go down, as words.

While nothing changes, command symbols are 0. A 1 announces a word: the number of the output that is
steered, if there are several, then the set-point, most significant bit first. The bits halve the range
low ... high of that output; after each of them the set-point is the middle of what is left.

A set-point takes effect `queue` samples after the first symbol of its word. A word that is complete by
then acts at its exact time; one that is not acts with the bits that have come. Set-points known ahead
(`announce`) are sent that much earlier, and so lose no time at all.

State: set-points in force, set-points as decoded, the word (age, bits left, output, middle, half width),
the queue (oldest first, all outputs of a sample together), the law's memory.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from channel.codec.codec import STATE_MAX, Vector

AGE, LEFT, OUTPUT, MIDDLE, HALF = range(5)
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
        self, law: Law, ranges: Sequence[SetPointRange], outputs: int, bits: int, queue: int
    ) -> None:
        if not 1 <= bits <= BITS_MAX or queue < 0 or not ranges:
            raise ValueError(
                f"a set-point word has 1 to {BITS_MAX} bits, a queue of at least 0 samples and an output "
                f"to steer; got {bits} bits, a queue of {queue} and {len(ranges)} output(s)"
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
        count = len(self.ranges)
        self._word = 2 * count
        self._queue = self._word + 5
        self._memory = self._queue + queue * count
        self._memory_size = len(law.initial())

    @property
    def word_symbols(self) -> int:
        """Return the symbols of a whole word."""
        return 1 + self.address_bits + self.bits

    def quantum(self, place: int) -> float:
        """Return how far two neighbouring set-points of one range lie apart."""
        one = self.ranges[place]
        return (one.high - one.low) / (1 << self.bits)

    def check_set_points(self, targets: Vector) -> None:
        """Raise ValueError, with the numbers, for a set-point that no word can say."""
        for one in self.ranges:
            if not one.low <= targets[one.output] <= one.high:
                raise ValueError(
                    f"the set-point {targets[one.output]:g} of output {one.output} is outside the range "
                    f"of its words, {one.low:g} to {one.high:g}; widen the range or change the set-point"
                )

    def initial(self) -> Vector:
        start = tuple([one.start for one in self.ranges])
        return start + start + (0.0,) * 5 + start * self.queue + self.law.initial()

    def word_age(self, down: Vector) -> int:
        return int(down[self._word + AGE])

    def is_idle(self, down: Vector) -> bool:
        return down[self._word + LEFT] == 0.0

    def encode(self, down: Vector, wanted: Vector, live: Vector) -> int:
        """Return the next bit towards the set-points `wanted`, one for each output of the model."""
        word, count = self._word, len(self.ranges)
        left = down[word + LEFT]
        if left == 0.0:
            return 0 if self._worst(down, wanted) < 0 else 1
        if left > self.bits:
            place = self._worst(down, wanted)
            shift = int(left) - self.bits - 1
            return (place if place > 0 else 0) >> shift & 1
        place = int(down[word + OUTPUT])
        place = place if place < count else count - 1
        return 1 if wanted[self.ranges[place].output] >= down[word + MIDDLE] else 0

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
                after[word + LEFT] = float(self.address_bits + self.bits)
                after[word + OUTPUT] = 0.0
                self._open_word(after)
            return tuple(after)
        after[word + LEFT] = left - 1.0
        if left > self.bits:
            after[word + OUTPUT] = 2.0 * down[word + OUTPUT] + symbol
            self._open_word(after)
            return tuple(after)
        half = 0.5 * down[word + HALF]
        middle = down[word + MIDDLE] + (half if symbol else -half)
        place = int(down[word + OUTPUT])
        if place < count:
            # Every sample since the word began was given the set-point before it; now it is known better.
            after[count + place] = middle
            age = int(down[word + AGE])
            for back in range(1, (age if age < self.queue else self.queue) + 1):
                after[self._queue + (self.queue - back) * count + place] = middle
        after[word + MIDDLE] = middle
        after[word + HALF] = half
        if left == 1:
            after[word : word + 5] = [0.0] * 5
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
        age, left, output = down[self._word : self._word + 3]
        whole = age == int(age) and left == int(left) and output == int(output)
        fits = 0.0 <= left <= self.address_bits + self.bits and 0.0 <= output < 1 << self.address_bits
        return whole and fits and age >= 0.0
