"""A report about this machine's fitness for a flight, to read and to paste into a question."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import platform
import socket
import sys
import time
from dataclasses import dataclass, replace
from typing import Literal, get_args

from channel.codec.downlink.layout import symbols_carried
from channel.codec.downlink.mirrored import MirroredLaw
from channel.errors import LinkError, TenbaudError
from channel.links.base import Link
from channel.links.endpoints import free_endpoint
from channel.links.serial.budget import check_slot_counter, least_rate_baud
from channel.links.serial.wire import SerialWire
from channel.protocol.frames import Symbol
from channel.protocol.terms import Rung
from channel.protocol.wire import encode
from tenbaud.build.codec import build_codec
from tenbaud.build.flight import Agreement, agree, build_terms
from tenbaud.config.schema import FlightConfig
from tenbaud.config.version import software_version
from transmitter.rigs.serial_ports import list_ports

State = Literal["ok", "note", "problem"]

JITTER_SAMPLES = 200
LATE_MS_P99_MAX = 5.0
"""Later than this, and ticks of 10 ms run into each other."""

ROUND_TRIPS = 50
TRIP_TIMEOUT_S = 2.0


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report."""

    state: State
    subject: str
    text: str


def examine(config: FlightConfig, connect: tuple[str, ...] = ()) -> list[Finding]:
    """Look at everything; `connect` are Zenoh endpoints of a receiver to reach."""
    agreement = agree(config, "real")
    return [
        *_software(),
        _numerics(agreement),
        *narrow_downlink(agreement),
        *_clock(config),
        *_ports(),
        serial_line(config),
        _vendor(),
        _zenoh(),
        *(_reach(endpoint) for endpoint in connect),
    ]


def report(findings: list[Finding]) -> str:
    """Return the findings as text of one line each."""
    width = max(len(finding.subject) for finding in findings)
    marks = {"ok": "ok     ", "note": "note   ", "problem": "PROBLEM"}
    return "\n".join(
        f"{marks[finding.state]}  {finding.subject:{width}}  {finding.text}" for finding in findings
    )


def _software() -> list[Finding]:
    versions = []
    for name in ("eclipse-zenoh", "pyserial", "numpy", "pydantic"):
        try:
            versions.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            versions.append(f"{name} missing")
    return [
        Finding("ok", "tenbaud", f"{software_version()}, Python {platform.python_version()}"),
        Finding(
            "ok", "machine", f"{platform.platform()}, {platform.machine()}, {sys.byteorder}-endian"
        ),
        Finding("ok", "libraries", ", ".join(versions)),
    ]


def _numerics(agreement: Agreement) -> Finding:
    probe = agreement.identity.numerics_probe.hex()
    text = f"{probe} with preset {agreement.config.preset}; the other machine must show the same"
    return Finding("ok", "numerics probe", text)


def narrow_downlink(agreement: Agreement) -> list[Finding]:
    """Say what a narrow downlink carries, and how long that takes."""
    if agreement.two_way is None:
        return []
    terms, scheme = agreement.terms, agreement.two_way.scheme
    text = f"{terms.down_symbols} symbol(s) a sample; "
    if not isinstance(scheme, MirroredLaw):
        lead_s = terms.lead_ticks * terms.tick_ns / 1e9
        text += f"commands come down, decided {lead_s:g} s ahead (timing.lead_ticks)"
        return [Finding("ok", "narrow downlink", text)]
    queue_s, word_s = (one * terms.sample_ns / 1e9 for one in (scheme.queue, scheme.queue_needed))
    text += (
        "only set-points come down, and the law runs beside the plant as well; a set-point by hand "
        f"acts {queue_s:g} s after it is given, one of the configuration in time"
    )
    if len(scheme.ranges) == 1:
        return [Finding("ok", "narrow downlink", text)]
    text += (
        f". {len(scheme.ranges)} outputs are steered, one word at a time: of set-points that change "
        f"within {word_s:g} s, the second acts up to {word_s:g} s late, and so on; let them change one "
        "after another, or shorten words (downlink.command_symbols with a higher channel.downlink_baud)"
    )
    return [Finding("note", "narrow downlink", text)]


def _clock(config: FlightConfig) -> list[Finding]:
    resolution_ns = time.get_clock_info("monotonic").resolution * 1e9
    period_s = config.timing.tick_s
    late_ms = []
    start = time.monotonic()
    for index in range(1, JITTER_SAMPLES + 1):
        due = start + index * period_s
        time.sleep(max(0.0, due - time.monotonic()))
        late_ms.append((time.monotonic() - due) * 1e3)
    late_ms.sort()
    half, most, largest = (late_ms[round(share * (JITTER_SAMPLES - 1))] for share in (0.5, 0.99, 1.0))
    text = (
        f"waking for {JITTER_SAMPLES} ticks of {period_s * 1e3:g} ms: late by {half:.2f} ms (half), "
        f"{most:.2f} ms (99 %), {largest:.2f} ms (worst)"
    )
    bad = most > LATE_MS_P99_MAX
    if bad:
        text += "; close other programs, and switch off power saving"
    return [
        Finding("ok", "clock", f"monotonic, steps of {resolution_ns:g} ns"),
        Finding("problem" if bad else "ok", "sleep", text),
    ]


def _ports() -> list[Finding]:
    ports = list_ports()
    if not ports:
        return [
            Finding("note", "serial ports", "none; a rig on USB shows here as /dev/ttyACM0 or COM3")
        ]
    return [
        Finding("ok", "serial port", f"{port.device}: {port.description}")
        if port.usable
        else Finding("problem", "serial port", f"{port.device}: not permitted; {port.remedy}")
        for port in ports
    ]


def serial_line(config: FlightConfig) -> Finding:
    """Say which serial line carries the flight, with each downlink."""
    try:
        needs = ", ".join(f"{least} baud {rung}" for rung, least in line_rates(config).items())
    except (ValueError, TenbaudError) as error:
        return Finding("note", "serial line", f"none carries preset {config.preset}: {error}")
    return Finding(
        "ok", "serial line", f"preset {config.preset} needs at least {needs} (channel.downlink)"
    )


def line_rates(config: FlightConfig) -> dict[Rung, int]:
    """Return the least rate of a serial line for each downlink; ValueError where none carries it."""
    codec = build_codec(config)
    on_memory = config.model_copy(update={"link": config.link.model_copy(update={"kind": "memory"})})
    terms = build_terms(on_memory, codec, "real")
    baud = config.channel.downlink_baud
    narrow = terms.narrowed(baud, symbols_carried(baud, terms.sample_ns), is_mirrored=False)
    check_slot_counter(narrow, SerialWire(len(codec.coder.alphabet.symbols)))
    return {
        rung: least_rate_baud(narrow if rung == "narrow" else replace(terms, downlink=rung), codec)
        for rung in get_args(Rung)
    }


def _vendor() -> Finding:
    try:
        found = importlib.util.find_spec("quanser.hardware") is not None
    except ModuleNotFoundError:
        found = False
    text = "quanser.hardware is there" if found else "no quanser.hardware; needed for --rig hil only"
    return Finding("ok" if found else "note", "Quanser", text)


def _zenoh() -> Finding:
    """Let two sessions on this machine meet and count how long messages take."""
    from channel.links.zenoh.link import ZenohLink

    endpoint = free_endpoint()
    trips_ms = []
    there = encode(Symbol(1, 0, 0, 0))
    try:
        with (
            ZenohLink("receiver", "doctor", listen=(endpoint,)) as receiver,
            ZenohLink("transmitter", "doctor", connect=(endpoint,)) as transmitter,
        ):
            if not _present(transmitter, TRIP_TIMEOUT_S):
                return Finding("problem", "Zenoh", f"two sessions at {endpoint} did not meet")
            for _ in range(ROUND_TRIPS):
                begun = time.perf_counter()
                transmitter.send(there)
                if receiver.receive(TRIP_TIMEOUT_S) is None:
                    return Finding("problem", "Zenoh", f"a message at {endpoint} did not arrive")
                receiver.send(b"back")
                if transmitter.receive(TRIP_TIMEOUT_S) is None:
                    return Finding("problem", "Zenoh", f"an answer at {endpoint} did not arrive")
                trips_ms.append((time.perf_counter() - begun) * 1e3)
    except LinkError as error:
        return Finding("problem", "Zenoh", str(error))
    trips_ms.sort()
    half_ms, worst_ms = trips_ms[ROUND_TRIPS // 2], trips_ms[-1]
    text = f"loopback round trip {half_ms:.2f} ms (half), {worst_ms:.2f} ms (worst of {ROUND_TRIPS})"
    return Finding("ok", "Zenoh", text)


def _reach(endpoint: str) -> Finding:
    """Try to open a TCP connection: the first thing that a firewall would refuse."""
    host, _, port = endpoint.partition("/")[2].partition("#")[0].rpartition(":")
    try:
        begun = time.perf_counter()
        with socket.create_connection((host.strip("[]"), int(port)), TRIP_TIMEOUT_S):
            taken_ms = (time.perf_counter() - begun) * 1e3
    except (OSError, ValueError) as error:
        return Finding(
            "problem",
            "reach",
            f"{endpoint}: {error}; is `tenbaud receive` running there, and the port open?",
        )
    return Finding("ok", "reach", f"{endpoint} answers in {taken_ms:.1f} ms")


def _present(link: Link, timeout_s: float) -> bool:
    until = time.monotonic() + timeout_s
    while time.monotonic() < until:
        if link.peer_present():
            return True
        time.sleep(0.01)
    return False
