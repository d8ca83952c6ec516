"""The `direction` coder over its floor, plant by plant, with the coder's own functions, compiled.

    python -m benchmarks.direction [NAME | "NAME RATE" ...]

The plant is the model, driven by white noise. *Known*: of the strength that the coder was designed
for; *unknown*: three times as strong (in amplitude), and the coder adapts. *Encoder*: as designed, the
coder adapting, in closed loop, the sender's state coming from its Kalman filter behind encoders of 4096
counts a turn; beside it the floor behind these encoders, and the number of flights of ten minutes, of
sixteen, that were lost. Scored is the root of the weighted mean square error over all time, over the
continuous causal floor.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from scipy.linalg import solve_discrete_are

from channel.codec.coders.direction import DirectionCoder
from channel.codec.models.linear import LinearModel
from plant_sim.zero_order_hold import discretised, van_loan
from reproduction.axes.alone import SAMPLES, SETTLING, UNKNOWN, products_of, root_of, squares_of
from reproduction.limits.encoder import floor_behind_encoders
from tenbaud.bounds.floor import floor, period_cost
from tenbaud.design.described import plant_of, plant_section
from tenbaud.design.direction import design_direction
from tenbaud.design.observer import linear_observer
from tenbaud.design.plant import LinearPlant
from tenbaud.studies.compiled import arrays_of, compiled

SEEDS = range(8)
STEP = math.tau / 4096
TICKS = 10
"""per sample, for observer and law"""
MINUTES, FLIGHTS = 10.0, 16
LOST = 1.5
"""rad or m of an output"""

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
encode = compiled(DirectionCoder.functions.encode, allocates=True)
decode = compiled(DirectionCoder.functions.decode, allocates=True)


class Ratios(NamedTuple):
    """Rms over the floor: mean over the flights, half the width of its 95 % interval, flights lost."""

    mean: float
    half_width: float
    lost: int = 0


@njit(cache=True)
def closed_loop(
    F: Any, E: Any, C: Any, root: Any, law: Any, gains: Any, M: Any, constants: Any, start: Any,
    samples: int, settling: int, seed: int, step: float, ticks: int, lost: float,
) -> float:  # fmt: skip
    """Fly with `u = -law x_hat`; return the mean of e' M e just after the bits, infinite if lost."""
    np.random.seed(seed)
    n = len(F)
    state, estimate, seen = np.zeros(n), np.zeros(n), np.zeros(n)
    correction = np.zeros(n)
    command = np.zeros(E.shape[1])
    coder, after = start.copy(), start.copy()
    word = np.zeros(1, dtype=np.int64)
    total = 0.0
    for sample in range(samples):
        for tick in range(ticks):
            seen = F @ seen + E @ command
            measured = np.floor((C @ state) / step + 0.5) * step
            seen += gains @ (measured - C @ seen)
            if tick == 0:
                encode(constants, coder, estimate, seen, word)
                decode(constants, coder, estimate, word, False, correction, after)
                coder[:] = after
                estimate += correction
                if sample >= settling:
                    error = state - estimate
                    total += error @ (M @ error)
            command = -(law @ estimate)
            estimate = F @ estimate + E @ command
            state = F @ state + E @ command + root @ np.random.standard_normal(n)
        for output in C @ state:
            if not abs(output) < lost:
                return np.inf
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


def exact(plant: LinearPlant, rate: float, coder: DirectionCoder, strength: float) -> Ratios:
    """Fly the error alone, which is all there is of an exact plant with an exact view of it."""
    products = products_of(plant, rate, coder, strength, SEEDS, SAMPLES)
    least = floor(plant.model(), rate)
    return ratios([math.sqrt(one / least) for one in squares_of(plant, rate, products)])


def behind_encoders(plant: LinearPlant, rate: float, coder: DirectionCoder) -> Ratios:
    """Fly in closed loop behind encoders, by the law of least squares on the estimate."""
    model = plant.model()
    tick_s = 1.0 / rate / TICKS
    F, E = (np.ascontiguousarray(one) for one in discretised(plant.A, plant.B, tick_s))
    _, noise = van_loan(plant.A, plant.noise, tick_s)
    predicts = LinearModel(F.tolist(), E.tolist(), plant.C.tolist(), tick_s)
    observer = linear_observer(predicts, noise, np.array([STEP]))
    states = model.cost + 1e-6 * np.trace(model.cost) * np.eye(len(F))
    inputs = 1e-2 * np.eye(E.shape[1])
    X = solve_discrete_are(F, E, states, inputs)
    law = np.linalg.solve(inputs + E.T @ X @ E, E.T @ X @ F)
    M, between = period_cost(model, 1.0 / rate)
    fixed = (
        F,
        E,
        plant.C,
        root_of(noise),
        law,
        np.array(observer.gains),
        M,
        arrays_of(coder.constants),
    )
    least = floor(model, rate)
    samples = round(MINUTES * 60.0 * rate)
    means = [
        closed_loop(*fixed, np.array(coder.initial()), samples, SETTLING, seed, STEP, TICKS, LOST)
        for seed in range(FLIGHTS)
    ]
    flown = [math.sqrt((mean + between) / least) for mean in means if math.isfinite(mean)]
    return ratios(flown)._replace(lost=FLIGHTS - len(flown))


def ratios(found: list[float]) -> Ratios:
    """Return the mean of several flights and how sure it is."""
    if len(found) < 2:
        return Ratios(math.nan, math.nan)
    half = 1.96 * float(np.std(found, ddof=1)) / math.sqrt(len(found))
    return Ratios(float(np.mean(found)), half)


def main(names: list[str]) -> int:
    """Print a table."""
    print(f"{'plant':20} bit/s  known            unknown          encoder          floor  lost")
    for name, plant, rate in plants():
        if names and not any(f"{name} {rate:g}".startswith(one) for one in names):
            continue
        designed = design_direction(plant, rate, 1.0 / rate)
        known, unknown = DirectionCoder(replace(designed, adapts=False)), DirectionCoder(designed)
        columns = (
            exact(plant, rate, known, 1.0),
            exact(plant, rate, unknown, UNKNOWN),
            behind_encoders(plant, rate, unknown),
        )
        behind = floor_behind_encoders(plant, [STEP], 1.0 / rate / TICKS, rate)
        yardstick = math.sqrt(behind / floor(plant.model(), rate))
        texts = "  ".join(f"{one.mean:6.3f} +- {one.half_width:5.3f}" for one in columns)
        print(
            f"{name:20} {rate:5g} {texts}  {yardstick:5.3f}  {columns[-1].lost}/{FLIGHTS}", flush=True
        )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
