"""Runs side by side: what is compared, what is noted, and what cannot be compared."""

from __future__ import annotations

import json
import shutil
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tenbaud import Run, compare
from tenbaud.cli.app import run as command
from tenbaud.recording.errors import RecordingError
from tests.tenbaud.flown import flown

ARM = {"duration_s": 3.0, "transmitter__plant__mismatch": 0.0}


@pytest.fixture(scope="module")
def slow(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return flown(tmp_path_factory.mktemp("runs") / "slow", duration_s=16.0)


@pytest.fixture(scope="module")
def fast(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return flown(tmp_path_factory.mktemp("runs") / "fast", "usual-1000baud", duration_s=14.0)


def rows_of(text: str) -> dict[str, list[str]]:
    return {line[:20].strip(): line[20:].split() for line in text.splitlines() if line[:1].islower()}


def test_the_table_has_the_figures_of_each_run_over_the_time_that_both_have(
    slow: Run, fast: Run
) -> None:
    found = compare(slow, fast.path)
    rows = rows_of(str(found))
    assert rows["rate, bit/s"] == ["10", "1000"]
    assert rows["steps"] == ["2", "2"]
    for at, run in enumerate((slow, fast)):
        expected = run.metrics(from_s=0.0, to_s=13.99)
        assert found.metrics[at] == expected
        degrees = expected["outputs"]["pitch"]["error_live_rms"] * 57.29578  # type: ignore[operator]
        assert rows["estimate error rms"][at] == f"{degrees:.2f}°"
    assert any("lengths differ, 14 to 16 s" in note for note in found.notes)
    assert not any("set-points" in note or "plants" in note for note in found.notes)


def test_a_narrow_terminal_gets_one_run_after_the_other_and_plain_characters(
    slow: Run, fast: Run
) -> None:
    text = compare(slow, fast).text(30, unicode=False)
    assert text.isascii()
    assert text.count("estimate error rms: ") == 2
    assert "estimate error rms: " not in compare(slow, fast).text(80)


def test_other_set_points_other_plants_and_failed_flights_are_noted(slow: Run, tmp_path: Path) -> None:
    other = flown(tmp_path / "other", receiver__reference__amplitude=0.3)
    summary = {**other.summary, "exit_code": 7, "not_flown": ["the plant fell"]}
    other.folder.summary.write_text(json.dumps(summary))
    helicopter = flown(tmp_path / "three", "helicopter-10baud", **ARM)
    notes = compare(slow, Run(other.path)).notes
    assert "B: ✗ Flight failed (exit code 7): the plant fell" in notes
    assert any(note.startswith("The set-points of pitch differ") for note in notes)
    found = compare(slow, helicopter)
    assert found.outputs == ("pitch",)
    assert any(note.startswith("The plants differ: A has pitch (rad); B has") for note in found.notes)


def test_a_run_without_a_summary_is_compared_as_far_as_its_recordings_go(
    slow: Run, tmp_path: Path
) -> None:
    copy = Path(shutil.copytree(slow.path, tmp_path / "copy"))
    (copy / "summary.json").unlink()
    found = compare(slow, copy)
    assert found.metrics[0]["outputs"] == found.metrics[1]["outputs"]
    assert any("B: there is no summary.json" in note for note in found.notes)


def test_bits_are_whole_and_an_unknown_set_point_warns_of_nothing(slow: Run, tmp_path: Path) -> None:
    copy = Run(shutil.copytree(slow.path, tmp_path / "copy"))
    copy.folder.summary.write_text(json.dumps({**slow.summary, "coder_bits_up": 1234567.0}))
    signal = copy.signal("reference")
    assert signal is not None
    copy._made["reference"] = replace(signal, values=np.full(len(copy.time_s), np.nan))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert rows_of(str(compare(slow, copy)))["bits sent"] == ["160", "1234567"]


def test_the_figure_has_every_run_in_both_panels_the_smallest_error_in_front(
    slow: Run, fast: Run
) -> None:
    values, errors = compare(fast, slow).plot().axes
    labels = [str(line.get_label()) for line in values.lines]
    assert labels == ["set-point", "A: usual-1000baud", "B: tuned-10baud"]
    assert errors.lines[1].get_zorder() > errors.lines[0].get_zorder()
    assert max(values.lines[1].get_ydata()) == pytest.approx(57.29578 * fast.pitch.max())


def test_the_command_writes_a_figure_only_where_it_is_asked_for(
    slow: Run, fast: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def printed(*options: str) -> Any:
        assert command(["compare", str(slow.path), str(fast.path), *options]) == 0
        return capsys.readouterr().out

    before = sorted(slow.path.iterdir())
    assert "rise time, 10-90 %" in printed()
    assert sorted(slow.path.iterdir()) == before
    for name in ("both.png", "both.svg", "both.pdf"):
        assert printed("--figure", str(tmp_path / name)).endswith(f"{name}\n")
        assert (tmp_path / name).stat().st_size > 5000
    found = json.loads(printed("--json"))
    assert [one["label"] for one in found["runs"]] == ["A", "B"]
    assert found["runs"][0]["outputs"]["pitch"]["steps"][1]["time_s"] == 12.5


def test_what_cannot_be_compared_is_a_usage_error(
    slow: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    servo = flown(tmp_path / "servo", "servo-10baud", **ARM)
    with pytest.raises(RecordingError, match=r"no output in common: A has pitch \(rad\); B has angle"):
        compare(slow, servo)
    for arguments, said in (
        ([str(slow.path), str(servo.path)], "no output in common"),
        ([str(slow.path)], "give 2 to 12 runs"),
        ([str(slow.path), str(tmp_path / "none")], "does not exist"),
        ([str(slow.path), str(slow.path), "--figure", "a.doc"], ".svg"),
    ):
        assert command(["compare", *arguments]) == 2
        assert said in capsys.readouterr().err
