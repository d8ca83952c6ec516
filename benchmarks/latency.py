"""From a symbol frame out to its command frame in, beside bare lines carrying messages of that size.

All lines are measured in turns, within the same minutes: a machine shared with others wanders by more
than the differences looked for. A round trip of ours is the time from handing the symbol's bytes to
the link until the link hands out the bytes of the commands; the far end is a receiver as
`tenbaud receive` runs it. What the two are compared with does nothing but answer.
"""

from __future__ import annotations

import json
import math
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import zenoh

from benchmarks.echoes import DOWN, UP, open_zenoh, publisher
from benchmarks.figures import Figure
from benchmarks.throwaway_keys import tls_settings
from channel.links.endpoints import free_endpoint
from channel.links.zenoh.link import ZenohLink
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye
from channel.protocol.wire import decode, encode
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from transmitter.session.session import Phase, TransmitterSession

ROUNDS = 10
PINGS = 250
WARM_UP = 50
REQUEST_BYTES = 15
"""of a symbol frame"""
PACE_S = 0.001
"""Between two round trips, as at 1000 symbols/s. One right after the other, no core ever goes to sleep,
which flatters whatever does nothing in between."""

Ping = Callable[[], int]
"""One round trip; returns its nanoseconds."""


def reply_bytes(ticks_per_sample: int, repeats: int = 2) -> int:
    """Return the length of a command frame: head, count, its echoes of two motors each, checksum."""
    return 8 + 5 + (repeats + 1) * (10 + 4 * ticks_per_sample) + 2


def latency_figures() -> list[Figure]:
    """Return median and 99th percentile of each line, and the two ratios that are promised."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        pings = {
            "udp": _udp(stack),
            "tcp": _tcp(stack),
            "zenoh": _zenoh(stack, "tcp", {}),
            "zenoh_tls": _zenoh(stack, "tls", tls_settings(folder)),
            "flight_n1": _flight(stack, 1, record=False),
            "flight_n10_recorded": _flight(stack, 10, record=True),
        }
        times_ns: dict[str, list[int]] = {name: [] for name in pings}
        ratios: list[float] = []
        tls: list[float] = []
        at_once: list[float] = []
        for _ in range(ROUNDS):
            medians = {}
            for name, ping in pings.items():
                turn = sorted(_turn(ping))
                times_ns[name] += turn
                medians[name] = turn[PINGS // 2]
            ratios.append(medians["flight_n1"] / medians["zenoh"])
            tls.append(medians["zenoh_tls"] / medians["zenoh"])
            hurried = {name: sorted(_turn(pings[name], 0.0)) for name in ("zenoh", "flight_n1")}
            at_once.append(hurried["flight_n1"][PINGS // 2] / hurried["zenoh"][PINGS // 2])
    figures = []
    for name, times in times_ns.items():
        times.sort()
        figures.append(Figure(f"round_trip_{name}_us_p50", times[len(times) // 2] / 1e3, "us", ""))
        figures.append(
            Figure(f"round_trip_{name}_us_p99", times[len(times) * 99 // 100] / 1e3, "us", "")
        )
    return [
        *figures,
        Figure("round_trip_to_bare_zenoh", _middle(ratios), "times", "at most 1.5"),
        Figure("round_trip_to_bare_zenoh_without_pause", _middle(at_once), "times"),
        Figure("round_trip_tls_to_tcp", _middle(tls), "times", "at most 1.3"),
    ]


def _turn(ping: Ping, pace_s: float = PACE_S) -> list[int]:
    for _ in range(WARM_UP):
        ping()
    times_ns = []
    next_s = time.monotonic()
    for _ in range(PINGS):
        next_s = max(next_s + pace_s, time.monotonic())
        if pace_s:
            time.sleep(max(0.0, next_s - time.monotonic()))
        times_ns.append(ping())
    return times_ns


def _middle(values: list[float]) -> float:
    return sorted(values)[len(values) // 2]


def _udp(stack: ExitStack) -> Ping:
    port = _port()
    _far_end(stack, "udp", str(port), reply_bytes(1))
    line = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
    line.connect(("127.0.0.1", port))
    line.settimeout(5.0)

    def ping() -> int:
        sent_ns = time.perf_counter_ns()
        line.send(b"s" * REQUEST_BYTES)
        line.recv(2048)
        return time.perf_counter_ns() - sent_ns

    return ping


def _tcp(stack: ExitStack) -> Ping:
    port, size = _port(), reply_bytes(1)
    _far_end(stack, "tcp", str(port), size, {"request_bytes": REQUEST_BYTES})
    line = stack.enter_context(socket.create_connection(("127.0.0.1", port)))
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def ping() -> int:
        sent_ns = time.perf_counter_ns()
        line.sendall(b"s" * REQUEST_BYTES)
        line.recv(size, socket.MSG_WAITALL)
        return time.perf_counter_ns() - sent_ns

    return ping


def _zenoh(stack: ExitStack, protocol: str, settings: dict[str, Any]) -> Ping:
    endpoint = f"{protocol}/127.0.0.1:{_port()}"
    _far_end(stack, "zenoh", endpoint, reply_bytes(1), settings)
    session = stack.enter_context(open_zenoh(settings, connect=endpoint))
    inbox = session.declare_subscriber(DOWN, zenoh.handlers.FifoChannel(100))
    out = publisher(session, UP)

    def has_subscriber() -> bool:
        # Zenoh's annotation says bool; it is an object with this one field.
        status: Any = out.matching_status
        return bool(status.matching)

    _until(has_subscriber, "the far end's subscriber")

    def ping() -> int:
        sent_ns = time.perf_counter_ns()
        out.put(b"s" * REQUEST_BYTES)
        inbox.recv().payload.to_bytes()
        return time.perf_counter_ns() - sent_ns

    return ping


def _flight(stack: ExitStack, ticks_per_sample: int, record: bool) -> Ping:
    """Fly samples one after the other, each as soon as the one before is answered."""
    config = load_config(None, None, flight_settings(ticks_per_sample))
    endpoint = free_endpoint()
    _far_end(
        stack,
        "receiver",
        endpoint,
        0,
        {"config": flight_settings(ticks_per_sample), "record": record},
    )
    agreement = agree(config, "real")
    session = TransmitterSession(agreement.codec, agreement.terms, agreement.identity, os.getpid())
    link = stack.enter_context(ZenohLink("transmitter", "ping", connect=(endpoint,)))
    _until(link.peer_present, "the receiver")
    while session.phase is not Phase.FLYING:
        link.send(encode(session.hello()))
        answer = link.receive(1.0)
        if answer is not None:
            session.on_frame(decode(answer))
    stack.callback(lambda: link.send(encode(Bye(session.session_number, Ending.OVER, "measured"))))
    sample = 0

    def ping() -> int:
        nonlocal sample
        tick = sample * ticks_per_sample
        measured = 0.5 * math.sin(tick * agreement.terms.tick_ns / 1e9)
        (symbol,) = session.on_measurement(tick, (measured,))
        message = encode(symbol)
        sent_ns = time.perf_counter_ns()
        link.send(message)
        answer = link.receive(5.0)
        took_ns = time.perf_counter_ns() - sent_ns
        if answer is None:
            raise RuntimeError(f"the receiver did not answer the symbol of sample {sample}")
        session.on_frame(decode(answer))
        sample += 1
        if session.confirmed_state.sample != sample:
            raise RuntimeError(f"the echo of sample {sample - 1} did not come with the answer")
        session.command(tick + ticks_per_sample)
        session.following.take_confirmed()
        return took_ns

    return ping


def flight_settings(ticks_per_sample: int) -> dict[str, Any]:
    """Return a configuration that answers every symbol at once and never erases one."""
    tick_s = 0.1
    return {
        "timing": {
            "tick_s": tick_s,
            "symbol_period_s": tick_s * ticks_per_sample,
        },
        "channel": {"rate_baud": 1.0 / (tick_s * ticks_per_sample)},
        "coder": {"window_signs": 3},
    }


def _far_end(
    stack: ExitStack, kind: str, address: str, size: int, settings: dict[str, Any] | None = None
) -> None:
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "benchmarks.echoes",
            kind,
            address,
            str(size),
            json.dumps(settings or {}),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[1],
    )
    stack.callback(process.communicate, timeout=10)
    if process.stdout is None or process.stdout.readline() != "ready\n":
        raise RuntimeError(f"the far end of the {kind} line did not start")


def _port() -> int:
    return int(free_endpoint().rpartition(":")[2])


def _until(condition: Callable[[], bool], what: str) -> None:
    give_up_s = time.monotonic() + 10.0
    while not condition():
        if time.monotonic() > give_up_s:
            raise RuntimeError(f"{what} did not come within 10 s")
        time.sleep(0.01)
