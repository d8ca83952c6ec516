"""Runs every benchmark, or those named: `python -m benchmarks codec virtual`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from benchmarks.codec import codec_figures
from benchmarks.fastest import fastest_figures
from benchmarks.figures import Figure, show, write
from benchmarks.flights import (
    cold_start_figures,
    fly_figures,
    memory_figures,
    real_figures,
    virtual_figures,
)
from benchmarks.in_browser import in_browser_figures
from benchmarks.latency import latency_figures
from benchmarks.load import load_figures
from benchmarks.logs import log_figures
from benchmarks.page import page_figures
from benchmarks.recordings import recording_figures
from benchmarks.studies import studies_figures

BENCHMARKS: dict[str, Callable[..., Iterable[Figure]]] = {
    "codec": codec_figures,
    "start": cold_start_figures,
    "virtual": virtual_figures,
    "real": real_figures,
    "fly": fly_figures,
    "memory": memory_figures,
    "latency": latency_figures,
    "fastest": fastest_figures,
    "load": load_figures,
    "logs": log_figures,
    "page": page_figures,
    "in_browser": in_browser_figures,
    "recordings": recording_figures,
    "studies": studies_figures,
}


def main(names: list[str]) -> int:
    """Run the named benchmarks, all without names; return the exit code."""
    unknown = [name for name in names if name not in BENCHMARKS]
    if unknown:
        print(f"no benchmark {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    figures: list[Figure] = []
    failures: list[str] = []
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        for name in names or BENCHMARKS:
            task = progress.add_task(name)
            try:
                # One by one: what was measured before a flight failed is kept.
                figures.extend(BENCHMARKS[name]())
            except RuntimeError as failure:
                failures.append(f"{name}: {failure}")
            progress.remove_task(task)
    show(figures)
    write(figures, Path("bench.json"))
    for text in failures:
        print(text, file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
