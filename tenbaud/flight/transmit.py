"""The transmitter's process: from a configuration and a link to a flown flight and its figures."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from channel.errors import ConfigMismatch
from channel.line import Line
from channel.links.base import Link
from channel.recording import Recorder
from channel.uplink import Uplink
from channel.virtual import Peer
from channel.wire import Wire
from tenbaud.build import Agreement
from tenbaud.build_ends import build_transmitter, build_uplink
from tenbaud.flight.outcome import FLIGHT_OVER, ExitCode, Outcome
from transmitter.node import STOPPED, TransmitterNode
from transmitter.real_flight import RealFlight
from transmitter.session import Phase
from transmitter.virtual_flight import VirtualFlight
from transmitter.virtual_peer import LinkPeer

Stop = Callable[[], bool]


@dataclass(slots=True)
class TransmitterRun:
    """The parts of one transmitter, before, during and after its flight."""

    agreement: Agreement
    node: TransmitterNode
    uplink: Uplink
    ticks: int = 0
    flight_s: float = 0.0
    """wall-clock time of the flight itself"""
    wire_bytes_down: int = 0
    extra: dict[str, Any] = field(default_factory=dict)
    """figures of the clock that was flown on"""


def prepare(agreement: Agreement, recorder: Recorder | None, wire: Wire) -> TransmitterRun:
    """Return a transmitter that is ready to fly."""
    node = build_transmitter(agreement, recorder)
    return TransmitterRun(agreement, node, build_uplink(agreement, wire))


def fly_virtual(run: TransmitterRun, peer: Peer, should_stop: Stop) -> Outcome:
    """Fly on the virtual clock against a peer in this process or another."""
    flight = VirtualFlight(run.node, run.uplink, Line(), peer)
    with run.node.rig:
        flight.greet()
        _check_welcome(run)
        started = time.perf_counter()
        try:
            run.ticks = flight.run(run.agreement.flight_ticks, should_stop)
            outcome = _outcome(run, True)
            flight.finish(run.ticks, _farewell(outcome))
        finally:
            run.flight_s = time.perf_counter() - started
            run.wire_bytes_down = flight.wire_bytes_down
            run.extra["malformed"] = flight.malformed
    return outcome


def fly_real(run: TransmitterRun, link: Link, should_stop: Stop) -> Outcome:
    """Fly on the real clock over a link."""
    flight = RealFlight(run.node, run.uplink, link, should_stop)
    with run.node.rig:
        flight.greet(run.agreement.config.link.peer_timeout_s)
        if should_stop():
            return Outcome(ExitCode.INTERRUPTED, STOPPED)
        _check_welcome(run)
        started = time.perf_counter()
        try:
            run.ticks = flight.run(run.agreement.flight_ticks)
            outcome = _outcome(run, link.peer_present())
            flight.finish(_farewell(outcome), run.ticks)
        finally:
            run.flight_s = time.perf_counter() - started
            run.wire_bytes_down = flight.wire_bytes_down
            if figures := run.node.rig.figures():
                run.extra["rig"] = figures
            lateness = flight.lateness
            run.extra |= {
                "malformed": flight.malformed,
                "ticks_missed": flight.ticks_missed,
                "loop_late_ms_p50": lateness.percentile_ms(50.0),
                "loop_late_ms_p99": lateness.percentile_ms(99.0),
                "loop_late_ms_max": lateness.largest_ns / 1e6,
            }
    return outcome


def link_peer(run: TransmitterRun, link: Link, should_stop: Stop) -> LinkPeer:
    """Return the receiver at the other end of a link, for the virtual clock."""
    return LinkPeer(link, run.agreement.config.link.peer_timeout_s, should_stop)


def _check_welcome(run: TransmitterRun) -> None:
    session = run.node.session
    if session.refusal is not None:
        raise ConfigMismatch(f"the receiver refused: {session.refusal}")


def _farewell(outcome: Outcome) -> str:
    return FLIGHT_OVER if outcome.code is ExitCode.OK else outcome.text


def _outcome(run: TransmitterRun, peer_present: bool) -> Outcome:
    node, session = run.node, run.node.session
    if session.desync is not None:
        desync = session.desync
        return Outcome(
            ExitCode.DESYNC,
            f"the codecs differ after sample {desync.sample}: transmitter "
            f"{desync.transmitter_digest:016x}, receiver {desync.receiver_digest:016x}",
        )
    if node.guard.reason == STOPPED:
        return Outcome(ExitCode.INTERRUPTED, STOPPED)
    if session.phase is Phase.ENDED or (node.guard.stopped and not peer_present):
        return Outcome(
            ExitCode.LINK_LOST,
            f"{session.end_reason or 'the receiver is gone'}; the motors are at their safe voltage",
        )
    if node.guard.stopped:
        return Outcome(
            ExitCode.SAFETY_STOP,
            f"the guard took the motors to their safe voltage: {node.guard.reason}",
        )
    return Outcome(ExitCode.OK, FLIGHT_OVER)
