"""The transmitter's process: from a configuration and a link to a flown flight and its figures."""

from __future__ import annotations

import time
from collections.abc import Callable

from channel.errors import ConfigMismatch, LinkLost
from channel.line.clocks import SkewedClock, SkewedPeer
from channel.line.line import CleanLine, Uplink
from channel.line.virtual import Peer
from channel.links.base import Link
from channel.protocol.endings import End, Ending
from channel.protocol.recording import Recorder
from channel.protocol.wire import Wire
from tenbaud.build.ends import build_line, build_transmitter
from tenbaud.build.flight import Agreement
from tenbaud.build.transmitter_run import Stop, TransmitterRun
from tenbaud.flight.outcome import SAFE, ExitCode, Outcome, farewell_of
from tenbaud.flight.verdict import FlightCounts, verdict
from tenbaud.log.units import turn_in
from tenbaud.sentences import endings, events
from transmitter.endpoint import TransmitterEndpoint
from transmitter.guard import GuardCause
from transmitter.loops.flight import Flight
from transmitter.loops.real import RealFlight
from transmitter.loops.virtual import VirtualFlight
from transmitter.session.down_symbols import NarrowFollowing
from transmitter.session.session import Phase

UPRIGHT = ("pendulum", "rotary pendulum")
"""Pictures of plants whose last output is 0 upright."""


def prepare(agreement: Agreement, recorder: Recorder | None, wire: Wire) -> TransmitterRun:
    """Return a transmitter that is ready to fly."""
    node = build_transmitter(agreement, recorder)
    line, alphabet = build_line(agreement, "up", wire), agreement.codec.coder.alphabet
    uplink = Uplink(agreement.terms, alphabet, line, wire, recorder)
    virtual = agreement.clock == "virtual"
    downlink = build_line(agreement, "down", wire) if virtual else CleanLine()
    return TransmitterRun(agreement, TransmitterEndpoint(node, uplink), downlink)


def fly_virtual(run: TransmitterRun, peer: Peer, should_stop: Stop) -> Outcome:
    """Fly on the virtual clock against a peer in this process or another."""
    faults = run.agreement.faults
    if faults.bad_clock:
        peer = SkewedPeer(peer, SkewedClock(faults))
    return _fly(run, VirtualFlight(run.endpoint, run.downlink, peer, should_stop), should_stop)


def fly_real(run: TransmitterRun, link: Link, should_stop: Stop) -> Outcome:
    """Fly on the real clock over a link."""
    timeout_s = run.agreement.config.link.peer_timeout_s
    flight = RealFlight(run.endpoint, link, timeout_s, should_stop)
    try:
        return _fly(run, flight, should_stop, link.peer_present)
    finally:
        lateness = run.endpoint.lateness
        run.extra |= {
            "ticks_missed": run.endpoint.ticks_missed,
            "loop_late_ms_p50": lateness.percentile_ms(50.0),
            "loop_late_ms_p99": lateness.percentile_ms(99.0),
            "loop_late_ms_max": lateness.largest_ns / 1e6,
        }


def _fly(
    run: TransmitterRun,
    flight: Flight,
    should_stop: Stop,
    peer_present: Callable[[], bool] = lambda: True,
) -> Outcome:
    inlet, rig, session = run.endpoint.inlet, run.node.rig, run.node.session
    with rig:
        flight.greet()
        if should_stop():
            # A session may have begun meanwhile, whose receiver would wait for the flight.
            flight.leave(End(Ending.STOPPED))
            return Outcome(ExitCode.INTERRUPTED, endings.ending_text(Ending.STOPPED))
        if session.refusal is not None:
            raise ConfigMismatch(f"the receiver refused: {endings.refusal_text(session.refusal)}")
        if session.phase is Phase.GREETING:
            raise LinkLost("no answer to any request for a session came through this line")
        greeting_bytes = _control_bytes(run)
        started = time.perf_counter()
        first = session.epoch_tick
        try:
            run.ticks = flight.run(run.agreement.flight_ticks) - first
            run.rejoin_bytes = _control_bytes(run) - greeting_bytes
            present = peer_present()
            outcome = _outcome(run, present)

            def farewell() -> End:
                """Settle the outcome, now that the last echoes are in: only a difference counts."""
                nonlocal outcome
                if outcome.code is ExitCode.OK:
                    outcome = _desync_outcome(run) or outcome
                # Where the other end is gone, that is the cause of everything that the counts show.
                if outcome.code is ExitCode.OK or (present and _went_to_its_end(run)):
                    outcome = _not_flown(run) or outcome
                return farewell_of(outcome)

            flight.finish(farewell)
        finally:
            run.flight_s = time.perf_counter() - started
            run.wire_bytes_down = inlet.meter.wire_bytes
            run.extra["malformed"] = inlet.malformed
            if figures := rig.figures():
                run.extra["rig"] = figures
    return outcome


def _control_bytes(run: TransmitterRun) -> int:
    return run.uplink.meter.control_bytes + run.endpoint.inlet.meter.control_bytes


def _went_to_its_end(run: TransmitterRun) -> bool:
    """Return whether a flight ended only because its time was over, in any state."""
    session, guard = run.node.session, run.node.guard
    harmless = not guard.stopped or guard.timed_out
    flown = run.ticks >= run.agreement.flight_ticks
    return flown and harmless and session.desync is None and session.phase is not Phase.ENDED


def _outcome(run: TransmitterRun, peer_present: bool) -> Outcome:
    node, session = run.node, run.node.session
    if session.refusal is not None:
        text = endings.refusal_text(session.refusal)
        raise ConfigMismatch(f"the receiver refused to continue: {text}")
    if session.desync is not None and session.phase is Phase.ENDED:
        return Outcome(ExitCode.DESYNC, endings.desync_text(session.desync))
    if node.guard.reason is not None and node.guard.reason.cause is GuardCause.STOPPED:
        return Outcome(ExitCode.INTERRUPTED, endings.ending_text(Ending.STOPPED))
    if session.phase is Phase.ENDED or (node.guard.stopped and not peer_present):
        gone = session.end is None
        text = "the receiver is gone" if gone else endings.end_text(session.end, "receiver")
        return Outcome(ExitCode.LINK_LOST, f"{text}; {SAFE}")
    if node.guard.stopped:
        return Outcome(
            ExitCode.SAFETY_STOP,
            f"the guard took the motors to their safe voltage: {events.guard_text(node.guard.reason)}",
        )
    if session.phase is not Phase.FLYING:
        return Outcome(
            ExitCode.LINK_LOST, "the flight ended while the transmitter was asking for a common state"
        )
    return _desync_outcome(run) or Outcome(ExitCode.OK, endings.ending_text(Ending.OVER))


def _not_flown(run: TransmitterRun) -> Outcome | None:
    """Return the outcome of a flight that went to its end without flying; None: it has flown."""
    asked = {why.name.lower(): number for why, number in run.node.session.rejoins_asked.items()}
    return verdict(flight_counts(run), run.agreement, asked)


LATEST_CERTAIN_SAMPLES = 64
"""By which a sample of a narrow downlink is certain as a rule, where no one has been yet."""


def flight_counts(run: TransmitterRun) -> FlightCounts:
    """Return the counts for the verdict on a flight."""
    node, session = run.node, run.node.session
    samples = -(-run.ticks // run.agreement.terms.ticks_per_sample)
    if isinstance(session.following, NarrowFollowing):
        # The last samples of a flight are not certain yet when it ends.
        certainty = session.following.certainty
        usual = max(LATEST_CERTAIN_SAMPLES, round(4 * (certainty.delay_median or 0)))
        samples = max(0, samples - min(usual, certainty.delay_max or usual))
    return FlightCounts(
        samples=samples,
        confirmed=session.counts["confirmed"],
        erased=session.counts["erasures"],
        rejoins=session.counts["rejoins"],
        ticks=run.ticks,
        ticks_down=node.ticks_down,
        ticks_commanded=node.ticks_commanded,
        fell=_fell(run),
    )


def _fell(run: TransmitterRun) -> bool:
    """Return whether the last output of a pendulum, 0 upright, was ever beyond a right angle."""
    flown = not run.node.rig.is_recorded and not run.agreement.config.transmitter.dry_run
    signals = run.agreement.signals
    turn = turn_in(signals.outputs[-1].unit) if flown and signals.picture in UPRIGHT else None
    if turn is None:
        return False
    scores = run.node.scores.outputs[-1]
    return max(scores.largest, abs(scores.last or 0.0)) > turn / 4.0


def _desync_outcome(run: TransmitterRun) -> Outcome | None:
    """Return the outcome of a flight that was flown to its end though the copies differed, if so."""
    session = run.node.session
    if session.desync is None:
        return None
    if run.agreement.config.transmitter.on_desync == "stop":
        return Outcome(ExitCode.DESYNC, endings.desync_text(session.desync))
    desyncs = session.counts["desyncs"]
    if desyncs <= run.agreement.desyncs_expected + run.desyncs_asked:
        return None
    return Outcome(
        ExitCode.DESYNC,
        f"the copies of the codec differed {desyncs} time(s) and nobody asked for it; the flight "
        f"went on, but this should never happen: {endings.desync_text(session.desync)}. Both "
        "states are in the recordings (`tenbaud diff RUN`); please report it",
    )
