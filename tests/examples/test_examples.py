"""Every example runs as its first lines say, is short, and says what it is meant to show."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

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


@pytest.fixture
def run_notebook(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[Any], list[Any]]:
    """Run a notebook in a folder of its own and return its outputs."""
    nbclient = pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    monkeypatch.setenv("PYTHONPATH", path)
    resources = {"metadata": {"path": str(tmp_path)}}

    def run(notebook: Any) -> list[Any]:
        settings = {"timeout": 90, "kernel_name": "python3", "resources": resources}
        nbclient.NotebookClient(notebook, **settings).execute()
        return [output for cell in notebook.cells for output in cell.get("outputs", [])]

    return run


def texts_of(outputs: list[Any]) -> str:
    return "".join(output["text"] for output in outputs if output.get("name") == "stdout")


def test_the_notebook_runs_from_top_to_bottom(run_notebook: Callable[[Any], list[Any]]) -> None:
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(EXAMPLES / "read_a_run.ipynb", as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells), "clear the outputs first"
    outputs = run_notebook(notebook)
    text = texts_of(outputs)
    assert "of the largest pitch, rms, on 600 bits" in text
    assert "True" in text
    assert any("image/png" in output.get("data", {}) for output in outputs)


def test_any_plant_flies_in_the_notebook_with_the_figures_that_it_shows(
    run_notebook: Callable[[Any], list[Any]],
) -> None:
    nbformat = pytest.importorskip("nbformat")
    notebook = nbformat.read(EXAMPLES / "any_plant.ipynb", as_version=4)
    kept = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    outputs = run_notebook(notebook)
    for shown in (kept, outputs):
        assert "600 equal digests of 600 samples" in texts_of(shown)
        assert sum("image/png" in output.get("data", {}) for output in shown) == 3
        assert not any(output.get("name") == "stderr" for output in shown)
    pattern = r"(?:error|floor|end) (\d\.\d+)"
    figures, before = (numbers_in(texts_of(one), pattern) for one in (outputs, kept))
    assert len(figures) == 5
    assert figures == pytest.approx(before, rel=0.05), "run the notebook again, and keep its outputs"
    assert figures[0] < 2.0 * figures[1]
