"""The flights of the page, flown on two cores."""

from __future__ import annotations

import multiprocessing
import signal
from collections import defaultdict
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field

from reproduction.limits.candidates import CANDIDATES, PRESETS
from reproduction.limits.flight import FINE_COUNTS, RIG_COUNTS, Case, Errors, fly
from reproduction.limits.tracking import fly_tracking, tracking_cases

RATES = (5.0, 10.0, 20.0, 40.0)
DENSITIES = (2e-4, 2e-3, 2e-2)
NOMINAL = 2e-3
WORKERS = 2

OnProgress = Callable[[float, float], None]
Cell = tuple[str, float, float, bool, int]


@dataclass(frozen=True, slots=True)
class Scale:
    """How much is flown."""

    seeds: int
    seconds: float
    closed_seeds: int
    closed_seconds: float


FULL = Scale(16, 110.0, 6, 125.0)
QUICK = Scale(4, 60.0, 4, 75.0)


@dataclass(slots=True)
class Outcome:
    """All flights by cell, a list over the seeds each; and the tracking flights by name."""

    flights: dict[Cell, list[Errors]] = field(default_factory=lambda: defaultdict(list))
    tracking: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    scale: Scale = FULL


def cases(scale: Scale) -> list[Case]:
    """Return every flight of the table; equal seeds for every coder."""
    found = []
    for rate in RATES:
        for density in DENSITIES:
            for candidate in CANDIDATES:
                for seed in range(1, scale.seeds + 1):
                    one = Case(candidate.key, rate, density, seed, scale.seconds)
                    found.append(one)
                    if density == NOMINAL:
                        found.append(
                            Case(candidate.key, rate, density, seed, scale.seconds, False, RIG_COUNTS)
                        )
                found += [
                    Case(candidate.key, rate, density, seed, scale.closed_seconds, True, FINE_COUNTS)
                    for seed in range(1, scale.closed_seeds + 1)
                ]
    return found + [
        Case(preset, rate, density, seed, scale.seconds, counts=counts)
        for preset, rate in PRESETS.items()
        for density in DENSITIES
        for counts in (FINE_COUNTS, RIG_COUNTS)
        for seed in range(1, scale.seeds + 1)
    ]


def fly_all(scale: Scale, on_progress: OnProgress) -> Outcome:
    """Fly everything, two at a time."""
    outcome = Outcome(scale=scale)
    batches = _batches(cases(scale), 8)
    extra = tracking_cases(scale.closed_seeds)
    total = float(len(batches) + len(extra))
    # spawn: a forked child would inherit the locks of whatever threads the parent has.
    context = multiprocessing.get_context("spawn")
    done = 0.0
    with ProcessPoolExecutor(WORKERS, context, initializer=_leave_interrupts_to_parent) as pool:
        flights = {pool.submit(_fly_batch, batch): batch for batch in batches}
        trackings = {pool.submit(fly_tracking, one): one for one in extra}
        for flown in as_completed(flights):
            done += 1.0
            on_progress(done, total)
            flown.result()
        for tracked in as_completed(trackings):
            done += 1.0
            on_progress(done, total)
            tracked.result()
    # In the order in which they were asked for, so that seeds stay in line and sums are the same.
    for future, batch in flights.items():
        for case, errors in zip(batch, future.result(), strict=True):
            outcome.flights[case.cell].append(errors)
    for future_tracking, one in trackings.items():
        outcome.tracking[one.name].append(future_tracking.result())
    return outcome


def _batches(wanted: list[Case], size: int) -> list[list[Case]]:
    return [wanted[start : start + size] for start in range(0, len(wanted), size)]


def _fly_batch(batch: list[Case]) -> list[Errors]:
    return [fly(case) for case in batch]


def _leave_interrupts_to_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
