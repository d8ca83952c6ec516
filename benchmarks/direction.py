"""The `direction` coder over its floor, plant by plant, with the coder's own functions, compiled.

    python -m benchmarks.direction [NAME ...]

The plant is the model, driven by white noise. *Told*: of the strength that the coder was designed
for; *untold*: three times as strong (in amplitude), and the coder adapts. *Encoder*: told, the sender's
state coming from its Kalman filter behind an encoder of 4096 counts a turn on every output. Scored is
the root of the weighted mean square error over all time, over the continuous causal floor.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from channel.codec.coders.direction import DirectionCoder
from tenbaud.bounds.floor import floor, period_cost
from tenbaud.bounds.linear import sampled
from tenbaud.design.described import plant_of, plant_section
from tenbaud.design.direction import design_direction
from tenbaud.design.plant import LinearPlant
from tenbaud.studies.compiled import arrays_of, compiled

SAMPLES = 12_000
SETTLING = 500
SEEDS = range(8)
UNTOLD = 3.0
STEP_RAD = math.tau / 4096
TICKS = 10
"""per sample, for the sender's observer"""

UNEQUAL = (2e-6, 2e-6, 2e-3)
"""densities of travel, elevation and pitch"""

RATES = {
    "integrator": (10.0,),
    "pitch": (5.0, 10.0, 20.0),
    "pendulum": (12.7, 15.8, 20.0, 30.0),
    "servo": (10.0, 20.0),
    "furuta": (35.0, 50.0),
    "aero": (10.0, 20.0),
    "cart-pole": (20.0, 30.0, 50.0),
    "helicopter": (10.0, 20.0, 30.0),
    "helicopter, unequal": (10.0, 20.0, 30.0),
}
ENCODE, DECODE = DirectionCoder.functions[:2]
encode = compiled(ENCODE, allocates=True)
decode = compiled(DECODE, allocates=True)


@dataclass(frozen=True, slots=True)
class Ratios:
    """Rms over the floor: mean over seeds, and half the width of its 95 % interval."""

    mean: float
    half_width: float
    largest: float


@njit
def estimate(
    F: Any,
    root: Any,
    M: Any,
    constants: Any,
    start: Any,
    bits: int,
    samples: int,
    settling: int,
    seed: int,
) -> float:
    """Return the mean of e' M e just after the bits; `root` is that of the noise's covariance."""
    np.random.seed(seed)
    n = len(F)
    error = np.zeros(n)
    zero = np.zeros(n)
    correction = np.zeros(n)
    coder = start.copy()
    after = start.copy()
    word = np.zeros(bits, dtype=np.int64)
    total = 0.0
    for sample in range(samples):
        encode(constants, coder, zero, error, word)
        decode(constants, coder, zero, word, False, correction, after)
        coder[:] = after
        error -= correction
        if sample >= settling:
            total += error @ (M @ error)
        error = F @ error + root @ np.random.standard_normal(n)
    return total / (samples - settling)


def plants() -> Iterator[tuple[str, LinearPlant, float]]:
    """Yield (name, plant, rate)."""
    for name, rates in RATES.items():
        section = plant_section(name.partition(",")[0])
        if "unequal" in name:
            section = section.model_copy(update={"densities": UNEQUAL})
        plant = plant_of(section, 0.01)
        assert plant is not None
        for rate in rates:
            yield name, plant, rate


def ratios(plant: LinearPlant, rate: float, *, strength: float = 1.0, adapts: bool = False) -> Ratios:
    """Fly the error alone, which is all there is of an exact plant with an exact sight of it."""
    model = plant.model()
    period = 1.0 / rate
    coder = DirectionCoder(design_direction(plant, rate, period, adapts=adapts))
    F, Q = (np.ascontiguousarray(one) for one in sampled(model, period))
    M, between = period_cost(model, period)
    root = np.linalg.cholesky(Q + 1e-13 * np.diag(np.diag(Q)))
    least = floor(model, rate)
    found = []
    for seed in SEEDS:
        mean = estimate(
            F, strength * root, M, arrays_of(coder.constants), np.array(coder.initial()), 1,
            SAMPLES, SETTLING, 1000 + seed,
        )  # fmt: skip
        found.append(math.sqrt((mean / strength**2 + between) / least))
    return _ratios(found)


def _ratios(found: list[float]) -> Ratios:
    half = 1.96 * float(np.std(found, ddof=1)) / math.sqrt(len(found))
    return Ratios(float(np.mean(found)), half, max(found))


def main(names: list[str]) -> int:
    """Print a table."""
    for name, plant, rate in plants():
        if names and not any(name.startswith(one) for one in names):
            continue
        told = ratios(plant, rate)
        untold = ratios(plant, rate, strength=UNTOLD, adapts=True)
        print(
            f"{name:22} {rate:5g}   {told.mean:.3f} +- {told.half_width:.3f}"
            f"   {untold.mean:.3f} +- {untold.half_width:.3f}", flush=True,
        )  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
