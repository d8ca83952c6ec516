"""Picture and tables of docs/theory/cliff.md."""

from __future__ import annotations

from pathlib import Path

from reproduction.cliff import PLANTS, Found, Point, smallest_rate
from tenbaud.files.whole import write_whole
from tenbaud.recording.style import FAINT, LINE_B, LINE_C, save

BEGIN, END = "<!-- made by `tenbaud figures cliff` -->", "<!-- end of what is made -->"
NAMES = {"pendulum": "Pendulum", "furuta": "Rotary pendulum"}
CURVES = (
    (True, "start", LINE_B, "-", "o"),
    (True, "end", LINE_C, "-", "s"),
    (False, "start", LINE_B, "--", "^"),
    (False, "end", LINE_C, "--", "v"),
)
"""exact plant, delivery, and how it is drawn"""
WORST = 20.0
"""rms over the floor, at the top of the picture"""


def draw(paths: list[Path], found: dict[Point, Found]) -> None:
    """Draw share of flights up, and rms over the floor, against R over R0."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.4, 5.6), layout="constrained")
    panels = figure.subplots(2, 2, sharex=True, sharey="row")
    for (above, below), plant in zip(panels.T, PLANTS, strict=True):
        for panel in (above, below):
            panel.grid(visible=True, color="#e6e6e6", linewidth=0.6)
            panel.set_axisbelow(True)
            panel.spines[["top", "right"]].set_visible(False)
            panel.axvline(1.0, color=FAINT, linewidth=1.2)
        for exact, delivery, colour, line, marker in CURVES:
            points = [one for one in found if (one.plant, one.exact) == (plant, exact)]
            points = sorted((one for one in points if one.delivery == delivery), key=_ratio)
            label = f"{'exact' if exact else 'real'} plant, bit at the {delivery} of its slot"
            style = {"color": colour, "linestyle": line, "marker": marker, "markersize": 4.5}
            ups = [100.0 * found[one].up / one.seeds for one in points]
            above.plot([one.ratio for one in points], ups, label=label, linewidth=1.3, **style)
            flown = [one for one in points if found[one].up]
            below.errorbar(
                [one.ratio for one in flown],
                [found[one].mean for one in flown],
                [found[one].half for one in flown],
                linewidth=1.3,
                capsize=2,
                **style,
            )
        above.set_title(
            f"{NAMES[plant]}, R0 = {smallest_rate(plant):.2f} bit/s", loc="left", fontsize=10
        )
        below.set(xlabel="R / R0", xlim=(0.95, 2.05), yscale="log", ylim=(1.0, WORST))
        below.set_yticks([1, 2, 3, 5, 10, 20], ["1", "2", "3", "5", "10", "20"])
        below.set_yticks([], minor=True)
    panels[0, 0].set(ylabel="flights that stay up, %", ylim=(-4.0, 104.0))
    panels[1, 0].set_ylabel("rms error over the floor")
    panels[0, 0].legend(fontsize=7.5, frameon=False, loc="lower right", borderaxespad=1.2)
    save(figure, paths)


def write_page(path: Path, swept: dict[Point, Found], claimed: dict[Point, Found]) -> None:
    """Put the tables into the page at their place; where there is no page, they are all of it.

    Without claims it is the quick form, and says so.
    """
    picture = "![Share of flights that stay up, and their error over the floor](../figures/cliff.png)"
    first = _claims(claimed) if claimed else "Quick form: few and short flights, to see that it works."
    made = "\n\n".join([BEGIN, picture, first, *(_sweep(plant, swept) for plant in PLANTS), END])
    text = path.read_text(encoding="utf-8") if path.is_file() else f"{BEGIN}\n{END}\n"
    if BEGIN not in text or END not in text:
        raise ValueError(f"{path} has no place for the tables: no line {BEGIN} and {END} after it")
    before, rest = text.split(BEGIN, 1)
    write_whole(path, before + made + rest.split(END, 1)[1])


def _ratio(point: Point) -> float:
    return point.ratio


def _claims(found: dict[Point, Found]) -> str:
    rows = [
        "| plant | bit/s | R/R0 | bit at the | disturbance | stayed up | rms over the floor |",
        "|---|---|---|---|---|---|---|",
    ]
    for one, what in found.items():
        plant = f"{one.plant}, {'exact' if one.exact else 'real'}"
        off = f", {100.0 * one.mismatch:g} % off" if one.mismatch else ""
        rows.append(
            f"| {plant}{off} | {one.rate_bit_s:.1f} | {one.ratio:.2f} | {one.delivery} "
            f"| {'known' if one.known else 'found'} | {what.up} of {one.seeds} | {_text(what)} |"
        )
    return "\n".join(rows)


def _sweep(plant: str, found: dict[Point, Found]) -> str:
    points = [one for one in found if one.plant == plant]
    ratios = sorted({one.ratio for one in points})
    seeds, seconds = points[0].seeds, points[0].seconds
    heads = [f"{'exact' if exact else 'real'}, {delivery}" for exact, delivery, *_ in CURVES]
    rows = [
        f"{NAMES[plant]}: share of {seeds} flights of {seconds:g} s that stayed up, and their rms "
        "error over the floor.",
        "",
        f"| R/R0 | bit/s | {' | '.join(heads)} |",
        "|---|---|" + "---|" * len(heads),
    ]
    for ratio in ratios:
        cells = []
        for exact, delivery, *_ in CURVES:
            wanted = (ratio, exact, delivery)
            one = next(one for one in points if (one.ratio, one.exact, one.delivery) == wanted)
            what = found[one]
            share = f"{100.0 * what.up / one.seeds:.0f} %"
            cells.append("refused" if what.refused else f"{share}, {_text(what)}")
        rows.append(f"| {ratio:.2f} | {ratio * smallest_rate(plant):.2f} | {' | '.join(cells)} |")
    return "\n".join(rows)


def _text(found: Found) -> str:
    return f"{found.mean:.2f} ± {found.half:.2f}" if found.up else "none"
