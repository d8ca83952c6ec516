"""A recorded stream of commands, played back into the flight and into a later one, through a router."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import zenoh

from channel.links.endpoints import free_endpoint
from channel.links.zenoh.router import ZenohRouter
from tests.network.flights import Flight
from tests.network.namespaces import Machine
from tests.tenbaud.ends import wait_for

COMMANDS = "tenbaud/helicopter/down/command"


class Here(Machine):
    """This machine, no namespace."""

    @property
    def prefix(self) -> list[str]:
        return []


class Tap:
    """Listens to the downlink, and says it all again."""

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self.heard: list[bytes] = []
        self.said = 0
        self._subscriber = session.declare_subscriber(
            COMMANDS,
            zenoh.handlers.Callback(
                lambda sample: self.heard.append(sample.payload.to_bytes()), indirect=False
            ),
            allowed_origin=zenoh.Locality.REMOTE,
        )

    def say_again(self) -> None:
        for message in list(self.heard):
            self._session.put(COMMANDS, message, congestion_control=zenoh.CongestionControl.BLOCK)
            self.said += 1


@contextmanager
def tapped(endpoint: str) -> Iterator[Tap]:
    config = zenoh.Config()
    for path, value in (
        ("mode", "client"),
        ("connect/endpoints", [endpoint]),
        ("scouting/multicast/enabled", False),
    ):
        config.insert_json5(path, json.dumps(value))
    with zenoh.open(config) as session:
        yield Tap(session)


def test_a_recorded_stream_of_commands_does_nothing(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    link = ["--router", endpoint]
    here = Here("here")
    with ZenohRouter((endpoint,)), tapped(endpoint) as tap:
        for number in range(2):
            folder = tmp_path / str(number)
            folder.mkdir()
            said_before = tap.said
            with Flight(folder, here, here, rig_link=link, desk_link=link) as flight:
                # The second flight is played the whole of the first one.
                wait_for(lambda: len(tap.heard) > 30, lambda: f"{flight.rig.said}")
                flight.wait_until_flying()
                tap.say_again()
                time.sleep(0.5)
                flight.wait_until_flying()
                upper, lower = flight.stopped()
            assert tap.said - said_before > 30
            assert upper["stale_commands"] >= tap.said - said_before
            assert upper["rejoins"] == upper["desyncs"] == upper["guard_rearmed"] == 0
            assert lower["desyncs"] == 0
