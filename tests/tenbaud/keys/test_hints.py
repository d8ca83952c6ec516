"""The commands to run next can be typed in as they are printed."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest

from tenbaud.cli.keys import next_steps
from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import KeysError, add_node, create_authority, read_node, read_nodes

NODES = {"desk": NodeRole.RECEIVER, "hub": NodeRole.ROUTER, "rig": NodeRole.TRANSMITTER}


def test_when_a_path_has_spaces_then_the_commands_have_it_as_one_word(tmp_path: Path) -> None:
    keys = tmp_path / "my own keys"
    create_authority(keys)
    for name, role in NODES.items():
        add_node(keys, name, role, ("fd00::2",))
    lines = [line.strip() for line in next_steps(read_nodes(keys)).splitlines()]
    commands = [line.partition(":  ") for line in lines if line.startswith("on ")]
    assert len(commands) == 5
    for place, _, command in commands:
        words = shlex.split(command)
        assert words[words.index("--keys") + 1] == str(keys / place.removeprefix("on "))
        # A shell would look for files of the name that brackets stand for.
        assert "'tls/[fd00::2]:7447'" in command
        assert "tls/[fd00::2]:7447" in words


def test_when_a_key_is_open_to_others_then_the_command_has_its_path_as_one_word(
    tmp_path: Path,
) -> None:
    keys = tmp_path / "my own keys"
    create_authority(keys)
    key = add_node(keys, "rig", NodeRole.TRANSMITTER, ()).credentials.private_key
    key.chmod(0o640)
    with pytest.raises(KeysError) as caught:
        read_node(keys / "rig")
    assert shlex.split(str(caught.value).partition("away: ")[2]) == ["chmod", "600", str(key)]
