"""The receiver's process: serves one flight over a link."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from channel.errors import ConfigMismatch
from channel.links.base import Link
from channel.protocol.endings import End, Ending
from receiver.endpoint import ReceiverEndpoint
from receiver.loops.single import serve as serve_flight
from receiver.session.session import Phase, ReceiverSession
from tenbaud.build.flight import Agreement
from tenbaud.build.transmitter_run import Stop
from tenbaud.flight.outcome import ExitCode, Outcome
from tenbaud.flight.verdict import FlightCounts, verdict
from tenbaud.sentences import endings


def serve(
    agreement: Agreement,
    endpoint: ReceiverEndpoint,
    link: Link,
    should_stop: Stop,
    meanwhile: Callable[[], None] = lambda: None,
) -> Outcome:
    """Serve one flight; return how it ended. Raises ConfigMismatch and LinkLost."""
    session = endpoint.session
    timeout_s = agreement.config.link.peer_timeout_s
    try:
        serve_flight(endpoint, link, timeout_s, should_stop, meanwhile)
    finally:
        if session.phase is Phase.FLYING:
            for message in endpoint.bye(End(Ending.STOPPED if should_stop() else Ending.FAILED)):
                link.send(message)
    if session.refusal is not None:
        raise ConfigMismatch(f"refused the transmitter: {endings.refusal_text(session.refusal)}")
    if should_stop():
        return Outcome(ExitCode.INTERRUPTED, endings.ending_text(Ending.STOPPED))
    return ended_outcome(agreement, session)


def ended_outcome(agreement: Agreement, session: ReceiverSession) -> Outcome:
    """Return the outcome of a session that has ended."""
    ending = None if session.end is None else session.end.ending
    if session.desync is not None and ending is not Ending.OVER:
        return Outcome(ExitCode.DESYNC, endings.desync_text(session.desync))
    text = endings.end_text(session.end, "transmitter")
    if ending not in (Ending.OVER, Ending.STOPPED):
        return Outcome(ExitCode.LINK_LOST, text)
    # As far as this end can see.
    flown = session.counts["samples"]
    counts = FlightCounts(
        samples=flown + session.counts["samples_skipped"],
        confirmed=flown,
        erased=session.counts["erasures"],
        rejoins=session.counts["rejoins"],
        bad_commands=session.counts["bad_commands"],
        commands=flown * agreement.terms.ticks_per_sample,
    )
    outcome = verdict(counts, agreement)
    if outcome is not None and session.controller_problem:
        why = f"its first fault: the controller {session.controller_problem}"
        return replace(outcome, text=f"{outcome.text}\n  {why}")
    return outcome or Outcome(ExitCode.OK, text)
