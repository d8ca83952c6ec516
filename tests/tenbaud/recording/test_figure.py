from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tenbaud import fly as fly_once
from tenbaud.flight.report import draw_figure
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import RunFolder
from tenbaud.recording.style import new_figure, save
from tests.tenbaud.recording.rows import EVENT, Rows


@pytest.mark.parametrize(("ticks", "with_receiver"), [(600, True), (14000, False), (1, True)])
def test_figure_is_a_png_of_sensible_size(
    tmp_path: Path, fly: Callable[..., Path], ticks: int, with_receiver: bool
) -> None:
    run = RunFolder(fly(tmp_path / "run", ticks, erased=(7, 8, 40)))
    if not with_receiver:
        run.receiver.unlink()
    draw_figure(run, "a flight")
    picture = run.figure.read_bytes()
    assert picture.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = (int.from_bytes(picture[at : at + 4], "big") for at in (16, 20))
    assert (width, height) == (1350, 1350)  # without a panel of inputs, which are not recorded
    assert 20_000 < len(picture) < 1_000_000


def test_recording_without_ticks_is_refused(
    tmp_path: Path, record: Callable[[Path, Rows], Path]
) -> None:
    run = RunFolder(tmp_path)
    record(run.transmitter, [(EVENT, 0, (0.0, "start", None, ""))])
    with pytest.raises(RecordingError, match="holds no ticks"):
        draw_figure(run, "")
    assert not run.figure.exists()


@pytest.mark.parametrize(
    ("lead_ticks", "curves"), [(0, ["estimate"]), (3, ["live estimate", "coded estimate"])]
)
def test_when_both_estimates_are_one_then_the_legend_names_no_curve_that_is_hidden(
    tmp_path: Path, lead_ticks: int, curves: list[str]
) -> None:
    settings = {"duration_s": 3.0, "timing.lead_ticks": lead_ticks}
    figure = fly_once(settings=settings, out=tmp_path / "run").plot()
    legends = [panel.get_legend() for panel in figure.axes[:2]]
    labels = [[text.get_text() for text in legend.get_texts()] for legend in legends]
    assert labels[0][2:] == curves
    assert labels[1] == [f"error of the {curve}" for curve in curves]


@pytest.mark.parametrize("name", ["a.jpg", "a.tif", "a.svgz", "a.SVG", "a.pdf", "a.eps", "a"])
def test_a_figure_is_written_in_every_format_of_matplotlib(tmp_path: Path, name: str) -> None:
    figure, _ = new_figure(1)
    save(figure, [tmp_path / name])
    assert (tmp_path / name).stat().st_size > 500
