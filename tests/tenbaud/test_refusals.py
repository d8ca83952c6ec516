"""Options that cannot have an effect are refused, and nothing is left behind."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tenbaud.cli.commands import app
from tests.tenbaud.processes import run


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("demo --pace 2 --clock real", "--pace slows the virtual clock"),
        ("demo --pace 2 --link memory", "--pace slows the virtual clock"),
        ("demo --duration 3 --sabotage sample=30,field=range", "the flight has only 30 samples"),
        ("transmit --duration 3 --sabotage sample=30,field=range", "the flight has only 30 samples"),
        ("tune --mismatch 0.1 --out found.toml", "nothing is random in these flights"),
        ("tune --impair delay=30ms,cut=40s+3s --out found.toml", "nothing is random in these flights"),
        ("tune --disturbance q=0,step=0.5@3 --out found.toml", "nothing is random in these flights"),
        ("demo --open", "it goes with --view"),
        ("transmit --pace 2 --clock real", "--pace slows the virtual clock"),
        ("transmit --link memory", "joins two ends in one process"),
        ("receive --link memory", "joins two ends in one process"),
        ("transmit --link serial", "a serial link needs a port"),
        ("receive --link serial --port socket://10.0.0.1:7000", "on another machine"),
    ],
)
def test_when_an_option_could_have_no_effect_then_it_is_refused_before_a_folder_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: str, words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    ended = CliRunner().invoke(app, arguments.split(), env={"COLUMNS": "200", "TERM": "dumb"})
    assert ended.exit_code != 0
    assert words in f"{ended.output} {ended.exception}"
    assert not list(tmp_path.iterdir())


def test_when_a_demo_is_paced_then_it_takes_its_time_without_a_page(tmp_path: Path) -> None:
    arguments = ("--mismatch", "0.1", "--duration", "2", "--pace", "1")
    ended = run("demo", "--json", *arguments, cwd=tmp_path)
    assert ended.code == 0, ended.err
    assert json.loads(ended.out)["realtime_factor"] < 1.1
