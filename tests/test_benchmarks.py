"""Every benchmark at its smallest size: none is broken. What it measures here says nothing."""

from __future__ import annotations

from typing import Any

import pytest

SMALL: dict[str, tuple[Any, ...]] = {
    "codec": (),
    "start": (1,),
    "virtual": (1,),
    "real": (3.0,),
    "fly": (2,),
    "memory": (30_000,),
    "latency": (),
    "fastest": ((1000,), 2.0),
    "load": ((2, 4), (4,), 6.0),
    "logs": (200_000,),
    "page": (),
    "in_browser": (),
    "recordings": (1, 30_000),
    "studies": (),
}
"""Arguments of each."""

CONSTANTS: dict[str, dict[str, float]] = {
    "codec": {"ROUNDS": 2},
    "latency": {"ROUNDS": 1, "PINGS": 40, "WARM_UP": 5},
    "page": {"MEASURED_S": 2.0, "PAINTS": 1, "SLICES": 2},
    "in_browser": {"OPENINGS": 1, "FLOWN_S": 2.0},
    "studies": {"ROUNDS": 1, "FLIGHTS": 2},
}
"""Of the module of a benchmark without arguments."""


def test_every_benchmark_has_a_smallest_size() -> None:
    from benchmarks.__main__ import BENCHMARKS

    assert set(SMALL) == set(BENCHMARKS)


@pytest.mark.soak
@pytest.mark.parametrize("name", SMALL)
def test_a_benchmark_of_the_smallest_size_returns_its_figures(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from benchmarks.__main__ import BENCHMARKS
    from benchmarks.browser import why_no_browser

    if name in ("page", "in_browser") and (problem := why_no_browser()):
        pytest.skip(problem)
    for constant, value in CONSTANTS.get(name, {}).items():
        monkeypatch.setattr(f"benchmarks.{name}.{constant}", value)
    figures = list(BENCHMARKS[name](*SMALL[name]))
    names = [figure.name for figure in figures]
    assert names
    assert len(set(names)) == len(names)
    assert all(isinstance(figure.value, int | float) for figure in figures)
