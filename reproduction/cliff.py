"""The cliff: how many flights stay up, and how near to the floor, as the rate nears the least one.

    tenbaud figures cliff --docs docs

Presets of the two unstable plants fly at other rates, each designed anew, behind their encoders,
through lagging motors and dry friction, under the disturbance that they assume. A flight has fallen
when an output leaves `FALLEN`, or the estimate is no estimate any more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tenbaud.bounds.linear import rate_needed
from tenbaud.config.load import load_config, merged_values
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.design.described import plant_of
from tenbaud.design.floors import floors
from tenbaud.recording.style import LINE_B, LINE_C, new_figure, save
from tenbaud.studies.flights import CompiledPoint
from tenbaud.studies.schedule import Uncommon

PLANTS = {"pendulum": ("pendulum-13baud", 4e-3), "furuta": ("furuta-50baud", 2e-3)}
"""Preset, and about how long a tick takes."""
RATIOS = (1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.4, 1.5, 1.75, 2.0)
DELIVERIES = ("start", "end")
FALLEN = 1.0
"""rad"""
SEEDS, SECONDS = 100, 60.0
PICTURE = "cliff.png"
BEGIN, END = "<!-- cliff: begin, written by `tenbaud figures cliff` -->", "<!-- cliff: end -->"


class Stand(NamedTuple):
    """What came of the flights of one plant at one rate."""

    plant: str
    delivery: str
    needed_bit_s: float
    rate_bit_s: float
    flights: int
    up: int
    ratios: tuple[float, ...]
    """rms of the weighted error over its floor, of each flight that stayed up"""

    @property
    def share(self) -> float:
        """Return the share of flights that stayed up."""
        return self.up / self.flights

    @property
    def ratio(self) -> float:
        """Return the rms over the floor of all flights that stayed up."""
        return math.sqrt(float(np.mean(np.square(self.ratios)))) if self.up else math.nan


@cache
def designed(plant: str, over_needed: float) -> FlightConfig:
    """Return a plant's preset at a multiple of its least rate."""
    preset, tick_s = PLANTS[plant]
    described = plant_of(load_config(preset).model, tick_s)
    assert described is not None
    period_s = 1.0 / (over_needed * rate_needed(described.A))
    ticks = round(period_s / tick_s)
    # Whole nanoseconds, rounded up: the line carries no more than its rate.
    tick_s = math.ceil(period_s / ticks * 1e9) / 1e9
    values = merged_values(preset)
    values["timing"] |= {"tick_s": tick_s, "symbol_period_s": round(ticks * tick_s, 9)}
    values["channel"]["rate_baud"] = 1.0 / period_s
    values["coder"] = {"kind": "direction"}
    return load_config("own", None, completed(values))


def stand(plant: str, over_needed: float, delivery: str, seeds: int, seconds: float) -> Stand:
    """Fly a plant at a multiple of its least rate."""
    config = designed(plant, over_needed)
    channel = config.channel.model_copy(update={"delivery": delivery})
    config = config.model_copy(update={"channel": channel, "duration_s": seconds})
    described = plant_of(config.model, config.timing.tick_s)
    assert described is not None
    rate = 1.0 / config.timing.symbol_period_s
    found = floors(described, rate)
    assert found.weighted_rms is not None
    point = CompiledPoint(config)
    ratios = []
    for seed in range(1, seeds + 1):
        try:
            outputs = point.fly(seed)[0].outputs
        except Uncommon:  # the estimate diverged, or the guard stepped in
            continue
        if max(one.amplitude for one in outputs) < FALLEN:
            squares = np.square([one.error_coded_rms for one in outputs])
            ratios.append(math.sqrt(float(described.weights @ squares)) / found.weighted_rms)
    return Stand(plant, delivery, found.rate_needed_bit_s, rate, seeds, len(ratios), tuple(ratios))


def stands(
    seeds: int = SEEDS, seconds: float = SECONDS, told: Callable[[str], None] = print
) -> Iterator[Stand]:
    """Fly both plants at all rates; `told` hears of each."""
    for plant in PLANTS:
        for delivery in DELIVERIES:
            for over_needed in RATIOS:
                one = stand(plant, over_needed, delivery, seeds, seconds)
                told(f"{plant} {over_needed:g} R0, {delivery}: {one.up} of {seeds} up, {one.ratio:.2f}")
                yield one


def draw(path: Path, found: list[Stand]) -> None:
    """Draw share and error of each plant over R/R0."""
    figure, panels = new_figure(2, height=2.6)
    for plant, color in zip(PLANTS, (LINE_B, LINE_C), strict=True):
        for delivery, line in zip(DELIVERIES, ("-", "--"), strict=True):
            some = [one for one in found if (one.plant, one.delivery) == (plant, delivery)]
            over = [one.rate_bit_s / one.needed_bit_s for one in some]
            label = f"{plant}, delivery at {delivery}"
            style: dict[str, Any] = {"color": color, "linestyle": line, "marker": "o", "markersize": 4}
            panels[0].plot(over, [100.0 * one.share for one in some], label=label, **style)
            panels[1].plot(over, [one.ratio for one in some], **style)
    panels[0].set_ylabel("flights that stay up, %")
    panels[1].set_ylabel("rms error over the floor")
    panels[1].set_xlabel("rate over the least rate, R / R0")
    panels[1].set_yscale("log")
    panels[1].set_yticks([2, 3, 5, 10, 20], ["2", "3", "5", "10", "20"])
    panels[1].set_yticks([], minor=True)
    panels[0].legend(loc="lower right", fontsize=8, frameon=False)
    for panel in panels:
        panel.axvline(1.0, color=LINE_C, linewidth=0.8, linestyle=":")
        panel.set_xlim(0.98, 2.02)
    save(figure, [path])


def table(found: list[Stand]) -> str:
    """Return the table of the page."""
    lines = ["| plant | R / R0 | bit/s | up, start | rms / floor | up, end | rms / floor |"]
    lines.append("|---|---|---|---|---|---|---|")
    for plant in PLANTS:
        pairs = [[one for one in found if one.plant == plant and one.delivery == d] for d in DELIVERIES]
        for first, second in zip(*pairs, strict=True):
            cells = [f"{one.up} of {one.flights} | {one.ratio:.2f}" for one in (first, second)]
            over = first.rate_bit_s / first.needed_bit_s
            lines.append(f"| {plant} | {over:.2f} | {first.rate_bit_s:.1f} | {' | '.join(cells)} |")
    return "\n".join(lines).replace("nan", "")


def write_cliff(page: Path, picture: Path, found: list[Stand]) -> None:
    """Draw the picture and put the table into a page that has its marks; without a page, beside it."""
    draw(picture, found)
    if not page.is_file():
        (picture.parent / "cliff.md").write_text(table(found) + "\n", encoding="utf-8")
        return
    text = page.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    after = rest.split(END)[1]
    page.write_text(f"{before}{BEGIN}\n{table(found)}\n{END}{after}", encoding="utf-8")
