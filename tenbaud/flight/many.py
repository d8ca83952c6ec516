"""One receiver process for many rigs: sessions are opened as transmitters ask, and closed one by one.

Each flight has a run folder of its own, with configuration, recording and summary. All files are
written by a thread beside the loop; it hands over what is ready and rings.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from channel.errors import FrameError, LinkLost
from channel.line.virtual import Reply, decode_step, encode_reply, is_envelope
from channel.links.zenoh.hub import ZenohHub
from channel.protocol.endings import End, Ending
from channel.protocol.frames import Bye, Frame, Hello, Refuse, Symbol, Unknown
from channel.protocol.wire import DATAGRAM, decode, encode
from receiver.loops.many import SURPLUS, Served
from receiver.session.rejoin import difference
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import Agreement
from tenbaud.config.load import dump_config
from tenbaud.files.whole import WriteError, write_whole
from tenbaud.flight.ends import open_recorder
from tenbaud.flight.outcome import ExitCode, Outcome, outcome_of
from tenbaud.flight.rate_limited_log import RateLimitedLog
from tenbaud.flight.receive import ended_outcome
from tenbaud.flight.report import write_summary
from tenbaud.flight.summary import receiver_part, recording_part
from tenbaud.recording.folder import RunFolder, make_numbered
from tenbaud.recording.shared import SharedWriter
from tenbaud.recording.writer import McapRecorder
from tenbaud.sentences import endings
from tenbaud.sentences.flown import Summary

Log = Callable[[str], None]
AgreementOf = Callable[[str], Agreement]
"""Session name -> agreement of its flights; raises TenbaudError if there is none."""

LOGGED_MAX = 1000
"""Refusals remembered, so that repeated requests of a transmitter are logged once."""


@dataclass(slots=True)
class Flight:
    """One flight of one rig."""

    name: str
    agreement: Agreement
    folder: RunFolder
    recorder: McapRecorder


class ManyHost:
    """Opens and closes the services of `receiver.loops.many`; see the module's text.

    `root` is the folder for the run folders; at most `rigs_max` flights at a time.
    """

    def __init__(
        self, hub: ZenohHub, agreement_of: AgreementOf, root: Path, rigs_max: int, log: Log
    ) -> None:
        self._hub = hub
        self._agreement_of = agreement_of
        self._root = root
        self._rigs_max = rigs_max
        self._log = log
        self._log_refusal = RateLimitedLog(log)
        self._writer = SharedWriter()
        self._worker = ThreadPoolExecutor(1, "files")
        self._ready: deque[tuple[str, Served]] = deque()
        self._opening: set[str] = set()
        self._open: dict[str, Flight] = {}
        self._refused: deque[tuple[str, int]] = deque(maxlen=LOGGED_MAX)
        self._unexplained: set[str] = set()
        """names refused whose transmitters have not said yet how they see it"""
        self.summaries: list[Summary] = []
        """of the flights that have ended"""
        self.counts: Counter[str] = Counter()
        """flights, refused, strays (messages of no flight), messages_dropped, not_written"""

    # In the loop's thread

    def on_unserved(self, name: str, data: bytes) -> list[bytes]:
        """Take a message of a session that has no service; return the answers.

        A request for a session opens one. A symbol is answered as a restarted receiver does, so that
        its transmitter asks.
        """
        if name in self._opening:
            return []
        try:
            frame, number = _opened(data)
        except FrameError:
            frame, number = None, None
        answer: Frame | None = None
        match frame:
            case Hello() if len(self._open.keys() | self._opening) >= self._rigs_max:
                text = f"this receiver serves {self._rigs_max} rigs already, which is its limit"
                answer = self._refusal(name, frame, End(Ending.FULL, text), "")
            case Hello():
                self._opening.add(name)
                self._worker.submit(self._begin, name, frame, data, number)
                return []
            case Symbol():
                answer = Unknown(frame.session, frame.epoch)
            case Bye() if frame.session == 0 and name in self._unexplained:
                # Once per refusal: a line on a terminal takes the loop's time.
                self._unexplained.discard(name)
                self._log_refusal(f"{name}: as its transmitter sees it: {frame.text}")
            case _:
                self.counts["strays"] += 1
        if answer is None:
            # A step of the virtual clock waits for its reply, even if nothing is to be said.
            return [] if number is None else [encode_reply(Reply(number, None, ()))]
        return [_closed(answer, number)]

    def ready(self) -> Iterable[tuple[str, Served]]:
        while self._ready:
            name, served = self._ready.popleft()
            self._opening.discard(name)
            yield name, served

    def ended(self, served: Served, error: Exception | None) -> None:
        """End a flight: tell its transmitter now, and have its files finished."""
        ending = Ending.STOPPED if error is None else Ending.FAILED
        if isinstance(error, LinkLost):
            ending = Ending.LINK_LOST
        try:
            for message in served.endpoint.bye(End(ending)):
                self._hub.send(served.name, message)
            served.endpoint.session.flush_records()
        except Exception as problem:  # what has ended it may stand in the way of a farewell too
            error = error or problem
        self.counts["messages_dropped"] += served.dropped
        flight = self._open[served.name]
        flight.recorder.finish_soon()
        # Until its files are finished the name stays taken, and a new flight waits.
        self._opening.add(served.name)
        self._worker.submit(self._finish, flight, served, error)

    def close(self) -> None:
        """Wait until all files are finished; for after the loop."""
        self._worker.shutdown()
        # Opened when the loop had ended already: nobody flew it, but its file is there.
        for name, served in self.ready():
            served.endpoint.bye(End(Ending.STOPPED))
            self._finish(self._open[name], served, None)
        self._writer.close()
        self._log_refusal.finish()

    # In the worker's thread

    def _begin(self, name: str, hello: Hello, data: bytes, number: int | None) -> None:
        try:
            agreement = self._agreement_of(name)
            problem = difference(hello, agreement.identity)
            if problem is not None:
                refusal = End(Ending.MISMATCH, problem)
                self._turn_away(name, hello, refusal, agreement.identity.config, number)
                return
            self._ready.append((name, self._serve(name, agreement, data)))
        except Exception as error:  # whatever it is, it concerns this session alone
            text = outcome_of(error).text
            refusal = End(Ending.CANNOT_SERVE, f"the receiver cannot serve {name}: {text}")
            self._turn_away(name, hello, refusal, "", number)
        self._hub.wake()

    def _turn_away(
        self, name: str, hello: Hello, refusal: End, config: str, number: int | None
    ) -> None:
        self._hub.send(name, _closed(self._refusal(name, hello, refusal, config), number))
        self._opening.discard(name)

    def _refusal(self, name: str, hello: Hello, refusal: End, config: str) -> Refuse:
        if (name, hello.incarnation) not in self._refused:
            self._refused.append((name, hello.incarnation))
            if len(self._unexplained) < LOGGED_MAX:
                self._unexplained.add(name)
            self.counts["refused"] += 1
            self._log_refusal(f"{name}: refused: {refusal.text}")
        return Refuse(hello.incarnation, refusal.ending, refusal.text, config)

    def _serve(self, name: str, agreement: Agreement, data: bytes) -> Served:
        folder = RunFolder(make_numbered(self._root / name.replace("/", "-")))
        link = agreement.config.link.model_copy(update={"session": name})
        write_whole(folder.config, dump_config(agreement.config.model_copy(update={"link": link})))
        recorder = open_recorder(agreement, "receiver", folder.receiver, self._writer)
        try:
            endpoint = build_receiver(agreement, recorder, DATAGRAM)
            self._hub.join(name)
        except BaseException:
            recorder.finish_soon()
            raise
        self._open[name] = Flight(name, agreement, folder, recorder)
        self.counts["flights"] += 1
        self._log(f"{name}: a flight begins, recording into {folder.path}")
        symbols_per_s = 1e9 * agreement.terms.symbols_per_word / agreement.terms.sample_ns
        allowed_per_s = SURPLUS * symbols_per_s if agreement.clock == "real" else None
        return Served(name, endpoint, link.peer_timeout_s, allowed_per_s, data)

    def _finish(self, flight: Flight, served: Served, error: Exception | None) -> None:
        summary: Summary = {}
        try:
            endpoint = served.endpoint
            outcome = _outcome(flight.agreement, served, error)
            flight.recorder.close()
            summary = {
                "session": flight.name,
                "folder": str(flight.folder.path),
                **receiver_part(flight.agreement, endpoint, outcome),
                "messages_dropped": served.dropped,
                **recording_part(flight.recorder),
            }
            if flight.recorder.error is not None:
                self.counts["not_written"] += 1
                self._log(f"{flight.name}: {flight.recorder.error}")
            write_summary(flight.folder, summary)
            self._log(f"{flight.name}: ended after {summary['samples']} samples: {outcome.text}")
        except WriteError as problem:
            self.counts["not_written"] += 1
            self._log(f"{flight.name}: {problem}")
        finally:
            self._open.pop(flight.name, None)
            self._hub.leave(flight.name)
            self._opening.discard(flight.name)
            # Last: who sees the flight ended may count on its place being free.
            if summary:
                self.summaries.append(summary)


def _outcome(agreement: Agreement, served: Served, error: Exception | None) -> Outcome:
    session = served.endpoint.session
    if error is not None:
        return outcome_of(error)
    end = session.end
    if end is not None and end.ending is Ending.STOPPED and not end.by_peer:
        return Outcome(ExitCode.INTERRUPTED, endings.end_text(end, "transmitter"))
    return ended_outcome(agreement, session)


def _opened(data: bytes) -> tuple[Frame | None, int | None]:
    """Return the frame of a message, and the number of the step that it came in, if in one."""
    if not is_envelope(data):
        return decode(data), None
    step = decode_step(data)
    return (None if step.data is None else decode(step.data)), step.number


def _closed(frame: Frame, number: int | None) -> bytes:
    """Return the message that answers with a frame: by itself, or as the reply to a step."""
    message = encode(frame)
    return message if number is None else encode_reply(Reply(number, None, (message,)))
