"""Where an end listens: a private socket, nothing beside an exposed link, or as set."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from channel.errors import LinkError
from channel.links.zenoh.telemetry import TelemetryPort
from tenbaud.telemetry import place
from tests.tenbaud.processes import REPOSITORY

LISTENS = """
import sys, time
from channel.links.zenoh.telemetry import TelemetryPort
port = TelemetryPort("transmitter", "lab", sys.argv[1])
print("ready", flush=True)
time.sleep(60)
"""


@pytest.fixture(autouse=True)
def own_folder(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("t")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(folder))
    return folder


def test_by_itself_an_end_listens_where_only_its_user_may_enter() -> None:
    endpoint = place.endpoint_for("", "receiver", ("tcp/127.0.0.1:7447",))
    assert endpoint is not None
    path = Path(endpoint.removeprefix(place.SOCKET))
    assert path.parent.stat().st_mode & 0o777 == 0o700
    assert path.name.startswith("receiver-")
    assert endpoint != place.endpoint_for("", "receiver", ("tcp/127.0.0.1:7447",))


@pytest.mark.parametrize(
    ("requested", "addresses", "insecure", "listens"),
    [
        ("", ("tcp/192.0.2.1:7447",), True, False),
        ("", ("tls/192.0.2.1:7447",), False, True),
        ("", ("tcp/127.0.0.1:7447",), True, True),
        ("on", ("tcp/192.0.2.1:7447",), True, True),
        ("off", (), False, False),
    ],
)
def test_beside_an_insecure_link_that_leaves_the_machine_it_is_off_unless_asked_for(
    requested: str, addresses: tuple[str, ...], insecure: bool, listens: bool
) -> None:
    endpoint = place.endpoint_for(requested, "transmitter", addresses, insecure)
    assert (endpoint is not None) is listens


def test_an_address_that_others_reach_needs_insecure() -> None:
    with pytest.raises(LinkError, match="leaves this machine"):
        place.endpoint_for("tcp/0.0.0.0:7448", "transmitter")
    assert place.endpoint_for("tcp/0.0.0.0:7448", "transmitter", (), True) == "tcp/0.0.0.0:7448"
    assert place.endpoint_for("tcp/127.0.0.1:7448", "transmitter") == "tcp/127.0.0.1:7448"


def test_a_folder_open_to_others_is_refused(own_folder: Path) -> None:
    place.private_folder().chmod(0o755)
    with pytest.raises(LinkError, match="open to others"):
        place.private_folder()


def test_when_a_flight_listens_then_it_is_found_whatever_its_number() -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    folder = place.private_folder()
    # Of another container's process, so to speak: here nobody has this number.
    live = folder / f"transmitter-{dead.pid}.sock"
    # The number has been given to somebody else meanwhile.
    stale = folder / f"receiver-{os.getpid()}.sock"
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(stale))
    stale.with_name(f"{stale.name}.lock").touch()
    port = TelemetryPort("transmitter", "lab", f"{place.SOCKET}{live}")
    try:
        assert place.found_endpoints() == [f"{place.SOCKET}{live}"]
        assert sorted(path.name for path in folder.iterdir()) == [live.name, f"{live.name}.lock"]
    finally:
        port.close()
    assert place.found_endpoints() == []


def test_when_a_flight_was_killed_then_its_files_are_cleared() -> None:
    folder = place.private_folder()
    endpoint = f"{place.SOCKET}{folder / 'transmitter-1.sock'}"
    killed = subprocess.Popen(
        [sys.executable, "-c", LISTENS, endpoint],
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert killed.stdout is not None
        assert killed.stdout.readline() == "ready\n"
        assert place.found_endpoints() == [endpoint]
    finally:
        killed.kill()
        killed.communicate()
    assert place.found_endpoints() == []
    assert list(folder.iterdir()) == []
