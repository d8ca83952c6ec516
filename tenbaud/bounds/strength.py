"""The strength of a linear plant's disturbance, from outputs and codec states: for the gap gauge.

Between two samples the error of the codec's estimate moves by known matrices, by the corrections, which
are known as well, and by the disturbance. So over a window of some samples the measured errors, less
what the corrections have done, are `z = O e + H w + v`: the error at the window's start, the
disturbance, the encoders' steps. Combinations of z that no e reaches, and in which `H w` and `v` are
uncorrelated, have the variances `s l_i + 1`; the strength s is found from the means of their squares,
by the weights that are best for Gaussian numbers.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import scipy

from channel.codec.codec import Codec
from tenbaud.bounds.linear import Matrix
from transmitter.metrics.gap import Running
from transmitter.session.copies import Confirmed

WINDOW_S = 1.0
GROWTH_MAX = 20.0
"""by which an error may grow within a window: its samples must stay near the linear plant"""
SAMPLES_MAX = 64
SEEN = 10.0
"""A window in which the assumed disturbance moves the outputs by less than this is doubled: in units
of the variance of the encoders' steps."""
STEP_MIN = 1e-6
"""of an output that is read exactly"""
ROUNDS = 20


class LinearStrength:
    """A `Meter`: of a multiple of the assumed disturbance, whose first density is `density`.

    `tick_transition` is that of the corrected states, `tick_noise` the covariance of the assumed
    disturbance, `outputs` C, `steps` those of the encoders.
    """

    def __init__(
        self,
        codec: Codec,
        tick_transition: Matrix,
        tick_noise: Matrix,
        outputs: Matrix,
        steps: Matrix,
        tick_s: float,
        density: float,
    ) -> None:
        count = codec.ticks_per_sample
        size = len(tick_transition)
        powers = [np.linalg.matrix_power(tick_transition, power) for power in range(count + 1)]
        self._codec = codec
        self._density = density
        self._transition = powers[-1]
        self._corrected = powers[-1]
        if not codec.coder.impulse:
            # Held over the sample: by the trapezoidal rule in each tick.
            self._corrected = (
                0.5 * tick_s * np.sum([one + other for one, other in pairwise(powers)], axis=0)
            )
        noise = np.sum([one @ tick_noise @ one.T for one in powers[:-1]], axis=0)
        growth = float(np.abs(np.linalg.eigvals(self._transition)).max())
        least = -(-size // len(outputs)) + 2
        longest = SAMPLES_MAX
        if growth > 1.0:
            longest = min(longest, math.floor(math.log(GROWTH_MAX) / math.log(growth)))
        sample_s = count * tick_s
        self._samples = max(least, min(longest, round(WINDOW_S / sample_s)))
        self._outputs = outputs
        read = np.maximum(steps, STEP_MIN) ** 2 / 12.0
        while True:
            self._whitened, self._variances = _combinations(
                self._transition, noise, outputs, read, self._samples
            )
            if self._variances.max() > SEEN or 2 * self._samples > longest:
                break
            self._samples *= 2
        self.squares: Running[Any] = Running(self._samples * sample_s)
        self._next_sample = -1
        self._known = np.zeros(size)
        self._errors: list[Matrix] = []

    @property
    def value(self) -> float | None:
        """Return the density; None before the first window, and where encoders see no push."""
        return self._strength(self.squares.recent)

    @property
    def whole(self) -> float | None:
        return self._strength(self.squares.whole)

    def add(self, done: Confirmed, measured: tuple[float, ...]) -> None:
        if done.sample != self._next_sample or len(self._errors) == self._samples:
            self._known = np.zeros(len(self._known))
            self._errors.clear()
        self._next_sample = done.sample + 1
        codec, before = self._codec, done.before
        predicted = codec.model.measured(before.model)
        self._errors.append(np.subtract(measured, predicted) - self._outputs @ self._known)
        if len(self._errors) == self._samples:
            self.squares.add((self._whitened @ np.concatenate(self._errors)) ** 2)
        if codec.coder.impulse:
            opened = done.flown.coded[0][: len(self._known)]
            correction = np.subtract(opened, before.model[: len(self._known)])
        else:
            correction = np.array(codec.coder.decode(before.coder, before.model, done.word)[0])
        self._known = self._transition @ self._known - self._corrected @ correction

    def _strength(self, mean: Matrix | None) -> float | None:
        if mean is None:
            return None
        found = 0.0
        for _ in range(ROUNDS):
            weights = self._variances / (1.0 + found * self._variances) ** 2
            found = max(0.0, float(weights @ (mean - 1.0)) / float(weights @ self._variances))
        return found * self._density if found * float(self._variances.max()) > 1.0 else None


def _combinations(
    transition: Matrix, noise: Matrix, outputs: Matrix, steps: Matrix, samples: int
) -> tuple[Matrix, Matrix]:
    """Return the combinations of a window's errors, and their variances by a unit strength."""
    size, count = len(transition), len(outputs)
    seen = [outputs]
    for _ in range(samples - 1):
        seen.append(seen[-1] @ transition)
    pushed = np.zeros((samples * count, samples * count))
    for push in range(samples - 1):
        reached = np.zeros((samples * count, size))
        reached[(push + 1) * count :] = np.concatenate(seen[: samples - push - 1])
        pushed += reached @ noise @ reached.T
    free = scipy.linalg.null_space(np.concatenate(seen).T).T
    read = free * np.tile(steps, samples) @ free.T
    variances, vectors = scipy.linalg.eigh(free @ pushed @ free.T, read)
    return vectors.T @ free, np.maximum(variances, 0.0)
