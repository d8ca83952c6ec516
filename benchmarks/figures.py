"""One measured figure, and the table that they make together."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table


@dataclass(frozen=True, slots=True)
class Figure:
    """A named figure; `target` says in words what it should be."""

    name: str
    value: float
    unit: str
    target: str = ""


def show(figures: list[Figure]) -> None:
    """Print a table, one figure per line."""
    table = Table(title="benchmarks", title_justify="left")
    table.add_column("figure")
    table.add_column("measured", justify="right")
    table.add_column("unit")
    table.add_column("asked")
    for figure in figures:
        table.add_row(figure.name, f"{figure.value:.4g}", figure.unit, figure.target)
    Console().print(table)


def write(figures: list[Figure], path: Path) -> None:
    """Write the figures as JSON, by name."""
    by_name = {figure.name: asdict(figure) for figure in figures}
    path.write_text(json.dumps(by_name, indent=2) + "\n")
