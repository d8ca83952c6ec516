"""As in containers: users without a name, other process numbers, keys that others can change."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import KeysError, add_node, create_authority, read_node
from tenbaud.telemetry.place import found_endpoints
from tests.tenbaud.ends import End, wait_for
from tests.tenbaud.processes import REPOSITORY

NOBODY = 54_321
AS_NOBODY = (
    *("setpriv", "--reuid", str(NOBODY), "--regid", str(NOBODY), "--clear-groups"),
    # Reads everything, since the interpreter may be in a folder of root's; writes nothing of others.
    *("--inh-caps", "+dac_read_search", "--ambient-caps", "+dac_read_search"),
)
ELSEWHERE = ("unshare", "--pid", "--fork", "--kill-child")

needs_root = pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root to be somebody else"
)


def _works(*command: str) -> bool:
    if shutil.which(command[0]) is None:
        return False
    return subprocess.run([*command, "true"], capture_output=True, check=False).returncode == 0


@contextmanager
def _being(user: int) -> Iterator[None]:
    os.seteuid(user)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def rig_keys(tmp_path: Path) -> Path:
    create_authority(tmp_path / "keys")
    add_node(tmp_path / "keys", "rig", NodeRole.TRANSMITTER, ())
    return tmp_path / "keys" / "rig"


@needs_root
def test_keys_of_another_user_are_refused_in_words(rig_keys: Path) -> None:
    for folder in (rig_keys, *rig_keys.parents):
        if folder.stat().st_uid == 0 and folder.is_relative_to(Path("/tmp")) and folder != Path("/tmp"):
            folder.chmod(0o755)
    with _being(NOBODY), pytest.raises(KeysError, match=r"Permission denied: .*node\.key"):
        read_node(rig_keys)


@pytest.mark.parametrize("name", ["authority.pem", "node.pem", "."])
def test_keys_that_others_can_change_are_refused(rig_keys: Path, name: str) -> None:
    (rig_keys / name).chmod(0o777 if name == "." else 0o664)
    with pytest.raises(KeysError, match="can be changed by others"):
        read_node(rig_keys)


def test_a_key_of_another_certificate_is_refused(rig_keys: Path) -> None:
    other = add_node(rig_keys.parent, "other", NodeRole.TRANSMITTER, ())
    shutil.copy(other.folder / "node.key", rig_keys / "node.key")
    with pytest.raises(KeysError, match=r"node\.key is not the key of node\.pem"):
        read_node(rig_keys)


@needs_root
def test_a_user_without_name_or_home_flies(tmp_path: Path) -> None:
    if not _works(*AS_NOBODY):
        pytest.skip("setpriv is not permitted here")
    for folder in (tmp_path, *tmp_path.parents):
        if folder.is_relative_to(Path("/tmp")) and folder != Path("/tmp"):
            folder.chmod(0o755)
    own = tmp_path / "own"
    own.mkdir()
    os.chown(own, NOBODY, NOBODY)
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY), "TMPDIR": str(own)}
    for name in ("HOME", "XDG_RUNTIME_DIR", "XDG_CACHE_HOME", "USER", "LOGNAME"):
        environment.pop(name, None)
    command = [*AS_NOBODY, sys.executable, "-m", "tenbaud"]
    flight = ["demo", "--duration", "1", "--json", "--figure", "--out", str(own / "run")]
    done = subprocess.run(
        [*command, *flight], env=environment, cwd=own, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert {path.name for path in (own / "run").iterdir()} >= {"flight.png", "summary.json"}


@needs_root
def test_flights_with_the_same_process_number_have_each_their_own_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> None:
    if not _works(*ELSEWHERE):
        pytest.skip("process namespaces are not permitted here")
    shared = tmp_path_factory.mktemp("r")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(shared))
    listen = ["--listen", "tcp/127.0.0.1:0", "--set", "link.peer_timeout_s=60"]
    ends = [
        End("receive", listen, tmp_path / str(number), prefix=ELSEWHERE, draws=False)
        for number in range(2)
    ]
    try:
        wait_for(lambda: len(found_endpoints()) == 2, lambda: f"{[end.said for end in ends]}")
        assert not any("no telemetry" in line for end in ends for line in end.said)
    finally:
        for end in ends:
            end.kill()
    wait_for(lambda: found_endpoints() == [], lambda: "sockets of killed processes are left")
