"""What TLS, and a router, cost a round trip: `python -m benchmarks.secure_line`.

Symbol frame out, command frame in, between two processes: over plain TCP, over TLS with client
certificates and access rules, and over TLS through a router (in this process). The three take turns, so
that a disturbed second disturbs all of them alike.
"""

from __future__ import annotations

import argparse
import json
import signal
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from channel.links.endpoints import free_endpoint, with_protocol
from channel.links.kind import NodePlace
from channel.links.security import Invited, Part, Security
from channel.links.zenoh.link import ZenohLink
from channel.links.zenoh.router import ZenohRouter
from channel.protocol.frames import Commands, Echo, Symbol
from channel.protocol.wire import encode
from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import add_node, create_authority, read_node

SESSION = "benchmark"
ROUNDS = 5
PATIENCE_S = 5.0
SYMBOL = encode(Symbol(1, 0, 1, 1))
COMMAND = encode(Commands(1, 0, (Echo(1, 1, 1, (1500, -1500)),)))


def measure(turns: int) -> dict[str, float]:
    """Return median round trips in microseconds, and the ratios to plain TCP."""
    with TemporaryDirectory(prefix="tenbaud-bench-") as folder, ExitStack() as stack:
        keys = Path(folder) / "keys"
        create_authority(keys)
        for name, role in (
            ("rig", NodeRole.TRANSMITTER),
            ("desk", NodeRole.RECEIVER),
            ("hub", NodeRole.ROUTER),
        ):
            add_node(keys, name, role, ("localhost",))
        links = {
            "tcp": stack.enter_context(_pair(None)),
            "tls": stack.enter_context(_pair(keys)),
            "tls_router": stack.enter_context(_pair(keys, routed=True)),
        }
        times: dict[str, list[float]] = {name: [] for name in links}
        for _ in range(ROUNDS):
            for name, rig in links.items():
                times[name] += _round_trips(rig, turns // ROUNDS)
    medians = {name: statistics.median(taken) for name, taken in times.items()}
    figures = {f"{name}_round_trip_us": round(value, 1) for name, value in medians.items()}
    figures["tls_to_tcp"] = round(medians["tls"] / medians["tcp"], 3)
    figures["router_to_tls"] = round(medians["tls_router"] / medians["tls"], 3)
    return figures


@contextmanager
def _pair(keys: Path | None, routed: bool = False) -> Iterator[ZenohLink]:
    """Within the `with`, a link at whose other end a process answers."""
    endpoint = free_endpoint() if keys is None else with_protocol(free_endpoint(), "tls")
    with ExitStack() as stack:
        if routed and keys is not None:
            both = _security(keys, "hub", ("rig", "transmitter"), ("desk", "receiver"))
            stack.enter_context(ZenohRouter((endpoint,), security=both))
        place, peer = ("router", "hub") if routed else ("listen", "rig")
        command = [sys.executable, "-m", "benchmarks.secure_line", "--answer", place, endpoint]
        answering = subprocess.Popen([*command, "" if keys is None else str(keys), peer])
        stack.callback(answering.wait)
        stack.callback(answering.terminate)
        place, peer = ("router", "hub") if routed else ("connect", "desk")
        security = None if keys is None else _security(keys, "rig", (peer, "receiver"))
        rig = ZenohLink("transmitter", SESSION, **_node(place, endpoint, security))
        stack.enter_context(rig)
        until = time.monotonic() + PATIENCE_S
        while not rig.peer_present():
            if time.monotonic() > until:
                raise RuntimeError("the two ends did not meet")
            time.sleep(0.01)
        yield rig


def _answer(place: str, endpoint: str, keys: str, peer: str) -> None:
    security = _security(Path(keys), "desk", (peer, "transmitter")) if keys else None
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    with ZenohLink("receiver", SESSION, **_node(place, endpoint, security)) as desk:
        while True:
            if desk.receive(PATIENCE_S) is not None:
                desk.send(COMMAND)


def _node(place: str, endpoint: str, security: Security | None) -> NodePlace:
    if place == "router":
        return {"router": (endpoint,), "security": security}
    if place == "connect":
        return {"connect": (endpoint,), "security": security}
    return {"listen": (endpoint,), "security": security}


def _security(keys: Path, name: str, *peers: tuple[str, Part]) -> Security:
    invited = tuple(Invited(peer, part, SESSION) for peer, part in peers)
    return Security(read_node(keys / name).credentials, invited)


def _round_trips(rig: ZenohLink, turns: int) -> list[float]:
    taken = []
    for _ in range(turns):
        started = time.perf_counter_ns()
        rig.send(SYMBOL)
        if rig.receive(PATIENCE_S) is None:
            raise RuntimeError("a round trip was lost")
        taken.append((time.perf_counter_ns() - started) / 1000.0)
    return taken


def main() -> None:
    """Measure and print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=10_000)
    parser.add_argument("--answer", nargs=4, help="used by this program itself")
    arguments = parser.parse_args()
    if arguments.answer is not None:
        _answer(*arguments.answer)
    else:
        print(json.dumps(measure(arguments.turns), indent=2))


if __name__ == "__main__":
    main()
