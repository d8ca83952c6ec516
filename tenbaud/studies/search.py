"""The search for constants: CMA-ES (the package `cma`) within the unit cube."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

import numpy as np

SPREAD = 0.15
"""standard deviation of the first candidates, as a share of the ranges"""


def minimise(error_at: Callable[[Any], float], start: Sequence[float], seed: int) -> None:
    """Search until nothing gets better, or `error_at` raises; the same chances for the same seed."""
    cma: Any = import_module("cma")
    random = np.random.default_rng(seed)
    search = cma.CMAEvolutionStrategy(
        # It wants two dimensions at least; what is beyond the constants changes nothing.
        [*start, 0.5] if len(start) == 1 else list(start),
        SPREAD,
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
