"""Every example runs as its first lines say, is short, and says what it is meant to show."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.tenbaud.processes import REPOSITORY

EXAMPLES = REPOSITORY / "examples"
LINES_MAX = 60
SCRIPTS = sorted(EXAMPLES.glob("*.py"))


def run_script(script: Path, cwd: Path) -> str:
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, str(script)],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def numbers_in(text: str, pattern: str) -> list[float]:
    return [float(found) for found in re.findall(pattern, text)]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_script_is_short(script: Path) -> None:
    assert len(script.read_text().splitlines()) < LINES_MAX


def test_own_controller_follows_better_than_the_papers_law(tmp_path: Path) -> None:
    told = run_script(EXAMPLES / "own_controller.py", tmp_path)
    pid, own = numbers_in(told, r"tracking rms (\d\.\d+) rad")
    assert own < pid


def test_own_plant_is_harder_to_know_the_stronger_its_gusts(tmp_path: Path) -> None:
    errors = numbers_in(run_script(EXAMPLES / "own_plant.py", tmp_path), r"rms error (\d\.\d+) rad")
    assert len(errors) == 3
    assert errors == sorted(errors)
    assert errors[0] < 0.02


def test_own_coder_flies_with_words_of_several_bits(tmp_path: Path) -> None:
    errors = numbers_in(run_script(EXAMPLES / "own_coder.py", tmp_path), r"rms error (\d\.\d+) rad")
    assert len(errors) == 3
    assert max(errors) < 0.05


def test_chua_is_followed_over_twenty_bits_per_second(tmp_path: Path) -> None:
    told = run_script(EXAMPLES / "chua.py", tmp_path)
    (bits,) = numbers_in(told, r"(\d+) bits")
    (share,) = numbers_in(told, r"at most (\d+\.\d)%")
    assert bits == 1200
    assert 0.0 < share < 5.0


def test_a_mujoco_model_is_held_upright(tmp_path: Path) -> None:
    pytest.importorskip("mujoco", reason="mujoco is no dependency")
    told = run_script(EXAMPLES / "mujoco_pendulum.py", tmp_path)
    assert numbers_in(told, r"within (\d\.\d+) degrees")[0] < 1.0
    assert told.endswith("desyncs: 0\n")


def test_the_notebook_runs_from_top_to_bottom(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    monkeypatch.setenv("PYTHONPATH", path)
    notebook = nbformat.read(EXAMPLES / "read_a_run.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "clear the outputs first"
    resources = {"metadata": {"path": str(tmp_path)}}
    nbclient.NotebookClient(notebook, timeout=90, kernel_name="python3", resources=resources).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    text = "".join(output.get("text", "") for output in outputs)
    assert "of the largest pitch, rms, on 600 bits" in text
    assert "True" in text
    assert any("image/png" in output.get("data", {}) for output in outputs)
