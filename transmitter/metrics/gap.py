"""The ratio of a flight's error to the theoretical minimum at its rate: the gap gauge.

The floor under the error depends on how hard the plant is pushed about. Nobody measures that torque,
so it is estimated while flying, from what the transmitter has anyway: the encoder, and the codec's
confirmed states. Their difference `delta` moves by the disturbance `w` alone once the corrections and
the model's own restoring torque are taken out, `z'' = w`, so that over a span `W`

    d = z(t + 2W) - 2 z(t + W) + z(t),    var d = (2/3) q W^3

for white `w` of density `q` (rad^2/s^3): the kernel of a second difference is a triangle of height W
on a base of 2W. An encoder of step `s` adds `6 s^2/12`, which is subtracted. A model that is wrong
shows as a disturbance too, and rightly: to the codec it is one. That is the meter of the pitch, far
from its rest too; `tenbaud.bounds.strength` has that of any plant that is linear, or near its rest.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import astuple, dataclass
from typing import Any, Generic, Protocol, TypeVar

from channel.codec.codec import Codec, Vector
from channel.protocol.recording import Field, RecordChannel
from transmitter.session.copies import Confirmed

SPAN_S = 0.5
"""W: long enough for the encoder's steps to vanish in the motion, short beside the model's own time."""
MEMORY_S = 20.0
"""Time constant with which the running figures forget."""
ENCODER_SHARE_MAX = 0.5
"""Where the encoder's steps make more of the bend than this, nothing pushes that it could tell."""
MEASURED_MAX = 1024
"""Samples whose echo may be on its way."""

GAP_CHANNEL = RecordChannel(
    "gap",
    (
        Field("sample", "integer", "", "index of the sample"),
        Field("density", "number", "", "density q of the first disturbance; of a torque in rad^2/s^3"),
        # Which errors have come by then depends on when echoes came.
        Field(
            "rms_over_floor", "number", "", "running rms of the live error over its floor", timing=True
        ),
        Field("ideal_bits", "number", "bit", "an ideal code's, for the same error", timing=True),
    ),
)
GAP_EVERY_S = 1.0


@dataclass(frozen=True, slots=True)
class Limit:
    """The error of an ideal code on this line, as `tenbaud.bounds` computes it.

    Both in terms of a mean square error, over all outputs by their weights, for a disturbance of unit
    density.
    """

    floor: float
    """least mean square error per density q at the flight's bit rate; s^3 for an angle"""
    rate: Callable[[float], float]
    """mean square error per density q -> bit/s that an ideal code needs for it"""
    weights: Vector
    """of the outputs"""


@dataclass(frozen=True, slots=True)
class Gap:
    """The gauge at one moment."""

    density: float
    """q of the first disturbance, as estimated"""
    rms_over_floor: float
    """rms of the live error over the least possible at the same rate; 1 is the limit"""
    ideal_bits: float
    """that an ideal code would have needed so far for the same error"""


class Meter(Protocol):
    """Estimates the density of the first disturbance; without a value where none is seen."""

    @property
    def value(self) -> float | None:
        """Return it as a running mean."""

    @property
    def whole(self) -> float | None:
        """Return it as the mean over all of the flight."""

    def add(self, done: Confirmed, measured: Vector) -> None:
        """Take a confirmed sample and the outputs measured at its first tick; samples in order."""


class StrengthMeter:
    """Estimates the density `q` of the torque that disturbs the plant, in rad^2/s^3.

    `angle_step_rad` is the encoder's step. Estimates are running means over `MEMORY_S`.
    """

    def __init__(self, codec: Codec, tick_s: float, angle_step_rad: float) -> None:
        self._codec = codec
        self._tick_s = tick_s
        self._sample_s = tick_s * codec.ticks_per_sample
        self._span = max(1, round(SPAN_S / self._sample_s))
        span_s = self._span * self._sample_s
        self._per_square = 1.5 / span_s**3
        self._encoder = 6.0 * angle_step_rad**2 / 12.0
        self._idle: Vector = (0.0,) * codec.model.input_size
        self.squares: Running[float] = Running(self._sample_s)
        self._past: deque[float] = deque(maxlen=2 * self._span + 1)
        self._next_sample = -1
        self._position = 0.0
        self._rate = 0.0

    @property
    def value(self) -> float | None:
        """Return `q`; None before the first two spans, and where the encoder sees no push."""
        return self._density(self.squares.recent)

    @property
    def whole(self) -> float | None:
        """Return `q` as the mean over all of the flight."""
        return self._density(self.squares.whole)

    def add(self, done: Confirmed, measured: Vector) -> None:
        """Take a confirmed sample and the encoder's angle at its first tick; samples in order."""
        angle_rad = measured[0]
        if done.sample != self._next_sample:
            self._past.clear()
            self._position = self._rate = 0.0
        self._next_sample = done.sample + 1
        self._past.append(angle_rad - done.before.model[0] + self._position)
        if len(self._past) == 2 * self._span + 1:
            bend = self._past[-1] - 2.0 * self._past[self._span] + self._past[0]
            self.squares.add(bend * bend)
        self._carry_on(done, angle_rad)

    def _density(self, mean: float | None) -> float | None:
        if mean is None or self._encoder > ENCODER_SHARE_MAX * mean:
            return None
        return (mean - self._encoder) * self._per_square

    def _carry_on(self, done: Confirmed, angle_rad: float) -> None:
        """Sum up, as motion, the corrections of the codec's state."""
        codec, before, period = self._codec, done.before, self._sample_s
        (jump, kick, *_), _ = codec.coder.decode(before.coder, before.model, done.word)
        self._position += self._rate * period
        if codec.coder.impulse:
            self._position += jump + kick * period
            self._rate += kick
        else:
            self._position += jump * period + 0.5 * kick * period * period
            self._rate += kick * period
        # The restoring torque differs between the true angle and the estimated one.
        at = (angle_rad, *before.model[1:])
        push = (self._rate_after(at) - self._rate_after(before.model)) / self._tick_s
        self._position -= 0.5 * push * period * period
        self._rate -= push * period

    def _rate_after(self, state: Vector) -> float:
        return self._codec.model.tick(state, self._idle, self._codec.nothing_held)[1]


class GapGauge:
    """Compares the live error with the floor for the disturbance that there is."""

    def __init__(self, limit: Limit, strength: Meter, ticks_per_sample: int, tick_s: float):
        self._limit = limit
        self._strength = strength
        self._ticks_per_sample = ticks_per_sample
        self._tick_s = tick_s
        self._errors: Running[float] = Running(tick_s)
        self._measured: deque[tuple[int, Vector]] = deque(maxlen=MEASURED_MAX)

    def on_outputs(self, tick: int, measured: Vector) -> None:
        """Take the encoders' readings of a tick."""
        sample, within = divmod(tick, self._ticks_per_sample)
        if within == 0:
            self._measured.append((sample, measured))

    def on_confirmed(self, done: Confirmed) -> None:
        """Take a confirmed sample; its outputs have been taken before."""
        measured = self._measured
        while measured and measured[0][0] < done.sample:
            measured.popleft()
        if measured and measured[0][0] == done.sample:
            self._strength.add(done, measured.popleft()[1])

    def on_errors(self, errors: Vector) -> None:
        total = 0.0
        for weight, error in zip(self._limit.weights, errors, strict=True):
            total += weight * error * error
        self._errors.add(total)

    @property
    def now(self) -> Gap | None:
        """Return the running gauge; None while there is nothing to compare."""
        return self._gap(self._strength.value, self._errors.recent)

    @property
    def whole(self) -> Gap | None:
        return self._gap(self._strength.whole, self._errors.whole)

    def row(self, sample: int) -> tuple[object, ...]:
        gap = self.now
        return (sample, None, None, None) if gap is None else (sample, *astuple(gap))

    def _gap(self, density: float | None, mean_square: float | None) -> Gap | None:
        # A density of 0: an encoder without steps, on a plant that nothing has pushed at all.
        if not density or not mean_square:
            return None
        per_density = mean_square / density
        flown_s = self._errors.count * self._tick_s
        ratio = math.sqrt(per_density / self._limit.floor)
        return Gap(density, ratio, self._limit.rate(per_density) * flown_s)


Number = TypeVar("Number", float, Any)


class Running(Generic[Number]):
    """Mean of a stream of numbers, one per period: over all of it, and over the last `MEMORY_S`.

    The numbers may be arrays.
    """

    def __init__(self, period_s: float) -> None:
        self.count = 0
        self._sum: Any = 0.0
        self._recent: Any = 0.0
        self._least = period_s / MEMORY_S

    def add(self, value: Number) -> None:
        self.count += 1
        self._sum = self._sum + value
        # A plain mean until there is enough to forget.
        self._recent = self._recent + (value - self._recent) * max(1.0 / self.count, self._least)

    @property
    def recent(self) -> Number | None:
        """Return the running mean; None without a number."""
        return self._recent if self.count else None

    @property
    def whole(self) -> Number | None:
        """Return the mean of all numbers; None without one."""
        return self._sum / self.count if self.count else None
