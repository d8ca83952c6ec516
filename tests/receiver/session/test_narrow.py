"""The commander of the narrow downlink: what it asks a controller for; how it goes on after a pause."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import pytest

from channel.codec.codec import ERASED, Vector
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay
from channel.codec.downlink.mirrored import LEFT, MirroredLaw
from channel.protocol.events import Event, EventKind, Failing
from channel.protocol.frames import DownSymbol, Hello
from channel.protocol.recording import NullRecorder
from receiver.controllers.base import Controller
from receiver.session.asking import Asker
from receiver.session.narrow import NarrowCommander
from receiver.session.rejoin import LEAD_SAMPLES_MAX, Greeter
from tests.channel.codec.parts import terms
from tests.simulation.narrow import coded, mirrored
from tests.simulation.narrow_sessions import narrow_terms
from tests.simulation.test_narrow import DIRECTION

LAYOUT = Layout(2, 1, 4)


class Programme:
    """Set-points by tick; `wanted` None: none."""

    def __init__(self, wanted: float | None) -> None:
        self.wanted = wanted
        self.given: Any = None
        """in place of it, whatever it is"""
        self.asked: list[int] = []

    def command(self, tick: int, state: Vector) -> Vector:
        raise RuntimeError("no command today")

    def references(self, tick: int) -> tuple[float | None, ...]:
        self.asked.append(tick)
        return (self.wanted,) if self.given is None else self.given  # type: ignore[no-any-return]


def commander_of(
    machine: TwoWay, controller: Controller
) -> tuple[NarrowCommander, Counter[str], list[Event]]:
    counts: Counter[str] = Counter()
    events: list[Event] = []
    flight_terms = narrow_terms(machine, is_mirrored=isinstance(machine.scheme, MirroredLaw))
    asker = Asker(controller, 1, counts, events.append)
    return NarrowCommander(machine, flight_terms, asker, NullRecorder(), None), counts, events


def fly(commander: NarrowCommander, samples: int) -> list[DownSymbol]:
    sent = []
    for _ in range(samples):
        for frame in commander.fly((1,), 9, 3, 0):
            assert isinstance(frame, DownSymbol)
            sent.append(frame)
    return sent


def test_when_a_sample_is_flown_then_its_symbols_have_its_slots() -> None:
    commander, _, _ = commander_of(mirrored(LAYOUT, 15), Programme(1.0))
    commander.restart(7)
    sent = fly(commander, 3)
    assert [one.slot for one in sent] == [14, 15, 16, 17, 18, 19]
    assert {(one.session, one.epoch) for one in sent} == {(9, 3)}
    assert {one.number for one in sent} <= {0, 1}


def test_when_set_points_are_known_then_they_are_taken_a_queue_ahead() -> None:
    programme = Programme(1.0)
    commander, _, _ = commander_of(mirrored(LAYOUT, 15), programme)
    fly(commander, 1)
    assert programme.asked[0] == 15 * 10


def test_when_there_is_no_set_point_then_that_of_the_start_stays() -> None:
    commander, counts, _ = commander_of(mirrored(LAYOUT, 15), Programme(None))
    fly(commander, 30)
    assert commander.two_way_state.down[:2] == (0.0, 0.0)
    assert counts["bad_references"] == 0


@pytest.mark.parametrize("given", ["no number", [math.inf], 3.0])
def test_when_a_set_point_is_no_number_then_the_last_one_stays(given: object) -> None:
    programme = Programme(0.5)
    commander, counts, events = commander_of(mirrored(LAYOUT, 15), programme)
    fly(commander, 30)
    reached = commander.two_way_state.down[:1]
    programme.given = given
    fly(commander, 30)
    assert commander.two_way_state.down[:1] == reached
    assert counts["bad_references"] > 0
    assert [one.cause for one in events] == [Failing.REFERENCE]


def test_when_a_controller_fails_then_its_last_command_is_held_and_the_first_failure_reported() -> None:
    commander, counts, events = commander_of(coded(Layout(2), DIRECTION), Programme(None))
    fly(commander, 4)
    assert counts["bad_commands"] == 40
    assert [(event.kind, event.cause) for event in events] == [(EventKind.CONTROLLER, Failing.COMMAND)]
    assert "no command today" in commander.first_problem


def test_when_a_pause_falls_into_a_word_then_its_bits_are_sent_afterwards() -> None:
    machine = mirrored(LAYOUT, 0)
    commander, _, _ = commander_of(machine, Programme(1.25))
    fly(commander, 6)
    word = 2
    left = commander.two_way_state.down[word + LEFT]
    assert 0 < left < 9
    commander.carry_on(12, 0)
    assert commander.two_way_state.sample == 12
    assert commander.two_way_state.down[word + LEFT] == left
    fly(commander, 10)
    assert abs(commander.two_way_state.down[0] - 1.25) < 0.01


def test_when_a_pause_is_long_then_the_coder_begins_afresh_and_after_the_history_the_model_too() -> (
    None
):
    machine = mirrored(LAYOUT, 0)
    commander, _, _ = commander_of(machine, Programme(1.25))
    fly(commander, 20)
    stood = commander.standing
    commander.carry_on(30, 1)
    assert commander.state.coder == machine.codec.coder.initial()
    assert commander.state.model != machine.codec.model.initial()
    commander.go_back(stood)
    assert commander.standing == stood
    commander.carry_on(20 + 65, 0)
    assert commander.state == machine.codec.initial()._replace(sample=85)
    assert commander.two_way_state.hold == stood[2]
    assert machine.step(commander.two_way_state, ERASED, (0,)).state.sample == 86


@pytest.mark.parametrize("narrow", [True, False])
def test_when_a_request_is_repeated_although_it_was_answered_then_the_next_answer_begins_later(
    narrow: bool,
) -> None:
    greeter = Greeter(narrow_terms(mirrored(LAYOUT, 15), is_mirrored=True) if narrow else terms())
    hello = Hello(5, "1", b"", b"", request=1, sample=10)
    leads = [greeter.lead_samples(hello) for _ in range(6)]
    assert leads == ([0, 4, 12, 28, LEAD_SAMPLES_MAX, LEAD_SAMPLES_MAX] if narrow else [0] * 6)
    assert greeter.lead_samples(Hello(5, "1", b"", b"", request=2, sample=50)) == 0
