"""Every example runs as its first lines say, is short, and says what it is meant to show."""

from __future__ import annotations

import importlib
import os
import re
import runpy
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.rules.test_tidy import MACHINE_PATH
from tests.tenbaud.processes import REPOSITORY

EXAMPLES = REPOSITORY / "examples"
LINES_MAX = 60
SCRIPTS = sorted(EXAMPLES.glob("*.py"))


@pytest.fixture
def said_by(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[[str], str]:
    """Return what runs a script in this process and gives what it prints: nothing is imported again.

    Two scripts have a process of their own, which finds what it needs as anybody's does.
    """
    monkeypatch.chdir(tmp_path)

    def said(name: str) -> str:
        runpy.run_path(str(EXAMPLES / name), run_name="__main__")
        return capsys.readouterr().out

    return said


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


def test_own_plant_is_harder_to_know_the_stronger_its_gusts(
    said_by: Callable[[str], str],
) -> None:
    errors = numbers_in(said_by("own_plant.py"), r"rms error (\d\.\d+) rad")
    assert len(errors) == 3
    assert errors == sorted(errors)
    assert errors[0] < 0.02


def test_own_coder_flies_with_words_of_several_bits(said_by: Callable[[str], str]) -> None:
    errors = numbers_in(said_by("own_coder.py"), r"rms error (\d\.\d+) rad")
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


def test_a_pendulum_stays_up_over_fewer_and_fewer_bits_until_it_falls(
    said_by: Callable[[str], str], tmp_path: Path
) -> None:
    text = said_by("pendulum.py")
    assert text.startswith("No code of 10.49 bit/s or less can hold this pendulum.")
    outcomes = re.findall(r"^ *(\d+\.\d) bit/s +(stays up|falls|refused)", text, re.MULTILINE)
    assert outcomes == [
        *((rate, "stays up") for rate in ("20.0", "15.8", "12.7")),
        ("11.0", "falls"),
        ("10.0", "refused"),
    ]
    errors = numbers_in(text, r"estimate error (\d+\.\d+) deg")
    assert errors == sorted(errors)
    assert (tmp_path / "pendulum.png").stat().st_size > 10_000


SAID = {
    "any_plant": ("600 equal digests of 600 samples",),
    "first_flight": ("Flight finished: 60 s", "rise time, 10-90 %", "codecs differ after sample 200"),
    "read_a_run": ("of the largest pitch, rms, on 600 bits", "True"),
}
PICTURES = {"any_plant": 3, "first_flight": 3, "read_a_run": 2}
FIGURE = r"(?:error|floor|end) (\d\.\d+)"


def test_every_notebook_is_run() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.ipynb")} == set(SAID)


@pytest.mark.parametrize("name", sorted(SAID))
def test_a_notebook_runs_and_its_stored_outputs_are_those_of_a_run(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    nbformat = pytest.importorskip("nbformat")
    pytest.importorskip("ipykernel")
    from docs.tools.notebooks import executed, outputs_of

    importlib.import_module(
        "matplotlib.font_manager"
    )  # its cache is built here, and not in the notebook
    monkeypatch.setenv("PYTHONPATH", os.environ.get("PYTHONPATH", ""))
    path = EXAMPLES / f"{name}.ipynb"
    stored = nbformat.read(path, as_version=4)
    again = executed(path, tmp_path)
    for notebook in (stored, again):
        outputs = outputs_of(notebook)
        assert not any(one.get("name") == "stderr" for one in outputs)
        text, pictures = texts_of(outputs)
        for said in SAID[name]:
            assert said in text
        assert pictures == PICTURES[name]
    text, _ = texts_of(outputs_of(stored))
    assert not MACHINE_PATH.search(text)
    assert "/tmp/" not in text
    assert not re.search(r"0x[0-9a-f]{8}", text)
    figures = [numbers_in(texts_of(outputs_of(one))[0], FIGURE) for one in (stored, again)]
    assert figures[1] == pytest.approx(figures[0], rel=0.05), "run docs/tools/notebooks.py again"


def texts_of(outputs: list[Any]) -> tuple[str, int]:
    """Return what outputs say, and how many pictures are among them."""
    texts, pictures = [], 0
    for output in outputs:
        data = output.get("data", {})
        html = data.get("text/html", "")
        pictures += html.count("data:image/png") + ("image/png" in data)
        plain = re.sub(r'base64,[^"]+', "", html) or data.get("text/plain", "")
        texts.append(output.get("text", plain))
    return "\n".join(texts), pictures
