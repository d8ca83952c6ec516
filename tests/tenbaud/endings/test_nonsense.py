"""No program reads a sentence: with nonsense in place of each, everything else is as it was."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest

from channel.errors import TenbaudError
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye
from channel.protocol.wire import DATAGRAM
from tenbaud.audit.audit import audit
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import Agreement, agree
from tenbaud.build.transmitter_run import TransmitterRun
from tenbaud.config.load import load_config
from tenbaud.flight import receive, transmit
from tenbaud.flight.demo import fly_demo
from tenbaud.flight.outcome import ExitCode, Outcome, outcome_of
from tenbaud.flight.summary import receiver_part, transmitter_part
from tenbaud.recording.folder import RunFolder
from tenbaud.recording.run import Run
from tenbaud.telemetry.compose import TransmitterComposer
from tenbaud.telemetry.live import LiveTransmitter
from tenbaud.telemetry.tap import Tap
from tenbaud.view.board import Board
from tests.tenbaud.endings import nonsense
from tests.tenbaud.processes import REPOSITORY, fly_pair

CORRUPTED = {"receiver": {"sabotage": "sample=20,field=range"}}
SCENARIOS: dict[str, tuple[ExitCode, dict[str, Any]]] = {
    "over": (ExitCode.OK, {}),
    "stopped": (ExitCode.INTERRUPTED, {}),
    "refused": (ExitCode.MISMATCH, {}),
    "desync": (ExitCode.DESYNC, {"transmitter": {"on_desync": "stop"}}),
    "rejoin": (ExitCode.OK, {"transmitter": {"sabotage": "sample=20,field=range"}}),
    "link lost": (ExitCode.LINK_LOST, {}),
    "safety stop": (ExitCode.SAFETY_STOP, {"transmitter": {"soft_limits": 0.2}}),
    "not flown": (ExitCode.NOT_FLOWN, {"link": {"impairments": "up:loss=0.98"}}),
}
SENTENCES = ("text", "outcome", "detail", "sensor_fault")
OTHERS = ("wire_bytes_up", "wire_bytes_down", "session", "flight", "realtime_factor")
"""Not compared either: bytes of farewells with their texts, numbers drawn anew, a speed."""
LEFT_OUT = SENTENCES + OTHERS


def agreement_of(changes: dict[str, Any]) -> Agreement:
    return agree(load_config("paper-10baud", None, {"duration_s": 6.0, **changes}), "virtual")


class Nothing:
    """A recorder that keeps nothing."""

    def write(self, *_: object) -> None:
        """Forget the row."""


def fly(scenario: str) -> dict[str, Any]:
    """Fly; return all that programs go by, without what is for people."""
    _, changes = SCENARIOS[scenario]
    agreement = agreement_of(changes)
    theirs = agreement_of(CORRUPTED if scenario == "desync" else {})
    if scenario == "refused":
        theirs = agreement_of({"coder": {"window_signs": 3}})
    tap = Tap(Nothing())
    run = transmit.prepare(agreement, tap, DATAGRAM)
    endpoint = build_receiver(theirs, None, DATAGRAM)
    try:
        outcome = transmit.fly_virtual(run, endpoint, lambda: at_tick(scenario, run))
    except TenbaudError as error:
        outcome = outcome_of(error)
    answer = receiver_outcome(theirs, endpoint)
    board = Board()
    live = LiveTransmitter(run, None, lambda: False)
    message = TransmitterComposer(run, tap, live).compose()
    board.take([json.dumps(message).encode()], 0.0)
    return without_sentences(
        {
            "codes": [int(outcome.code), int(answer.code)],
            "not flown": outcome.not_flown,
            "transmitter": transmitter_part(run, outcome),
            "receiver": receiver_part(theirs, endpoint, answer),
            "page": [json.loads(data) for data in board.since(0)[1]],
        }
    )


def at_tick(scenario: str, run: TransmitterRun) -> bool:
    """Return whether the flight is to be stopped; end it from the other side where that is asked."""
    if scenario == "link lost" and run.node.tick == 150:
        run.node.deliver(Bye(run.node.session.session_number, Ending.FAILED, "for people"))
    return scenario == "stopped" and run.node.tick >= 150


def receiver_outcome(agreement: Agreement, endpoint: Any) -> Outcome:
    if endpoint.session.refusal is not None:
        return Outcome(ExitCode.MISMATCH, "refused")
    return receive.ended_outcome(agreement, endpoint.session)


def without_sentences(value: Any) -> Any:
    """Return the same without the fields that are for people."""
    if isinstance(value, dict):
        return {name: without_sentences(one) for name, one in value.items() if name not in LEFT_OUT}
    return [without_sentences(one) for one in value] if isinstance(value, list | tuple) else value


@pytest.mark.parametrize("scenario", SCENARIOS)
def test_when_every_sentence_is_nonsense_then_codes_summaries_and_page_are_as_before(
    scenario: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = fly(scenario)
    nonsense.replace(monkeypatch.setattr)
    assert fly(scenario) == before
    assert before["codes"][0] == SCENARIOS[scenario][0]
    assert before["page"][0]["heads"]["transmitter"]["phase"] in ("greeting", "ended")


@pytest.mark.parametrize("scenario", ["over", "rejoin", "safety stop"])
def test_when_every_sentence_is_nonsense_then_the_audit_is_as_before(
    scenario: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def audited(folder: Path) -> tuple[object, ...]:
        folder.mkdir()
        agreement = agreement_of({**SCENARIOS[scenario][1], "link": {"kind": "memory"}})
        fly_demo(agreement, RunFolder(folder), lambda _: None, draw=False)
        result = audit(folder)
        events = without_sentences(Run(folder).events)
        return result.passed, result.leaks, result.gaps, asdict(result.counted), events

    before = audited(tmp_path / "before")
    nonsense.replace(monkeypatch.setattr)
    after = audited(tmp_path / "after")
    assert after == before
    assert Run(tmp_path / "after").events[0]["text"] == nonsense.NONSENSE


@pytest.mark.parametrize(
    "scenario", ["over", "desync", pytest.param("refused", marks=pytest.mark.soak)]
)
def test_when_two_processes_say_nothing_but_nonsense_then_their_exit_codes_are_as_before(
    scenario: str, tmp_path: Path
) -> None:
    options = {
        "over": ([], []),
        "desync": (["--on-desync", "stop"], ["--sabotage", "sample=20,field=range"]),
        "refused": ([], ["--set", "coder.window_signs=3"]),
    }
    up, down = options[scenario]
    environment = nonsense.environment(tmp_path / "site")
    upper, lower = fly_pair(
        tmp_path,
        *("--clock", "virtual"),
        transmitter={
            "arguments": ["--duration", "5", *up],
            "environment": environment,
        },
        receiver={"arguments": down, "environment": environment},
    )
    expected = SCENARIOS[scenario][0]
    assert (upper.code, lower.code) == (expected, expected), upper.err + lower.err
    assert expected is ExitCode.OK or nonsense.NONSENSE in upper.err


def test_the_page_reads_no_sentence() -> None:
    for script in (REPOSITORY / "tenbaud/view/static").glob("*.js"):
        source = script.read_text(encoding="utf-8").replace('parts.split(" ")', "")  # of a picture
        for reading in (".match(", "startsWith(", ".split(", "text ===", "text.includes"):
            assert reading not in source, script.name
