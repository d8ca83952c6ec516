"""Options that do nothing where they are given are refused, not passed over."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from tenbaud.cli.commands import app


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["receive", "--sessions", "rig/*", "--allow-control"], "--allow-control"),
        (["receive", "--sessions", "rig/*", "--telemetry", "on"], "--telemetry"),
        (["receive", "--sessions", "rig/*", "--session", "rig/1"], "not both"),
        (["receive", "--flights", "2"], "--sessions"),
        (["receive", "--configs", "rigs"], "--sessions"),
        (["view", "--session", "rig//1"], "--session"),
    ],
)
def test_when_options_do_not_go_together_then_it_says_which(arguments: list[str], named: str) -> None:
    ended = CliRunner().invoke(app, arguments, env={"COLUMNS": "200", "TERM": "dumb"})
    assert ended.exit_code == 2
    assert named in ended.output
