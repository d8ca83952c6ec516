"""A flight that went to its end without flying: exit code, summary, and the message for a person."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from channel.protocol.wire import DATAGRAM
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.flight import transmit
from tenbaud.flight.outcome import ExitCode, NotFlown, Outcome
from tenbaud.flight.receive import ended_outcome
from tests.tenbaud.processes import run

NO_WORDS = "up:loss=0.95"


def outcomes(seconds: float, **changes: Any) -> tuple[Outcome, Outcome]:
    """Fly in memory; return the outcome of each end by itself."""
    agreement = agree(load_config("paper-10baud", None, {"duration_s": seconds, **changes}), "virtual")
    endpoint = build_receiver(agreement, None, DATAGRAM)
    run_ = transmit.prepare(agreement, None, DATAGRAM)
    upper = transmit.fly_virtual(run_, endpoint, lambda: False)
    return upper, ended_outcome(agreement, endpoint.session)


def test_when_a_flight_did_not_fly_then_exit_code_summary_and_message_say_so(tmp_path: Path) -> None:
    flight = ("--duration", "20", "--mismatch", "0.1", "--impair", NO_WORDS, "--out", "run")
    ended = run("demo", "--json", *flight, cwd=tmp_path)
    assert ended.code == ExitCode.NOT_FLOWN, ended.err
    assert ended.summary["exit_code"] == ExitCode.NOT_FLOWN
    assert ended.summary["not_flown"] == [NotFlown.NO_WORDS.value]
    assert "the flight did not fly (no words)" in ended.err
    assert "nearly all symbols are lost" in ended.err
    shown = run("demo", "--link", "memory", *flight[:-1], "two", cwd=tmp_path)
    assert shown.code == ExitCode.NOT_FLOWN
    assert shown.out.startswith("✗ Flight failed (exit code 7): no words\n")
    assert shown.out.count("did not fly") == 1
    assert "did not fly" not in shown.err


LAWS = """
class Failing:
    def __init__(self, context):
        pass
    def command(self, tick, state):
        if tick > 50:
            raise RuntimeError("no more")
        return (0.0, 0.0)
    def references(self, tick):
        return (None,)

class Nothing(Failing):
    def command(self, tick, state):
        return (0.0,)
"""


@pytest.mark.parametrize("link", ["memory", "zenoh"])
def test_a_controller_that_fails_in_flight_is_no_flight(tmp_path: Path, link: str) -> None:
    (tmp_path / "laws.py").write_text(LAWS)
    law = ("--set", "receiver.controller=laws:Failing")
    ended = run("demo", "--link", link, "--duration", "5", *law, "--out", "run", cwd=tmp_path)
    assert ended.code == ExitCode.NOT_FLOWN
    assert ended.out.startswith("✗ Flight failed (exit code 7): the controller failed\n")
    assert "no command from the controller at 449 ticks" in ended.out
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert (summary["exit_code"], summary["not_flown"]) == (7, ["the controller failed"])


def test_a_pendulum_that_fell_is_no_flight(tmp_path: Path) -> None:
    (tmp_path / "laws.py").write_text(LAWS)
    pendulum = ("--preset", "pendulum-20baud", "--set", "receiver.controller=laws:Nothing")
    flight = ("--link", "memory", "--duration", "10", "--out", "run")
    ended = run("demo", *pendulum, *flight, cwd=tmp_path)
    assert ended.code == ExitCode.NOT_FLOWN
    assert ended.out.startswith("✗ Flight failed (exit code 7): the plant fell\n")
    assert "the pendulum went beyond 90 degrees from upright: raise the rate" in ended.out


@pytest.mark.parametrize(("unit", "right_angle"), [("rad", math.pi / 2.0), ("deg", 90.0)])
def test_a_pendulum_falls_beyond_a_right_angle_in_its_own_unit(unit: str, right_angle: float) -> None:
    agreement = agree(load_config("pendulum-20baud", None, {}), "virtual")
    signals = agreement.signals
    outputs = (replace(signals.outputs[0], unit=unit),)
    terms = replace(agreement.terms, signals=replace(signals, outputs=outputs))
    flight = transmit.prepare(agreement, None, DATAGRAM)
    flight.agreement = replace(agreement, terms=terms)
    for angle, fell in ((0.99 * right_angle, False), (1.01 * right_angle, True)):
        flight.node.scores.outputs[-1].largest = angle
        assert transmit.flight_counts(flight).fell is fell


def test_when_each_end_is_asked_then_both_say_that_it_did_not_fly() -> None:
    upper, lower = outcomes(20.0, link={"impairments": NO_WORDS})
    assert upper.not_flown == lower.not_flown == (NotFlown.NO_WORDS,)
    assert upper.code is lower.code is ExitCode.NOT_FLOWN


def test_when_command_frames_are_lost_for_ever_then_rejoins_without_end_are_no_flight() -> None:
    upper, lower = outcomes(60.0, link={"impairments": "down:loss=0.6"})
    assert NotFlown.REJOINING in upper.not_flown
    assert NotFlown.REJOINING in lower.not_flown
    assert "gap" in upper.text


def test_when_half_the_symbols_are_lost_then_that_is_a_flight() -> None:
    assert [one.code for one in outcomes(60.0, link={"impairments": "up:loss=0.5"})] == [
        ExitCode.OK
    ] * 2
