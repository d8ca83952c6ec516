"""The complete run of one end: open recording and link, fly, close everything, return figures."""

from __future__ import annotations

import gc
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from channel.links.base import Link, Role
from channel.links.kind import LinkEnd, NodePlace
from channel.links.security import Security
from channel.protocol.recording import Recorder
from channel.protocol.wire import DATAGRAM
from receiver.endpoint import ReceiverEndpoint
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import Agreement
from tenbaud.build.recorded import replay_notes
from tenbaud.build.transmitter_run import Stop, TransmitterRun
from tenbaud.flight import receive, transmit
from tenbaud.flight.display import StatusReporter
from tenbaud.flight.drawing import NotebookDrawing
from tenbaud.flight.outcome import SAFE, ExitCode, Outcome, outcome_of
from tenbaud.flight.status import Status, StatusMode, outputs_status
from tenbaud.flight.stop import StopFlag
from tenbaud.flight.summary import (
    counted,
    gap_part,
    link_part,
    narrow_part,
    receiver_part,
    recording_part,
    transmitter_part,
)
from tenbaud.flight.trouble import Trouble
from tenbaud.flight.viewing import ENDS, Views, viewed
from tenbaud.recording.encoding import SIGNALS_KEY, signals_text
from tenbaud.recording.folder import RunFolder
from tenbaud.recording.overview import OverviewRecorder, is_long
from tenbaud.recording.shared import SharedWriter
from tenbaud.recording.writer import McapRecorder
from tenbaud.sentences.flown import Summary
from tenbaud.telemetry.compose import ReceiverComposer, TransmitterComposer
from tenbaud.telemetry.end import DEFAULT_OPTIONS, TelemetryEnd, TelemetryOptions
from transmitter.loops.virtual import LinkPeer

SWITCH_INTERVAL_S = 0.0002
"""A busy recorder thread may keep the loop waiting this long; Python's default is 5 ms."""

WORDS_SHOWN = 48


@dataclass(frozen=True, slots=True)
class Endpoints:
    """Addresses where an end listens and connects."""

    listen: tuple[str, ...] = ()
    connect: tuple[str, ...] = ()
    insecure: bool = False
    router: tuple[str, ...] = ()
    """Zenoh routers behind which the other end is, instead of the two before"""
    scouting: bool = False
    security: Security | None = None
    """TLS, and who is let in; None: plain"""
    take_over: bool = False
    """receiver: take a flight over from the receiver that has it"""
    telemetry: TelemetryOptions = DEFAULT_OPTIONS

    def node(self) -> NodePlace:
        """Return the function that opens this end's Zenoh session."""
        return {
            "listen": self.listen,
            "connect": self.connect,
            "router": self.router,
            "scouting": self.scouting,
            "insecure": self.insecure,
            "security": self.security,
        }


def open_link(
    agreement: Agreement, role: Role, endpoints: Endpoints, stop: Stop = lambda: False
) -> Link:
    """Return an open link of the configured kind for one end."""
    settings, terms = agreement.config.link, agreement.terms
    end = LinkEnd(role, settings, terms, agreement.codec, endpoints.node(), stop)
    return agreement.link.open(end)


def run_transmitter(
    agreement: Agreement, endpoints: Endpoints, folder: RunFolder, status: StatusMode
) -> tuple[Outcome, Summary]:
    """Fly one flight as the transmitter; the outcome says how it ended."""
    with _end(agreement, "transmitter", folder) as (recorder, stop):
        telemetry = TelemetryEnd(
            agreement, "transmitter", recorder, endpoints.telemetry, endpoints.node()
        )
        with (
            refusals(endpoints) as refused,
            open_link(agreement, "transmitter", endpoints, stop) as link,
        ):
            trouble = Trouble(link, endpoints.security, refused, stop)
            run = transmit.prepare(agreement, telemetry.recorder, link.wire)
            peer = _peer(run, link, trouble.should_stop, recorder)
            keep_alive = peer.keep_alive if peer is not None else None
            live = telemetry.fly_transmitter(run, trouble.should_stop, keep_alive)
            with (
                telemetry.publishing(lambda tap: TransmitterComposer(run, tap, live)),
                StatusReporter(lambda: transmitter_status(run), status),
            ):
                stopped = trouble.should_stop
                if peer is None:
                    outcome = _guarded(lambda: transmit.fly_real(run, link, stopped))
                else:
                    outcome = _guarded(lambda: transmit.fly_virtual(run, peer, stopped))
                outcome = trouble.first_cause(outcome, SAFE)
            run.node.flush_records()
        summary = transmitter_part(run, outcome) | link_part(link, refused) | telemetry.summary()
        return outcome, _with_recording(summary, recorder)


def run_receiver(
    agreement: Agreement, endpoints: Endpoints, folder: RunFolder, status: StatusMode
) -> tuple[Outcome, Summary]:
    """Serve one flight as the receiver; the outcome says how it ended."""
    with _end(agreement, "receiver", folder) as (recorder, stop):
        telemetry = TelemetryEnd(agreement, "receiver", recorder, endpoints.telemetry, endpoints.node())
        with refusals(endpoints) as refused, open_link(agreement, "receiver", endpoints, stop) as link:
            trouble = Trouble(link, endpoints.security, refused, stop)
            endpoint = build_receiver(
                agreement, telemetry.recorder, link.wire, endpoints.take_over, telemetry.steering
            )
            live = telemetry.fly_receiver(endpoint, trouble.should_stop)
            with (
                telemetry.publishing(lambda tap: ReceiverComposer(agreement, endpoint, tap, live)),
                StatusReporter(lambda: receiver_status(agreement, endpoint), status),
            ):
                outcome = _guarded(
                    lambda: receive.serve(agreement, endpoint, link, live, recorder.help_out)
                )
                outcome = trouble.first_cause(outcome)
            endpoint.session.flush_records()
        summary = receiver_part(agreement, endpoint, outcome) | link_part(link, refused)
        summary |= telemetry.summary()
        return outcome, _with_recording(summary, recorder)


@contextmanager
def refusals(endpoints: Endpoints) -> Iterator[Counter[str]]:
    """Within a `with`, connections that fail to prove who they are get counted by reason."""
    if endpoints.security is None or not endpoints.listen:
        yield Counter()
        return
    from channel.links.zenoh.gate import HandshakeLog

    with HandshakeLog() as log:
        yield log.refused


def run_in_memory(
    agreement: Agreement,
    folder: RunFolder,
    status: StatusMode,
    views: Views | None = None,
    drawing: NotebookDrawing | None = None,
) -> tuple[Outcome, Summary, Summary]:
    """Fly both ends in this process, on the virtual clock, without a link."""
    with (
        _end(agreement, "transmitter", folder) as (recorder, stop),
        open_recorder(agreement, "receiver", folder.receiver) as receiver_recorder,
    ):
        rows: tuple[Recorder, Recorder] = recorder, receiver_recorder
        if drawing is not None:
            rows = drawing.recorders(*rows)
        views = views or viewed()
        up, down = (
            TelemetryEnd(agreement, role, own, views[role], {})
            for role, own in zip(ENDS, rows, strict=True)
        )
        run = transmit.prepare(agreement, up.recorder, DATAGRAM)
        endpoint = build_receiver(agreement, down.recorder, DATAGRAM, references=down.steering)
        obeyed = down.fly_receiver(endpoint, stop)
        # Also while the flight is paused.
        live = up.fly_transmitter(run, stop, obeyed)

        def act(tick: int) -> None:
            obeyed()
            live.at_tick(tick)
            if drawing is not None:
                drawing.at_tick(tick)

        if views["receiver"].control or drawing is not None:
            run.node.before_every_tick(act)
        with (
            up.publishing(lambda tap: TransmitterComposer(run, tap, live)),
            down.publishing(lambda tap: ReceiverComposer(agreement, endpoint, tap, obeyed)),
            StatusReporter(lambda: transmitter_status(run), status),
        ):
            outcome = _guarded(lambda: transmit.fly_virtual(run, endpoint, stop))
        seen = receive.ended_outcome(agreement, endpoint.session)
        if outcome.code is ExitCode.OK and seen.code is ExitCode.NOT_FLOWN:
            outcome = seen
        run.node.flush_records()
        endpoint.session.flush_records()
        if drawing is not None:
            drawing.end()
        upper = transmitter_part(run, outcome)
        lower = receiver_part(agreement, endpoint, outcome)
        return outcome, _with_recording(upper, recorder), lower


def open_recorder(
    agreement: Agreement, role: Role, path: Path, writer: SharedWriter | None = None
) -> McapRecorder:
    """Return a recorder for one end, its file headed by the flight's description.

    `writer`: a thread that it shares with others, instead of one of its own.
    """
    plant = agreement.signals
    metadata = {
        "role": role,
        "preset": agreement.config.preset,
        "clock": agreement.clock,
        "version": agreement.identity.version,
        "config_digest": agreement.identity.config_digest.hex(),
        "numerics_probe": agreement.identity.numerics_probe.hex(),
        "tick_s": repr(agreement.config.timing.tick_s),
        "shared_config": agreement.identity.config,
        SIGNALS_KEY: signals_text(plant),
        "seed": str(agreement.config.seed),
        "impairments": agreement.config.link.impairments,
    }
    if notes := replay_notes(agreement.config):
        metadata["flight_log_notes"] = "\n".join(notes)
    # Of many rigs no figures are drawn at the end. A receiver is not informed of the flight's length.
    is_gathered = writer is None and (role == "receiver" or is_long(agreement.flight_ticks))
    overview = OverviewRecorder(plant) if is_gathered else None
    # Virtual time can outrun the disk and is not disturbed by waiting for it.
    wait = agreement.clock == "virtual"
    return McapRecorder(path, metadata, wait_when_full=wait, shared=writer, overview=overview)


def transmitter_status(run: TransmitterRun) -> Status:
    """Return the status of a running transmitter, for people."""
    node, session = run.node, run.node.session
    coder = run.agreement.codec.coder
    tick_s = run.agreement.terms.tick_ns / 1e9
    # Copied in one go: the flight's thread may add to it meanwhile.
    words = tuple(node.scores.last_words)
    return {
        "role": "transmitter",
        "phase": session.phase.value,
        "tick": node.tick,
        "of_ticks": run.agreement.flight_ticks,
        "time_s": node.tick * tick_s,
        "outputs": outputs_status(
            run.agreement.signals,
            [one.last for one in node.scores.outputs],
            coder.ranges(session.confirmed_state.coder),
            [one.last_coded_error for one in node.scores.outputs],
        ),
        **counted(session, "erasures", "desyncs", "digest_checks", "rejoins"),
        "words": [word for word, _ in words],
        "about": [about for _, about in words],
        "guard": node.guard.state.value,
        "kept_symbols_per_s": run.endpoint.rate.kept_symbols_per_s,
        **gap_part(node.gauge.now if node.gauge is not None else None),
        **_narrow(run),
    }


def _narrow(run: TransmitterRun) -> Status:
    """Return the figures of a narrow downlink, with those of this moment."""
    part = narrow_part(run)
    if not part:
        return {}
    listed = run.node.session.following.hypotheses  # type: ignore[attr-defined]
    now = {
        "unconfirmed": listed.next_heard - listed.next_confirmed,
        "hypotheses": listed.size,
        "baud": run.endpoint.down_baud.baud,
    }
    return {"narrow": part["narrow"] | now}


def receiver_status(agreement: Agreement, endpoint: ReceiverEndpoint) -> Status:
    """Return the status of a running receiver, for people."""
    session, model = endpoint.session, agreement.codec.model
    return {
        "role": "receiver",
        "phase": session.phase.value,
        "time_s": session.state.sample * agreement.terms.sample_ns / 1e9,
        "outputs": outputs_status(
            agreement.signals,
            model.measured(session.state.model),
            agreement.codec.coder.ranges(session.state.coder),
        ),
        "erasures": session.counts["erasures"],
        "words": session.history.last_words(WORDS_SHOWN),
        "baud": session.meter.baud,
    }


@contextmanager
def _end(
    agreement: Agreement, role: Role, folder: RunFolder
) -> Iterator[tuple[McapRecorder, StopFlag]]:
    path = folder.transmitter if role == "transmitter" else folder.receiver
    sys.setswitchinterval(SWITCH_INTERVAL_S)
    with StopFlag() as stop, open_recorder(agreement, role, path) as recorder:
        # Objects built so far stay; the collector need not scan them in flight.
        gc.collect()
        gc.freeze()
        yield recorder, stop


def _peer(run: TransmitterRun, link: Link, stop: Stop, recorder: McapRecorder) -> LinkPeer | None:
    """Return the receiver as a virtual flight steps it; None on a real clock."""
    if run.agreement.clock == "real":
        return None

    def meanwhile() -> None:
        run.node.flush_records()
        recorder.help_out()

    return LinkPeer(link, run.agreement.config.link.peer_timeout_s, stop, meanwhile)


def _guarded(fly: Callable[[], Outcome]) -> Outcome:
    """Fly; an exception becomes the outcome, so that recording and figures are kept."""
    try:
        return fly()
    except (Exception, KeyboardInterrupt) as error:
        return outcome_of(error)


def _with_recording(summary: Summary, recorder: McapRecorder) -> Summary:
    """Close the recording and add its outcome."""
    recorder.close()
    return summary | recording_part(recorder)
