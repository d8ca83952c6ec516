"""The telemetry's Zenoh session: what it carries, and what it does when nobody is there."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from channel.errors import LinkError
from channel.links.zenoh_telemetry import TelemetryFeed, TelemetryPort


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


def test_when_nobody_watches_then_publishing_costs_nothing_and_raises_nothing(tmp_path: Path) -> None:
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    try:
        for _ in range(1000):
            port.publish(bytes(2000))
    finally:
        port.close()


def test_when_an_end_allows_no_control_then_it_hears_no_command(tmp_path: Path) -> None:
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    viewer = TelemetryFeed(endpoint_in(tmp_path), "lab", lambda data: None)
    try:
        viewer.send("lab", b"up")
    finally:
        viewer.close()
        port.close()


def test_when_nobody_listens_then_the_viewer_is_told(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match="telemetry cannot use"):
        TelemetryFeed(endpoint_in(tmp_path), "lab", lambda data: None)


def test_when_the_place_is_taken_then_the_end_is_told(tmp_path: Path) -> None:
    port = TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    try:
        with pytest.raises(LinkError, match="telemetry cannot use"):
            TelemetryPort("transmitter", "lab", endpoint_in(tmp_path))
    finally:
        port.close()
