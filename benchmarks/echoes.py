"""What answers at the far end of the round-trip benchmark, each in a separate process.

`python -m benchmarks.echoes KIND ADDRESS REPLY_BYTES [SETTINGS]`, the last one as JSON. Prints one
line when it is ready and ends when its standard input is closed.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import threading
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import zenoh

from channel.line.clocks import SkewedClock
from channel.line.impairments import LineFaults
from channel.links.base import Link

UP, DOWN = "ping/up", "ping/down"


def open_zenoh(
    settings: dict[str, Any], listen: str | None = None, connect: str | None = None
) -> zenoh.Session:
    """Return a bare Zenoh session: nothing found by itself, no lease of ours, no liveliness."""
    config = zenoh.Config()
    plain: dict[str, Any] = {
        "mode": "peer",
        "listen/endpoints": [listen] if listen else [],
        "connect/endpoints": [connect] if connect else [],
        "scouting/delay": 0,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/shared_memory/enabled": False,
    }
    for path, value in {**plain, **settings}.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def publisher(session: zenoh.Session, key: str) -> zenoh.Publisher:
    """Return a publisher with the settings of `channel.links.zenoh.link`."""
    return session.declare_publisher(
        key,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=zenoh.Priority.REAL_TIME,
        express=True,
        reliability=zenoh.Reliability.RELIABLE,
    )


def udp(address: str, reply: bytes, _: dict[str, Any]) -> None:
    """Answer every datagram."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.bind(("127.0.0.1", int(address)))
        _ready()
        while True:
            peer = line.recvfrom(2048)[1]
            line.sendto(reply, peer)


def tcp(address: str, reply: bytes, settings: dict[str, Any]) -> None:
    """Answer every message of the agreed size."""
    with socket.create_server(("127.0.0.1", int(address))) as server:
        _ready()
        line, _ = server.accept()
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with line:
            while line.recv(settings["request_bytes"], socket.MSG_WAITALL):
                line.sendall(reply)


def bare(address: str, reply: bytes, settings: dict[str, Any]) -> None:
    """Answer every message over Zenoh, straight from its channel."""
    with open_zenoh(settings, listen=address) as session:
        inbox = session.declare_subscriber(UP, zenoh.handlers.FifoChannel(100))
        out = publisher(session, DOWN)
        _ready()
        while True:
            inbox.recv().payload.to_bytes()
            out.put(reply)


def receiver(address: str, _: bytes, settings: dict[str, Any]) -> None:
    """Be a receiver, recording or not; it is configured as a receiver is."""
    from channel.links.zenoh.link import ZenohLink
    from channel.protocol.recording import Recorder
    from receiver.endpoint import ReceiverEndpoint
    from receiver.loops.single import serve
    from tenbaud.build.ends import build_receiver
    from tenbaud.build.flight import agree
    from tenbaud.config.load import load_config
    from tenbaud.flight.ends import SWITCH_INTERVAL_S, open_recorder

    sys.setswitchinterval(SWITCH_INTERVAL_S)
    agreement = agree(load_config(None, None, settings["config"]), "real")
    with TemporaryDirectory() as folder:
        recorder: Recorder | None = None
        if settings["record"]:
            recorder = open_recorder(agreement, "receiver", Path(folder) / "receiver.mcap")
        with ZenohLink("receiver", "ping", listen=(address,)) as link:
            built = build_receiver(agreement, recorder, link.wire)
            clock = SymbolClock(agreement.terms.sample_ns)
            endpoint = ReceiverEndpoint(built.session, built.downlink, clock)
            _ready()
            serve(endpoint, CountedLink(link, clock), 3600.0)


class SymbolClock(SkewedClock):
    """A clock for a receiver that is asked faster than its slots are due: one sample for each message.

    The receiver drops symbols far ahead of its schedule, and these come as fast as they are answered.
    It does its own arithmetic of deadlines on this clock, as on any other.
    """

    def __init__(self, sample_ns: int) -> None:
        super().__init__(LineFaults())
        self.messages = 0
        self._sample_ns = sample_ns

    def shown(self, true_ns: int) -> int:
        """Return the time that this clock shows."""
        return self.messages * self._sample_ns

    def reached(self, shown_ns: int, not_before_ns: int = 0) -> int:
        """Return when it will show a time: with the messages, not by itself."""
        return not_before_ns + 1_000_000_000


class CountedLink(Link):
    """A link whose messages set a clock."""

    def __init__(self, link: Link, clock: SymbolClock) -> None:
        super().__init__()
        self._link = link
        self._clock = clock

    def send(self, data: bytes) -> None:
        """Send one message."""
        self._link.send(data)

    def receive(self, timeout_s: float) -> bytes | None:
        """Return the next message, None when none comes in time."""
        data = self._link.receive(timeout_s)
        self._clock.messages += data is not None
        return data

    def peer_present(self) -> bool:
        """Return whether the other end is there."""
        return self._link.peer_present()

    def close(self) -> None:
        """Leave the link open: it belongs to the caller."""


KINDS = {"udp": udp, "tcp": tcp, "zenoh": bare, "receiver": receiver}


def _ready() -> None:
    print("ready", flush=True)


def _end_with_parent() -> None:
    sys.stdin.read()
    os._exit(0)


if __name__ == "__main__":
    kind, address, reply_bytes, *rest = sys.argv[1:]
    threading.Thread(target=_end_with_parent, daemon=True).start()
    KINDS[kind](address, b"r" * int(reply_bytes), json.loads(rest[0]) if rest else {})
