"""Both ends on this machine: two processes of the same command.

Zenoh on loopback joins them, or another configured kind of link.
"""

from __future__ import annotations

import json
import signal
import subprocess
import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import IO

from channel.links.base import Role
from channel.links.kind import Meeting
from tenbaud.build.flight import Agreement
from tenbaud.config.load import dump_config, flattened
from tenbaud.files.whole import write_whole
from tenbaud.flight.drawing import NotebookDrawing
from tenbaud.flight.ends import run_in_memory
from tenbaud.flight.lifeline import end_child, interrupt_child, start_child
from tenbaud.flight.outcome import ExitCode, Outcome, first_code, outcome_of_status
from tenbaud.flight.report import write_up
from tenbaud.flight.status import Status, StatusMode
from tenbaud.flight.stop import StopFlag
from tenbaud.flight.summary import joined
from tenbaud.flight.viewing import ViewOptions, Views, page_beside, words_of
from tenbaud.recording.folder import RunFolder
from tenbaud.sentences.flown import Summary

OnStatus = Callable[[Status], None]
ENDING_TIMEOUT_S = 15.0


@dataclass(slots=True)
class DemoResult:
    """The reports of both processes."""

    summary: Summary
    code: ExitCode
    messages: list[str]
    """the last lines of the two ends, if they were not a plain success"""


def fly_demo(
    agreement: Agreement,
    folder: RunFolder,
    on_status: OnStatus,
    *,
    draw: bool = True,
    view: ViewOptions | None = None,
    pace: float | None = None,
    status: StatusMode = "auto",
    compare: bool = False,
    drawing: NotebookDrawing | None = None,
) -> DemoResult:
    """Fly once into an existing, empty run folder; write summary and, if wished, figure there.

    `view`: serve the live page beside the flight, which may then be steered from it. `pace`: on the
    virtual clock, at most this factor of real time. `status`: what a
    flight within this process writes on the standard error. `compare`: fly the usual loop beside it,
    where there is one. `drawing` shows a flight within this process.
    """
    write_whole(folder.config, dump_config(agreement.config))
    with StopFlag() as stop, page_beside(view, stop, pace) as views:
        if agreement.link.in_process:
            flown = replace(agreement, live=view is not None)
            outcome, upper, lower = run_in_memory(flown, folder, status, views, drawing)
            messages = [] if outcome.code is ExitCode.OK else [outcome.text]
            result = DemoResult(joined(upper, lower), outcome.code, messages)
        else:
            result = _fly_processes(agreement, folder, on_status, views, stop)
    on_status({"role": "run", "phase": "writing its results"})
    usual = None
    if compare and result.code is ExitCode.OK and view is None:
        from tenbaud.flight.usual import usual_flight

        usual = usual_flight(agreement)
        result.summary |= {"usual_loop": usual.figures} if usual else {}
    draw = draw and result.summary.get("samples", 0) > 0
    problems = write_up(folder, agreement.config, result.summary, draw, usual and usual.curve)
    # The cause of the end comes last.
    result.messages[:0] = [problem.text for problem in problems]
    result.code = first_code(result.code, *(problem.code for problem in problems))
    return result


def _fly_processes(
    agreement: Agreement, folder: RunFolder, on_status: OnStatus, views: Views, stop: StopFlag
) -> DemoResult:
    with agreement.link.meeting(agreement.config.link) as meetings:
        up = _words(meetings[0]) + words_of("transmitter", views["transmitter"])
        down = _words(meetings[1]) + words_of("receiver", views["receiver"])
        receiver = _Child("receiver", agreement, folder, down, on_status)
        transmitter = _Child("transmitter", agreement, folder, up, on_status)
        ends = (transmitter, receiver)
        try:
            _wait(ends, stop)
        finally:
            for end in ends:
                end.end()
    if not transmitter.summary and not receiver.summary and stop():
        # Ctrl-C came before the flight had begun, and there is nothing to sum up.
        raise KeyboardInterrupt
    return _result(agreement, transmitter, receiver)


def _result(agreement: Agreement, transmitter: _Child, receiver: _Child) -> DemoResult:
    """Return the lines of both, the first cause of the end last."""
    ends = [transmitter, receiver]
    # Whoever was killed comes first: the other one only noticed.
    ends.sort(key=lambda end: end.process.returncode >= 0)
    ends = [end for end in ends if not end.dismissed]
    outcomes = [outcome for end in ends if (outcome := end.outcome()).code is not ExitCode.OK]
    config = agreement.config
    known: Summary = {"preset": config.preset, "link": config.link.kind, "clock": agreement.clock}
    summary = known | joined(transmitter.summary, receiver.summary)
    if not outcomes:
        return DemoResult(summary, ExitCode.OK, [])
    code = first_code(*(end.outcome().code for end in ends if end.process.returncode > 0))
    code = first_code(code, outcomes[0].code)
    was_killed = ends[0].process.returncode < 0 and not ends[0].died_of_interrupt
    if was_killed or not summary.get("exit_code"):
        summary["outcome"], summary["exit_code"] = outcomes[0].text, int(code)
        for own in [end.summary for end in ends if end.summary.get("not_flown")]:
            summary |= {name: own[name] for name in ("outcome", "not_flown")}
    return DemoResult(summary, code, [outcome.text for outcome in reversed(outcomes)])


def _words(meeting: Meeting) -> list[str]:
    """Return the options of one end that say where it meets the other."""
    words = []
    for name, value in flattened(meeting.settings, "link."):
        words += ["--set", f"{name}={json.dumps(value)}"]
    for option, endpoint in (("--listen", meeting.listen), ("--connect", meeting.connect)):
        words += [option, endpoint] if endpoint else []
    return words


def _wait(ends: tuple[_Child, _Child], stop: StopFlag) -> None:
    """Wait for both processes; pass a signal on, and do not outlive a half-dead pair."""
    passed_on = False
    patience_s = ENDING_TIMEOUT_S
    while any(end.process.poll() is None for end in ends):
        for end in ends:
            try:
                end.process.wait(0.1)
            except subprocess.TimeoutExpired:
                continue
        if stop() and not passed_on:
            passed_on = True
            # Where the transmitter owns the time it also ends the receiver's part, by its farewell.
            own_time = ends[0].agreement.clock == "virtual"
            for end in ends[:1] if own_time else ends:
                end.interrupt()
        if passed_on and ends[0].died_of_interrupt:
            # It had not begun, and says no farewell.
            ends[1].interrupt()
        for end, other in (ends, ends[::-1]):
            if end.process.poll() not in (None, 0) and not end.flew:
                other.dismiss()
        if passed_on or any(end.process.poll() is not None for end in ends):
            patience_s -= 0.1
            if patience_s < 0.0:
                return


@dataclass(slots=True)
class _Child:
    """One end as a separate process; its two pipes are read by two threads."""

    role: Role
    agreement: Agreement
    folder: RunFolder
    link: list[str]
    on_status: OnStatus
    process: subprocess.Popen[str] = field(init=False)
    summary: Summary = field(init=False, default_factory=dict)
    said: list[str] = field(init=False, default_factory=list)
    _threads: list[threading.Thread] = field(init=False, default_factory=list)
    _interrupted: bool = field(init=False, default=False)
    _begun: bool = field(init=False, default=False)
    dismissed: bool = field(init=False, default=False)
    """it waited for the other end, which could not fly"""

    def __post_init__(self) -> None:
        verb = "transmit" if self.role == "transmitter" else "receive"
        folder: Path = self.folder.path
        words = [verb, "--json", "--status", "lines", "--clock", self.agreement.clock, *self.link]
        words += ["--config", str(self.folder.config), "--run-folder", str(folder)]
        if self.role == "transmitter":
            # Whoever flies both ends has checked the rig, and asked.
            words += ["--accept-risk", "--yes"]
        self.process = start_child(*words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        for target, stream in (
            (self._read_summary, self.process.stdout),
            (self._read_status, self.process.stderr),
        ):
            thread = threading.Thread(target=target, args=(stream,), daemon=True)
            thread.start()
            self._threads.append(thread)

    def _read_summary(self, stream: IO[str]) -> None:
        text = stream.read()
        if text.strip():
            self.summary = json.loads(text)

    def _read_status(self, stream: IO[str]) -> None:
        for line in stream:
            if line.startswith("{"):
                status = json.loads(line)
                self._begun = self._begun or status["phase"] not in ("greeting", "waiting")
                self.on_status(status)
            elif line.strip():
                self.said.append(line.rstrip())

    def interrupt(self) -> None:
        """Have the process end, once; one that has ended is left alone."""
        if not self._interrupted and self.process.poll() is None:
            self._interrupted = True
            interrupt_child(self.process)

    def dismiss(self) -> None:
        """Have the process end if it has no session yet: it has no other end to fly with."""
        if not self._begun and self.process.poll() is None:
            self.dismissed = True
            self.interrupt()

    @property
    def flew(self) -> bool:
        """Return whether the process, which has ended, flew with the other one, by its summary.

        A status is too seldom to tell of a short flight.
        """
        self._read_out()
        return bool(self.summary.get("samples"))

    @property
    def died_of_interrupt(self) -> bool:
        """Return whether the interrupt came before the process could take it, in its first moments."""
        return self._interrupted and self.process.poll() == -signal.SIGINT

    def end(self) -> None:
        """Make sure that the process has ended, and read its output."""
        end_child(self.process, 5.0)
        self._read_out()

    def _read_out(self) -> None:
        for thread in self._threads:
            thread.join(5.0)

    def outcome(self) -> Outcome:
        """Return how the process ended, once it has."""
        if self.died_of_interrupt:
            return Outcome(ExitCode.INTERRUPTED, "interrupted")
        return outcome_of_status(self.role, self.process.returncode, "\n  ".join(self.said[-6:]))
