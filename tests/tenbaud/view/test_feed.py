"""A viewer's connection to the ends: commands to one that has gone."""

from __future__ import annotations

import queue
import time
from pathlib import Path

from channel.links.zenoh.telemetry import TelemetryPort
from tenbaud.view.feed import Feed

PATIENCE_S = 10.0


def test_when_an_end_has_gone_then_a_command_to_it_is_nothing_and_the_other_hears_it(
    tmp_path: Path,
) -> None:
    places = [f"unixsock-stream/{tmp_path}/{number}.sock" for number in range(2)]
    commands = queue.SimpleQueue[bytes]()
    ports = [TelemetryPort("receiver", "lab", place, commands.put) for place in places]
    try:
        with Feed(tuple(places), "lab") as feed:
            until_s = time.monotonic() + PATIENCE_S
            while len(feed._open) < 2:
                assert time.monotonic() < until_s
                time.sleep(0.01)
            # As the thread beside closes it, between two looks of the one that sends.
            feed._open[places[0]].close()
            feed.send("lab", {"kind": "pause"})
            assert commands.get(timeout=PATIENCE_S) == b'{"kind":"pause"}'
        feed.send("lab", {"kind": "pause"})
    finally:
        for port in ports:
            port.close()
