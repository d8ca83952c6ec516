from __future__ import annotations

from datetime import datetime
from pathlib import Path

import pytest

from tenbaud.files.whole import WriteError
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import RunFolder, create_run_folder, find_recordings

NOW = datetime(2026, 11, 22, 10, 15, 3)


def test_folder_is_named_after_time_and_run_and_numbered_if_taken(tmp_path: Path) -> None:
    made = [create_run_folder(tmp_path / "runs", "demo", None, NOW) for _ in range(3)]
    assert [folder.name for folder in made] == [
        "2026-11-22T10-15-03_demo",
        "2026-11-22T10-15-03_demo-2",
        "2026-11-22T10-15-03_demo-3",
    ]
    assert all(folder.is_dir() and folder.parent == tmp_path / "runs" for folder in made)


def test_root_is_runs_below_the_working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert create_run_folder(None, "demo", None, NOW) == Path("runs/2026-11-22T10-15-03_demo")


def test_name_cannot_leave_the_root(tmp_path: Path) -> None:
    folder = create_run_folder(tmp_path, "../my run/№1", None, NOW)
    assert folder.parent == tmp_path
    assert folder.name == "2026-11-22T10-15-03_my-run-1"


def test_explicit_folder_is_used_if_new_and_refused_if_not(tmp_path: Path) -> None:
    wanted = tmp_path / "deep" / "wanted"
    assert create_run_folder(tmp_path, "demo", wanted, NOW) == wanted
    (wanted / "summary.json").write_text("{}")
    with pytest.raises(RecordingError, match="exists already and is not overwritten"):
        create_run_folder(tmp_path, "demo", wanted, NOW)
    assert (wanted / "summary.json").read_text() == "{}"
    with pytest.raises(WriteError, match="below cannot be written"):
        create_run_folder(tmp_path, "demo", wanted / "summary.json" / "below", NOW)


def test_recordings_are_found_by_folder_or_by_name(tmp_path: Path) -> None:
    run = RunFolder(tmp_path)
    with pytest.raises(RecordingError, match="neither transmitter"):
        find_recordings(tmp_path)
    run.receiver.touch()
    assert find_recordings(tmp_path) == [run.receiver]
    run.transmitter.touch()
    assert find_recordings(tmp_path) == [run.transmitter, run.receiver]
    assert find_recordings(run.receiver) == [run.receiver]
    with pytest.raises(RecordingError, match="does not exist"):
        find_recordings(tmp_path / "none")
