"""Plots of studies: labels that can be read, no number hidden, nothing left out unsaid."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from tenbaud.studies import plots
from tenbaud.studies.plots import draw_study


@pytest.fixture(name="figures")
def kept_figures(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, Any]]:
    """The figures that are drawn, by the names of their files."""
    import matplotlib.pyplot as plt

    kept: dict[str, Any] = {}

    def save(figure: Any, path: Path) -> Path:
        figure.canvas.draw()
        kept[path.name] = figure
        return path

    monkeypatch.setattr(plots, "_save", save)
    yield kept
    plt.close("all")


def table_of(settings: dict[str, list[Any]], errors: list[float], outcomes: list[str]) -> Any:
    figures = dict.fromkeys(("error_live_rms", "error_coded_rms", "tracking_rms"), errors)
    return pa.table({**settings, **figures, "outcome": outcomes})


def overlapping(axis: Any) -> list[tuple[str, str]]:
    """Return labels of an axis that touch the next."""
    ticks = [*axis.get_majorticklabels(), *axis.get_minorticklabels()]
    boxes = [(one.get_text(), one.get_window_extent()) for one in ticks if one.get_text()]
    boxes = [(text, box) for text, box in boxes if box.width > 0.0]
    return [
        (text, other_text)
        for (text, box), (other_text, other) in itertools.combinations(boxes, 2)
        if box.overlaps(other) and text != other_text
    ]


@pytest.mark.parametrize(
    "decades", [0.1, 1.5, 6.0, *(pytest.param(one, marks=pytest.mark.soak) for one in (0.6, 2.5, 4.5))]
)
def test_when_errors_span_many_decades_then_labels_do_not_touch(
    figures: dict[str, Any], tmp_path: Path, decades: float
) -> None:
    rates = [5, 10, 20, 40] * 3
    losses = [0.0] * 4 + [0.1] * 4 + [0.2] * 4
    errors = np.logspace(-3, -3 + decades, 12).tolist()
    settings = {"rate": rates, "loss": losses}
    draw_study(table_of(settings, errors, ["ok"] * 12), ["rate", "loss"], "many", tmp_path)
    assert set(figures) == {"error_rate.png", "error_loss.png", "map_rate_loss.png"}
    for name, figure in figures.items():
        for axes in figure.axes:
            assert not overlapping(axes.yaxis), name
            assert not overlapping(axes.xaxis), name
            labels = [one.get_text() for one in axes.get_ymajorticklabels() if one.get_text()]
            assert labels, name


def test_when_a_grid_has_samples_at_each_point_then_each_place_is_drawn_once(
    figures: dict[str, Any], tmp_path: Path
) -> None:
    losses = np.linspace(0.0, 0.4, 60).tolist()
    points = [(rate, loss) for rate in (5, 10, 20) for loss in losses]
    settings = {
        "rate": [rate for rate, _ in points],
        "loss": [loss for _, loss in points],
        "mismatch": [0.5 - loss for _, loss in points],
    }
    errors = [math.radians(1.0 if rate == 5 else 3.0 if rate == 10 else 9.0) for rate, _ in points]
    table = table_of(settings, errors, ["ok"] * len(points))
    draw_study(table, [*settings], "samples", tmp_path)
    (dots,) = figures["map_rate_loss.png"].axes[0].collections
    assert len(dots.get_offsets()) == 180
    assert not figures["map_rate_loss.png"].axes[0].texts, "no room for 180 numbers"
    (dots,) = figures["map_loss_mismatch.png"].axes[0].collections
    assert len(dots.get_offsets()) == 60
    assert dots.get_array().tolist() == pytest.approx([3.0] * 60), "medians over what is not shown"


def test_when_flights_have_no_figures_then_the_title_says_how_many(
    figures: dict[str, Any], tmp_path: Path
) -> None:
    settings = {"rate": [5, 10, 20], "loss": [0.1, 0.1, 0.1]}
    table = table_of(settings, [0.1, 0.2, math.nan], ["ok", "ok", "it diverged"])
    draw_study(table, ["rate", "loss"], "holes", tmp_path)
    assert set(figures) == {"error_rate.png"}, "one value of loss is no axis"
    assert "1 of 3 flights have no figures" in figures["error_rate.png"].axes[0].get_title()
    figures.clear()
    nothing = table_of(settings, [math.nan] * 3, ["it diverged"] * 3)
    assert draw_study(nothing, ["rate", "loss"], "nothing", tmp_path) == []
