"""The commands for keys, and what `transmit`, `receive` and `router` say to addresses."""

from __future__ import annotations

from pathlib import Path

import pytest

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


def refused(cwd: Path, *arguments: str) -> str:
    ended = run(*arguments, cwd=cwd)
    assert ended.code == 2, ended.err
    assert "Traceback" not in ended.err
    assert not (cwd / "runs").exists(), "a refused command left a run folder behind"
    # As one line, without the frame that errors of usage are drawn in.
    return " ".join(ended.err.replace("│", " ").split())


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
    tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    said = refused(tmp_path, *arguments)
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
def test_what_is_missing_is_named_with_the_next_command(
    keys: Path, arguments: tuple[str, ...], hint: str
) -> None:
    assert hint in refused(keys.parent, "transmit", *arguments)


def test_a_certificate_of_the_other_role_is_refused(keys: Path) -> None:
    said = refused(keys.parent, "receive", "--keys", "keys/rig", "--peer", "x")
    assert "certificate of a transmitter" in said


def test_insecure_says_what_is_given_up(tmp_path: Path) -> None:
    ended = run(
        "receive",
        "--insecure",
        "--listen",
        "tcp/127.0.0.1:0",
        "--set",
        "link.peer_timeout_s=0.1",
        cwd=tmp_path,
    )
    assert ended.code == 4
    assert "command the motors" in ended.err
    assert "nothing is encrypted" in ended.err


def test_the_keys_commands_lead_from_one_to_the_next(tmp_path: Path) -> None:
    assert "tenbaud keys add rig --role transmitter" in run("keys", "init", cwd=tmp_path).out
    added = run("keys", "add", "rig", "--role", "transmitter", cwd=tmp_path).out
    assert "tenbaud keys add desk --role receiver --host" in added
    add_desk = ("keys", "add", "desk", "--role", "receiver", "--host", "fd00::2", "--days", "9")
    both = run(*add_desk, cwd=tmp_path)
    assert "tenbaud receive --keys keys/desk --peer rig --listen tls/[fd00::2]:7447" in both.out
    assert "tenbaud transmit --keys keys/rig --peer desk --connect tls/[fd00::2]:7447" in both.out
    shown = run("keys", "show", cwd=tmp_path)
    assert "desk, receiver" in shown.out
    assert "expires in 9 days" in shown.err
    assert run("keys", "renew", "desk", cwd=tmp_path).code == 0
    assert "warning" not in run("keys", "show", cwd=tmp_path).err
    assert "--role says what" in run("keys", "add", "x", cwd=tmp_path).err
