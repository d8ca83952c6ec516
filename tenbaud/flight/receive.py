"""The receiver's process: serves one flight over a link."""

from __future__ import annotations

from channel.errors import ConfigMismatch
from channel.links.base import Link
from receiver.endpoint import ReceiverEndpoint
from receiver.real_service import serve_real
from receiver.session import Phase
from receiver.virtual_service import serve_virtual
from tenbaud.build import Agreement
from tenbaud.flight.outcome import FLIGHT_OVER, ExitCode, Outcome
from tenbaud.flight.transmit import Stop
from transmitter.node import STOPPED


def serve(agreement: Agreement, endpoint: ReceiverEndpoint, link: Link, should_stop: Stop) -> Outcome:
    """Serve one flight; return how it ended. Raises ConfigMismatch and LinkLost."""
    loop = serve_virtual if agreement.clock == "virtual" else serve_real
    session = endpoint.session
    try:
        loop(endpoint, link, agreement.config.link.peer_timeout_s, should_stop)
    finally:
        if agreement.clock == "real" and session.phase is Phase.FLYING:
            for message in endpoint.bye(STOPPED if should_stop() else "the receiver failed"):
                link.send(message)
    if session.refusal is not None:
        raise ConfigMismatch(f"refused the transmitter: {session.refusal}")
    if session.desync is not None:
        desync = session.desync
        return Outcome(
            ExitCode.DESYNC,
            f"the codecs differ after sample {desync.sample}: transmitter "
            f"{desync.transmitter_digest:016x}, receiver {desync.receiver_digest:016x}",
        )
    if should_stop():
        return Outcome(ExitCode.INTERRUPTED, STOPPED)
    over = session.end_reason.endswith((FLIGHT_OVER, STOPPED))
    return Outcome(ExitCode.OK if over else ExitCode.LINK_LOST, session.end_reason)
