"""The search for constants: its trials, and CMA-ES (the package `cma`) within the unit cube."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Generic, TypeVar

import numpy as np

from tenbaud.studies.judging import NO_CONSTANTS, Judged

SPREAD = 0.3
"""distance of the first candidates from the start, with ranges of length 1"""

OnEvaluation = Callable[[int, float], None]
"""(sets of constants flown, smallest error so far)"""
Tried = TypeVar("Tried")


class Spent(Exception):
    """The search has flown the requested number of sets of constants, or was stopped."""


@dataclass(slots=True)
class Trials(Generic[Tried]):
    """The trials of a search, counted, and the best one."""

    judge: Callable[[Tried], Judged]
    most: int
    on_evaluation: OnEvaluation
    best: Judged
    found: Tried
    """the constants of the best"""
    lost_error: float
    """of constants that make no flight at all"""
    should_stop: Callable[[], bool] = lambda: False
    keeps_lost: bool = True
    """constants with which some of the flights have no figures may be the best"""
    count: int = 0
    penalised: int = 0
    """trials that made no flight or left some of the flights without figures"""
    last_reason: str = ""
    """why the last of those had no figures"""

    def error_of(self, make: Callable[[], Tried]) -> float:
        """Return the error of the constants that `make` returns; Spent when it is enough."""
        if self.count >= self.most or self.should_stop():
            raise Spent
        tried = self.found
        try:
            tried = make()
            judged = self.judge(tried)
        except NO_CONSTANTS as error:
            # Some corners of the ranges are no coder at all; how many, the report says.
            judged = Judged(self.lost_error, 1, 1, str(error))
        self.note(tried, judged)
        return judged.rms_rad

    def note(self, tried: Tried, judged: Judged) -> None:
        """Count one set of constants, and keep it if it is the best."""
        self.count += 1
        self.penalised += judged.lost > 0
        self.last_reason = judged.reason or self.last_reason
        if judged.rms_rad < self.best.rms_rad and (self.keeps_lost or not judged.lost):
            self.best, self.found = judged, tried
        self.on_evaluation(self.count, self.best.rms_rad)


def minimise(error_at: Callable[[Any], float], start: Sequence[float], seed: int) -> None:
    """Search until nothing gets better, or `error_at` raises; the same chances for the same seed."""
    cma: Any = import_module("cma")
    random = np.random.default_rng(seed)
    search = cma.CMAEvolutionStrategy(
        # It wants two dimensions at least; what is beyond the constants changes nothing.
        [*start, 0.5] if len(start) == 1 else list(start),
        SPREAD / math.sqrt(max(len(start), 4)),
        {
            "bounds": [0.0, 1.0],
            "seed": seed + 1,
            "randn": lambda *shape: random.standard_normal(shape),
            "verbose": -9,
        },
    )
    while not search.stop():
        candidates = search.ask()
        search.tell(candidates, [error_at(one[: len(start)]) for one in candidates])
