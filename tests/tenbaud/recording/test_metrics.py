"""The figures of a run, its tables for other libraries and what a notebook shows of it."""

from __future__ import annotations

import json
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from tenbaud import Run
from tenbaud.flight.closing import closing_lines
from tenbaud.recording.errors import RecordingError
from tests.tenbaud.flown import flown


@pytest.fixture(scope="module")
def stepped(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return 30 s of the default reference, whose errors count from 25 s on, over a line that loses."""
    folder = tmp_path_factory.mktemp("runs") / "stepped"
    return flown(folder, duration_s=30.0, link__impairments="loss=0.1")


def test_the_figures_are_those_of_the_summary(stepped: Run) -> None:
    found, summary = stepped.metrics(), stepped.summary
    assert found["from_s"] == summary["window_start_s"] == 25.0
    assert (found["bits"], found["rate_bit_per_s"]) == (summary["coder_bits_up"], 10.0)
    assert found["erasures"] == summary["erasures"] > 10
    of_pitch, expected = found["outputs"]["pitch"], summary["outputs"]["pitch"]
    for name in ("error_live_rms", "error_live_max", "error_coded_rms", "tracking_rms"):
        value = of_pitch[name]  # type: ignore[literal-required]
        assert value == pytest.approx(expected[name], rel=1e-12), name
    assert [step["time_s"] for step in of_pitch["steps"]] == [0.0, 12.5, 25.0]


def test_another_span_has_its_own_figures(stepped: Run) -> None:
    found = stepped.metrics(from_s=5.0, to_s=10.0)["outputs"]["pitch"]
    inside = stepped.error_live[500:1001]
    assert found["error_live_rms"] == pytest.approx(np.sqrt(np.mean(inside**2)))
    assert [step["time_s"] for step in found["steps"]] == [0.0]
    wide = stepped.metrics(settling_band=0.5)["outputs"]["pitch"]["steps"][1]["settling_time_s"]
    narrow = stepped.metrics()["outputs"]["pitch"]["steps"][1]["settling_time_s"]
    assert wide is not None
    assert narrow is None or wide < narrow


def test_an_end_alone_has_no_errors_of_what_it_did_not_measure(stepped: Run) -> None:
    found = Run(stepped.folder.receiver).metrics()["outputs"]["pitch"]
    assert (found["error_live_rms"], found["tracking_rms"], found["steps"]) == (None, None, [])


def test_a_data_frame_has_a_row_per_tick_a_column_per_signal_and_units(stepped: Run) -> None:
    frame = stepped.to_pandas()
    assert list(frame.columns) == stepped.names
    assert frame.index.name == "time_s"
    np.testing.assert_array_equal(frame["pitch"].to_numpy(), stepped.pitch)
    assert frame.attrs["units"] == stepped.units


def test_a_data_set_has_units_and_meanings_as_attributes(stepped: Run) -> None:
    pytest.importorskip("xarray")
    found = stepped.to_xarray()
    np.testing.assert_array_equal(found["pitch"].values, stepped.pitch)
    assert found["pitch"].attrs["units"] == "rad"
    assert found["time_s"].attrs["units"] == "s"


def test_a_library_that_is_missing_is_named_with_how_to_get_it(
    stepped: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(RecordingError, match=r"xarray is not installed: pip install '.*xarray"):
        stepped.to_xarray()


def test_a_notebook_shows_the_verdict_first_then_the_closing_figures_and_a_picture(
    stepped: Run,
) -> None:
    html = stepped._repr_html_()
    verdict, *figures, _ = closing_lines(stepped.summary, stepped.folder)
    assert html.startswith(f"<div><strong>{verdict}</strong>")
    assert [line for line in figures if "⚠" in line and line.strip() in html]
    for line in (one for one in figures if "⚠" not in one):
        assert f"{line[2:18].strip()}</th>" in html
        assert f"{line[18:]}</td>" in html
    assert html.count("data:image/png;base64,") == 1


def test_a_notebook_shows_of_an_end_alone_what_there_is(stepped: Run, tmp_path: Path) -> None:
    alone = tmp_path / "receiver.mcap"
    alone.write_bytes(stepped.folder.receiver.read_bytes()[:-20])
    html = Run(alone)._repr_html_()
    assert "no summary" in html
    assert "⚠" in html
    assert "<img" not in html


@pytest.mark.parametrize(
    "changes",
    [
        {"exit_code": None},
        {"outputs": {"pitch": 0.5}},
        {"outputs": {"pitch": {"unit": "rad"}}},
        {"duration_s": "12"},
        {"coder_bits_up": []},
    ],
    ids=str,
)
def test_a_summary_of_another_form_counts_as_none(
    changes: dict[str, object], stepped: Run, tmp_path: Path
) -> None:
    copy = Path(shutil.copytree(stepped.path, tmp_path / "copy"))
    (copy / "summary.json").write_text(json.dumps({**stepped.summary, **changes}))
    run = Run(copy)
    assert run.summary == {}
    assert "no summary" in run._repr_html_()
    assert run.metrics()["bits"] is None
