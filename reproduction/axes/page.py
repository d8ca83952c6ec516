"""The tables of docs/THREE-AXES.md, put between the marks of the page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from reproduction.axes.alone import DENSITIES, OUTPUTS, RATES, SAMPLES, Row, row_of
from reproduction.axes.flights import (
    BOXES_S,
    FIXED_CODER,
    LINEAR_S,
    PRESETS,
    USUAL,
    Tracked,
    errors_in_all,
    tracked,
)
from reproduction.axes.picture import draw_mission
from reproduction.limits.intervals import mean_of, paired
from tenbaud.files.whole import make_folder, write_whole

PAGE = Path(__file__).parents[2] / "docs" / "THREE-AXES.md"
END = "<!-- end -->"

OnPart = Callable[[float, str], None]


class Scale(NamedTuple):
    """How much is flown."""

    seeds: int
    samples: int = SAMPLES
    boxes_s: float = BOXES_S
    linear_s: float = LINEAR_S


FULL = Scale(16)


def make_page(docs: Path, scale: Scale, on_part: OnPart) -> Path:
    """Fly everything, and write page and picture into a folder."""
    cells = [(name, rate) for name in DENSITIES for rate in RATES]
    parts = len(cells) + len(PRESETS) + 2
    rows, flown = [], []
    for number, (name, rate) in enumerate(cells):
        on_part(number / parts, f"{name} q, {rate:g} bit/s")
        rows.append(row_of(name, rate, scale.seeds, scale.samples))
    for number, preset in enumerate(PRESETS, len(cells)):
        on_part(number / parts, preset)
        flown.append(tracked(preset, range(1, scale.seeds + 1), scale.boxes_s))
    on_part((parts - 2) / parts, "three fixed coders")
    fixed = _fixed(scale)
    on_part((parts - 1) / parts, "the picture")
    draw_mission(make_folder(docs / "figures") / "three-axes.png")
    tables = {"ratios": _ratios(rows), "boxes": _boxes(flown), "fixed": fixed}
    text = PAGE.read_text(encoding="utf-8")
    for name, table in tables.items():
        before, mark, rest = text.partition(f"<!-- table: {name} -->\n")
        _, end, after = rest.partition(END)
        if not (mark and end):
            raise ValueError(f"{PAGE.name} has no place for the table {name}")
        text = before + mark + table + end + after
    write_whole(docs / PAGE.name, text)
    return docs / PAGE.name


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _ratios(rows: Sequence[Row]) -> str:
    head = ["q", "bit/s", "known", "unknown", "least rms of all", *(f"{one}, known" for one in OUTPUTS)]
    return _table(
        head,
        [
            [
                row.densities,
                f"{row.rate_bit_s:g}",
                _words(row.known),
                _words(row.unknown),
                f"{row.least_degrees:.3f}°",
                *[f"{one:.3f}°" for one in row.degrees],
            ]
            for row in rows
        ],
    )


def _boxes(flown: Sequence[Tracked]) -> str:
    usual = next(one for one in flown if one.preset == USUAL)
    head = ["preset", "bit/s", "tracking: travel, rad", "elevation, rad", "over the usual loop"]
    head += [f"estimate: {name}, mrad" for name in OUTPUTS]
    rows = []
    for one in flown:
        over = [
            f"{ours.value / theirs.value:.2f}"
            for ours, theirs in zip(one.tracking, usual.tracking, strict=True)
        ]
        rows.append(
            [
                f"`{one.preset}`",
                f"{one.bit_s:g}",
                *[f"{ratio.value:.3f} ± {ratio.half:.3f}" for ratio in one.tracking],
                ", ".join(over),
                *[_words(ratio) for ratio in one.estimate_mrad],
            ]
        )
    return _table(head, rows)


def _fixed(scale: Scale) -> str:
    seeds = range(1, scale.seeds + 1)
    ours, theirs = (
        errors_in_all(coder, seeds, scale.linear_s) for coder in ({"kind": "direction"}, FIXED_CODER)
    )
    ratio = paired([one**2 for one in ours], [one**2 for one in theirs])
    rows = [
        [name, _words(mean_of([1e3 * one for one in errors]))]
        for name, errors in (
            ("`direction`, a bit where it is worth most", ours),
            ("three `zoom`, a sign each every 0.3 s", theirs),
        )
    ]
    rows.append(["ratio", f"**{ratio.value:.2f} ± {ratio.half:.2f}**"])
    return _table(["coder, 10 bit/s in all", "rms error of all three angles, mrad"], rows)


def _words(ratio: object) -> str:
    return str(ratio).replace("+-", "±")
