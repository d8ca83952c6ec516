"""The way of someone who has never seen the project, walked by the README's own commands.

From its first line to a flight, a flight that was broken and came back, and a recording that is opened.
`test_commands.py` leaves the README to this file, so that it is typed in once.
"""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tenbaud.recording.reader import Recording
from tests.docs.blocks import Block, blocks_of
from tests.docs.repository import Ports, copy_repository
from tests.docs.sandbox import Sandbox
from tests.rules.sources import TOP

README = (TOP / "README.md").read_text(encoding="utf-8")
BLOCKS = [block for block in blocks_of("README.md") if block.runs]
FIRST_SCREEN_LINES = 30
GIF_BYTES_MAX = 1_000_000
FOR_DEVELOPMENT = {"pytest", "mypy", "ruff", "numba", "nicegui", "mkdocs", "control", "pyarrow"}


@pytest.fixture(scope="module")
def walked(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """Type in every block; return the folder and what each block said, by its first command."""
    said: dict[str, str] = {}
    folder = tmp_path_factory.mktemp("newcomer")
    with pytest.MonkeyPatch.context() as patch, Sandbox(folder, copies=True) as sandbox:
        for block in BLOCKS:
            first = first_words(block)
            patch.setenv("TENBAUD_FIGURE", "1" if first == "make demo" else "0")
            said[first] = sandbox.run(block)
        sandbox.end()
        return sandbox.top, said


def first_words(block: Block) -> str:
    return block.script.strip().splitlines()[0].split("#")[0].strip()


def summary_of(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "summary.json").read_text())


def test_when_the_readme_is_walked_then_nothing_of_it_is_left_out() -> None:
    assert BLOCKS
    assert not [block.name for block in BLOCKS if block.skip or block.soak]


def test_when_the_first_screen_is_read_then_it_shows_a_flight_and_two_commands() -> None:
    screen = "\n".join(README.splitlines()[:FIRST_SCREEN_LINES])
    assert "Fly a helicopter over a ten-baud wire." in screen
    assert "make demo" in screen
    assert "make test" in screen
    picture = TOP / re.findall(r"\]\((docs/figures/\S+\.gif)\)", screen)[0]
    assert picture.read_bytes()[:6] == b"GIF89a"
    assert picture.stat().st_size < GIF_BYTES_MAX


def test_when_make_demo_is_typed_then_a_flight_and_its_figure_are_there(
    walked: tuple[Path, dict[str, str]],
) -> None:
    top, said = walked
    flights = [folder for folder in (top / "runs").iterdir() if "tuned-10baud" in folder.name]
    flights = [folder for folder in flights if "transmitter" not in folder.name]
    flights = [folder for folder in flights if "receiver" not in folder.name]
    assert len(flights) == 2, "that of `make demo`, and the one that was looked at"
    assert summary_of(min(flights))["exit_code"] == 0
    assert (min(flights) / "flight.png").read_bytes()[:4] == b"\x89PNG"
    assert "tests collected" in said["make demo"]


@pytest.mark.soak
def test_when_make_demo_is_typed_in_a_bare_copy_then_it_installs_what_flying_needs_and_no_more(
    tmp_path: Path,
) -> None:
    top, ports = tmp_path / "tenbaud", Ports()  # it holds the free ports until the end
    copy_repository(top, ports, short=False)
    left_out = ("PYTHONPATH", "VIRTUAL_ENV", "PYTEST_ADDOPTS", "TENBAUD_FIGURE")
    environment = {name: value for name, value in os.environ.items() if name not in left_out}
    command = ["make", "demo"]
    done = subprocess.run(
        command, cwd=top, env=environment, capture_output=True, text=True, timeout=900.0, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    (figure,) = top.glob("runs/*/flight.png")
    assert summary_of(figure.parent)["digest_checks"] == 1000
    installed = {
        path.name.partition("-")[0] for path in top.glob(".venv/lib/*/site-packages/*.dist-info")
    }
    assert {"numpy", "tenbaud"} <= installed
    assert not FOR_DEVELOPMENT & installed


def test_when_the_first_flight_is_flown_then_it_is_as_good_as_the_readme_says(
    walked: tuple[Path, dict[str, str]],
) -> None:
    summary = summary_of(walked[0] / "first")
    promised = re.search(r"\*\*([\d.]+) %\*\* of the largest pitch", README)
    assert promised is not None
    assert f"{100 * summary['error_coded_max_fraction']:.2f}" == promised[1]
    assert summary["desyncs"] == 0
    ours, usual = summary["tracking_rms_rad"], summary["usual_loop"]["tracking_rms_rad"]
    assert f"{math.degrees(ours):.1f}° rms against {math.degrees(usual):.1f}°" in README
    assert f"**{summary['digest_checks']} of {summary['samples']}** samples" in README
    for percent, plant in (("3.6", "off the model"), ("9.6", "exact")):
        assert f"{percent} %" in README, plant


def test_when_the_flight_is_broken_then_it_came_back_and_the_difference_is_named(
    walked: tuple[Path, dict[str, str]],
) -> None:
    top, said = walked
    summary = summary_of(top / "broken")
    assert (summary["desyncs"], summary["exit_code"]) == (1, 0)
    assert summary["rejoins"] >= 1
    assert summary["erasures"] > 200
    assert "First difference at sample 700" in said["tenbaud diff broken"]
    assert "coder[0]" in said["tenbaud diff broken"]


def test_when_a_recording_is_opened_then_it_holds_the_flight(
    walked: tuple[Path, dict[str, str]],
) -> None:
    top, said = walked
    shown = next(text for first, text in said.items() if "--out first" in first)
    assert "sample: 1000 rows" in shown, "inspect says so on the screen"
    recording = Recording(top / "first" / "transmitter.mcap")
    assert recording.complete
    words = [row["word"] for _, row in recording.rows("sample")]
    assert len(words) == 1000
    assert {tuple(word) for word in words} == {(-1,), (1,)}


def test_when_two_terminals_are_used_then_both_recorded_the_same_flight(
    walked: tuple[Path, dict[str, str]],
) -> None:
    top, _ = walked
    (transmitter,) = (top / "runs").glob("*_transmitter-*")
    (receiver,) = (top / "runs").glob("*_receiver-*")
    assert summary_of(transmitter)["digest_checks"] == 600
    assert summary_of(receiver)["samples"] == 600


@pytest.mark.parametrize("target", sorted(set(re.findall(r"\]\(((?!https?:)[^)#]+)", README))))
def test_when_a_link_of_the_readme_is_followed_then_something_is_there(target: str) -> None:
    assert (TOP / target).exists()
