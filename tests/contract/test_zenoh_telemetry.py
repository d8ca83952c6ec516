"""The telemetry's Zenoh session: what it carries, and what it does when nobody is there."""

from __future__ import annotations

import os
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from channel.errors import LinkError
from channel.links.security import Invited, Part, Security
from channel.links.zenoh.telemetry import TelemetryFeed, TelemetryPort
from tests.contract.security import credentials, free_tls_endpoint
from tests.contract.test_links import PATIENCE_S, SILENCE_S
from tests.tenbaud.processes import REPOSITORY


def wait_until(met: Callable[[], object]) -> None:
    until_s = time.monotonic() + 10.0
    while not met():
        assert time.monotonic() < until_s
        time.sleep(0.01)


def endpoint_in(folder: Path) -> str:
    return f"unixsock-stream/{folder}/t.sock"


def test_messages_reach_every_viewer_and_commands_come_back(tmp_path: Path) -> None:
    commands: list[bytes] = []
    seen: list[list[bytes]] = [[], []]
    port = TelemetryPort("receiver", "lab/one", endpoint_in(tmp_path), commands.append)
    viewers = [
        TelemetryFeed(endpoint_in(tmp_path), name, take.append)
        for name, take in zip(("**", "lab/one"), seen, strict=True)
    ]
    try:

        def told() -> bool:
            port.publish(b"state")
            return all(seen)

        wait_until(told)
        viewers[0].send("lab/two", b"not for this flight")
        viewers[1].send("lab/one", b"up")
        wait_until(lambda: commands)
        assert commands == [b"up"]
        viewers[0].close()
        wait_until(lambda: port.publish(b"more") or seen[1][-1] == b"more")
        assert viewers[1].is_connected
    finally:
        port.close()
        wait_until(lambda: not viewers[1].is_connected)
        viewers[1].close()


STANDS_STILL = """
import os, signal, sys
from channel.links.security import Invited, Part, Security
from channel.links.zenoh.telemetry import TelemetryFeed
feed = TelemetryFeed(sys.argv[1], "lab", lambda data: None)
print("ready", flush=True)
os.kill(os.getpid(), signal.SIGSTOP)
"""


def test_when_a_viewer_stands_still_then_the_other_still_sees_and_nothing_waits_for_it(
    tmp_path: Path,
) -> None:
    seen: list[bytes] = []
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    still = subprocess.Popen(
        [sys.executable, "-c", STANDS_STILL, endpoint_in(tmp_path)],
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
        stdout=subprocess.PIPE,
        text=True,
    )
    viewer = None
    try:
        assert still.stdout is not None
        assert still.stdout.readline() == "ready\n"
        viewer = TelemetryFeed(endpoint_in(tmp_path), "lab", seen.append)
        # More by far than every buffer on the way to the one that stands still can hold.
        for number in range(500):
            port.publish(number.to_bytes(4, "little") + bytes(20_000))
        wait_until(lambda: port.publish(b"last") or b"last" in seen)
    finally:
        still.kill()
        still.communicate()
        if viewer is not None:
            viewer.close()
        port.close()


def test_a_port_knows_whether_anybody_watches_it(tmp_path: Path) -> None:
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    try:
        assert not port.is_watched()
        viewer = TelemetryFeed(endpoint_in(tmp_path), "lab", lambda data: None)
        wait_until(port.is_watched)
        viewer.close()
        wait_until(lambda: not port.is_watched())
    finally:
        port.close()


def test_when_nobody_watches_then_publishing_costs_nothing_and_raises_nothing(tmp_path: Path) -> None:
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    try:
        for _ in range(1000):
            port.publish(bytes(2000))
    finally:
        port.close()


def test_when_an_end_allows_no_control_then_a_command_is_lost_and_telemetry_goes_on(
    tmp_path: Path,
) -> None:
    seen: list[bytes] = []
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    viewer = TelemetryFeed(endpoint_in(tmp_path), "lab", seen.append)
    try:
        viewer.send("lab", b"up")
        wait_until(lambda: port.publish(b"still here") or b"still here" in seen)
    finally:
        viewer.close()
        port.close()
    assert set(seen) == {b"still here"}


def test_when_a_viewer_is_closed_while_it_sends_then_sending_is_a_link_error(tmp_path: Path) -> None:
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    viewer = TelemetryFeed(endpoint_in(tmp_path), "lab", lambda data: None)
    closing = threading.Thread(target=viewer.close)
    until_s = time.monotonic() + PATIENCE_S

    def send_on() -> None:
        while time.monotonic() < until_s:
            viewer.send("lab", b"up")

    try:
        viewer.send("lab", b"up")
        closing.start()
        with pytest.raises(LinkError, match="could not be sent"):
            send_on()
    finally:
        closing.join()
        port.close()


def test_when_nobody_listens_then_the_viewer_is_informed(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"cannot use .* for telemetry"):
        TelemetryFeed(endpoint_in(tmp_path), "lab", lambda data: None)


def test_when_the_place_is_taken_then_the_end_is_informed(tmp_path: Path) -> None:
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    try:
        with pytest.raises(LinkError, match=r"cannot use .* for telemetry"):
            TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    finally:
        port.close()


@pytest.mark.parametrize("part", ["viewer", "operator"])
def test_over_tls_only_the_invited_see_and_only_operators_steer(part: Part) -> None:
    endpoint, commands = free_tls_endpoint(), queue.Queue[bytes]()
    invited = Security(credentials("desk"), (Invited("page", part, "lab/one"),))
    seen: dict[str, queue.Queue[bytes]] = {name: queue.Queue() for name in ("page", "intern")}
    with ExitStack() as stack:
        port = TelemetryPort("receiver", "lab/one", endpoint, commands.put, invited)
        stack.callback(port.close)
        feeds = {}
        for name, messages in seen.items():
            feeds[name] = TelemetryFeed(endpoint, "lab/one", messages.put, credentials(name))
            stack.callback(feeds[name].close)
        wait_until(lambda: port.publish(b"state") or not seen["page"].empty())
        assert seen["intern"].empty()
        feeds["intern"].send("lab/one", b"of a stranger")
        feeds["page"].send("lab/one", b"of the page")
        if part == "operator":
            assert commands.get(timeout=PATIENCE_S) == b"of the page"
        with pytest.raises(queue.Empty):
            commands.get(timeout=SILENCE_S)


def test_when_a_name_is_no_key_then_it_is_refused_and_the_endpoint_is_free(
    tmp_path: Path,
) -> None:
    with pytest.raises(LinkError, match="a//b"):
        TelemetryPort("receiver", "a//b", endpoint_in(tmp_path))
    port = TelemetryPort("receiver", "lab", endpoint_in(tmp_path))
    try:
        with pytest.raises(LinkError, match="a//b"):
            TelemetryFeed(endpoint_in(tmp_path), "a//b", [].append)
    finally:
        port.close()
