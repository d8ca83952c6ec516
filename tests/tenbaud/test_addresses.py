"""The commands for keys, and what `transmit`, `receive` and `router` say to addresses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from typer.testing import CliRunner

from channel.errors import TenbaudError
from channel.links.endpoints import free_endpoint
from tenbaud.cli.commands import app
from tenbaud.flight.outcome import outcome_of
from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import add_node, create_authority
from tests.tenbaud.processes import run

FAR = "tcp/192.0.2.1:7447"


@pytest.fixture
def keys(tmp_path: Path) -> Path:
    create_authority(tmp_path / "keys")
    add_node(tmp_path / "keys", "rig", NodeRole.TRANSMITTER, ())
    add_node(tmp_path / "keys", "late", NodeRole.TRANSMITTER, (), days=-1.0)
    return tmp_path / "keys"


@dataclass
class Said:
    """How a command ended that was run within this process."""

    code: int
    text: str
    """as one line, without the frame that errors of usage are drawn in"""


@pytest.fixture
def tenbaud(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Said]:
    monkeypatch.chdir(tmp_path)

    def command(*arguments: str) -> Said:
        ended = CliRunner().invoke(app, arguments)
        text = ended.output
        code = ended.exit_code
        if isinstance(ended.exception, TenbaudError):
            text += str(ended.exception)
            code = int(outcome_of(ended.exception).code)
        return Said(code, " ".join(text.replace("│", " ").split()))

    return command


def refused(tenbaud: Callable[..., Said], *arguments: str) -> str:
    ended = tenbaud(*arguments)
    assert ended.code == 2, ended.text
    assert not Path("runs").exists(), "a refused command left a run folder behind"
    return ended.text


@pytest.mark.parametrize(
    "arguments",
    [
        ("transmit", "--connect", FAR),
        ("receive", "--listen", FAR),
        ("transmit", "--router", FAR),
        ("router", "--listen", FAR),
        ("receive", "--scout"),
    ],
    ids=" ".join,
)
def test_without_keys_an_address_beyond_this_machine_is_refused(
    tenbaud: Callable[..., Said], arguments: tuple[str, ...]
) -> None:
    said = refused(tenbaud, *arguments)
    assert "no encryption" in said
    assert "tenbaud keys init" in said
    assert "--insecure" in said


@pytest.mark.parametrize(
    ("arguments", "hint"),
    [
        (("--connect", "tls/192.0.2.1:7447"), "add --keys FOLDER and --peer NAME"),
        (("--connect", "tls/192.0.2.1:7447", "--keys", "keys/rig"), "--peer NAME"),
        (("--connect", FAR, "--keys", "keys/rig", "--peer", "desk"), "write tls/192.0.2.1:7447"),
        (("--peer", "desk"), "they need --keys"),
        (("--keys", "keys/late", "--peer", "desk"), "tenbaud keys renew late"),
        (("--keys", "keys/nobody", "--peer", "desk"), "tenbaud keys add NAME"),
        (("--router", "tcp/127.0.0.1:1", "--connect", "tcp/127.0.0.1:2"), "nothing else"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
@pytest.mark.usefixtures("keys")
def test_what_is_missing_is_named_with_the_next_command(
    tenbaud: Callable[..., Said], arguments: tuple[str, ...], hint: str
) -> None:
    assert hint in refused(tenbaud, "transmit", *arguments)


@pytest.mark.usefixtures("keys")
def test_a_certificate_of_the_other_role_is_refused(tenbaud: Callable[..., Said]) -> None:
    said = refused(tenbaud, "receive", "--keys", "keys/rig", "--peer", "x")
    assert "certificate of a transmitter" in said


def test_insecure_says_what_is_given_up(tmp_path: Path) -> None:
    arguments = ("--insecure", "--listen", free_endpoint(), "--set", "link.peer_timeout_s=0.1")
    ended = run("receive", *arguments, cwd=tmp_path)
    assert ended.code == 4
    assert "command the motors" in ended.err
    assert "no encryption" in ended.err


def test_the_keys_commands_lead_from_one_to_the_next(tenbaud: Callable[..., Said]) -> None:
    assert "tenbaud keys add rig --role transmitter" in tenbaud("keys", "init").text
    added = tenbaud("keys", "add", "rig", "--role", "transmitter").text
    assert "tenbaud keys add desk --role receiver --host" in added
    add_desk = ("keys", "add", "desk", "--role", "receiver", "--host", "fd00::2", "--days", "9")
    both = tenbaud(*add_desk).text
    assert "tenbaud receive --keys keys/desk --peer rig --listen 'tls/[fd00::2]:7447'" in both
    assert "tenbaud transmit --keys keys/rig --peer desk --connect 'tls/[fd00::2]:7447'" in both
    shown = tenbaud("keys", "show").text
    assert "desk, receiver" in shown
    assert "expires in 9 days" in shown
    assert tenbaud("keys", "renew", "desk").code == 0
    assert "warning" not in tenbaud("keys", "show").text
    assert "--role says what" in refused(tenbaud, "keys", "add", "x")
