"""The receiver's process: serves one flight over a link."""

from __future__ import annotations

from collections.abc import Callable

from channel.errors import ConfigMismatch
from channel.links.base import Link
from channel.protocol.endings import End, Ending
from receiver.endpoint import ReceiverEndpoint
from receiver.loops.single import serve as serve_flight
from receiver.session.session import Phase, ReceiverSession
from tenbaud.build.flight import Agreement
from tenbaud.build.transmitter_run import Stop
from tenbaud.flight.outcome import ExitCode, Outcome
from tenbaud.flight.verdict import FlightCounts, faults_of, settings_of, verdict_text
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
    return _not_flown(agreement, session) or Outcome(ExitCode.OK, text)


def _not_flown(agreement: Agreement, session: ReceiverSession) -> Outcome | None:
    """Return the outcome of a session whose flight did not fly, as far as this end can see."""
    flown = session.counts["samples"]
    counts = FlightCounts(
        samples=flown + session.counts["samples_skipped"],
        confirmed=flown,
        erased=session.counts["erasures"],
        rejoins=session.counts["rejoins"],
        bad_commands=session.counts["bad_commands"],
        commands=flown * agreement.terms.ticks_per_sample,
    )
    faults = faults_of(counts)
    if not faults:
        return None
    text = verdict_text(faults, counts, settings_of(agreement), {})
    if session.controller_problem:
        text += f"\n  its first fault: the controller {session.controller_problem}"
    return Outcome(ExitCode.NOT_FLOWN, text, faults)
