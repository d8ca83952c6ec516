"""Who may command this transmitter's motors: the receiver of its flight, and nobody's recording."""

from __future__ import annotations

import pytest

from channel.protocol.endings import Ending
from channel.protocol.events import EventKind
from channel.protocol.frames import (
    Bye,
    Claim,
    Commands,
    Echo,
    Frame,
    Hello,
    Refuse,
    Unknown,
    Welcome,
    Why,
)
from tests.transmitter.test_node import ScriptedRig, fly_sample, node_with
from transmitter.endpoint import TransmitterNode
from transmitter.guard import Guard, GuardSettings, GuardState
from transmitter.session.session import Phase
from transmitter.session.takeover import ALIVE_COMMANDS, SUCCESSOR_SAMPLES

SESSION, OTHER = 77, 99


def flying(samples: int = 5) -> TransmitterNode:
    node = node_with(ScriptedRig(ticks=2000))
    for sample in range(samples):
        fly_sample(node, sample)
    return node


def request_of(frames: list[Frame]) -> Hello:
    (hello,) = [frame for frame in frames if isinstance(frame, Hello)]
    return hello


# A second receiver


def test_when_a_second_receiver_asks_then_it_is_refused_and_reported_and_the_flight_goes_on() -> None:
    node = flying()
    answers: list[Frame] = []
    for sample in range(5, 5 + ALIVE_COMMANDS + 2):
        answers += node.deliver(Unknown(SESSION, 0))
        assert fly_sample(node, sample) == 1
    (bye,) = answers
    assert isinstance(bye, Bye)
    assert bye.session == 0
    assert bye.ending is Ending.SECOND_RECEIVER
    assert node.session.phase is Phase.FLYING
    assert node.session.counts["rejoins"] == 0
    assert node.session.counts["claims_refused"] == 1
    assert [event.kind for event in node.session.events].count(EventKind.REFUSED) == 1


def test_when_a_second_receiver_welcomes_then_its_answer_is_nobodys() -> None:
    node = flying()
    assert node.deliver(Welcome(OTHER, 5, 9, 5)) == []
    assert node.session.session_number == SESSION


def test_when_commands_have_stopped_then_a_receiver_that_was_started_again_is_accepted() -> None:
    node = flying()
    for tick in range(50, 70):
        node.measure(tick)
        node.actuate(tick)
    hello = request_of(node.deliver(Unknown(SESSION, 0)))
    assert hello.why is Why.UNKNOWN
    assert node.session.phase is Phase.REJOINING


@pytest.mark.parametrize("frame", [Unknown(OTHER, 0), Unknown(SESSION, 1), Claim(OTHER, 0, OTHER)])
def test_when_the_session_or_epoch_is_another_then_nothing_happens(frame: Frame) -> None:
    node = flying()
    for tick in range(50, 90):
        node.measure(tick)
        node.actuate(tick)
    assert node.deliver(frame) == []
    assert node.session.phase is Phase.FLYING
    assert node.session.counts["stale_frames"] == 1


# Taking over on purpose


def test_when_a_receiver_takes_over_then_only_its_answer_counts_and_the_old_one_is_informed() -> None:
    node = flying()
    hello = request_of(node.deliver(Claim(SESSION, 0, OTHER)))
    assert hello.why is Why.TAKEN_OVER
    # The present receiver answers too, and first; it is the past one now.
    assert node.deliver(Welcome(SESSION, 1, 8, 5, hello.request)) == []
    assert node.session.phase is Phase.REJOINING
    (bye,) = node.deliver(Welcome(OTHER, 0, 8, 5, hello.request))
    assert bye == Bye(SESSION, Ending.TAKEN_OVER)
    assert node.session.session_number == OTHER
    assert node.session.phase is Phase.FLYING
    assert node.session.counts["take_overs"] == 1


def test_when_the_new_receiver_refuses_then_the_old_one_goes_on() -> None:
    node = flying()
    hello = request_of(node.deliver(Claim(SESSION, 0, OTHER)))
    assert node.deliver(Refuse(5, Ending.MISMATCH, "another configuration", "")) == []
    assert node.session.phase is Phase.REJOINING
    assert node.deliver(Welcome(SESSION, 1, 8, 5, hello.request)) == []
    assert (node.session.session_number, node.session.epoch) == (SESSION, 1)
    assert node.session.phase is Phase.FLYING
    assert node.session.counts["take_overs"] == 0


def test_when_the_new_receiver_never_answers_then_the_old_one_goes_on() -> None:
    node = flying()
    node.guard = Guard(node.session.terms.limits, GuardSettings(50, 10, (0.0, 0.0), (1.0,)))
    node.guard.apply(49, (2.0, -2.0))
    hello = request_of(node.deliver(Claim(SESSION, 0, OTHER)))
    old = Welcome(SESSION, 1, 10, 5, hello.request)
    last = 49 + 10 * SUCCESSOR_SAMPLES + node.session.terms.lead_ticks
    for tick in range(50, last):
        node.measure(tick)
        node.actuate(tick)
    assert node.deliver(old) == []
    assert node.session.phase is Phase.REJOINING
    node.measure(last)
    node.deliver(old)
    assert (node.session.session_number, node.session.epoch) == (SESSION, 1)
    assert node.session.phase is Phase.FLYING
    assert not node.guard.stopped


# A recorded stream of commands


def recorded(samples: int) -> list[Commands]:
    """Return what an honest receiver sent, as somebody who listens would have it."""
    node = node_with(ScriptedRig(ticks=2000))
    heard: list[Commands] = []
    deliver = node.deliver

    def listening(frame: Frame) -> list[Frame]:
        if isinstance(frame, Commands):
            heard.append(frame)
        return deliver(frame)

    node.deliver = listening  # type: ignore[method-assign]
    for sample in range(samples):
        fly_sample(node, sample)
    return heard


def latched_at(replayed: list[Commands]) -> int:
    """Return the tick at which the guard gives up after the receiver died, with a recording playing."""
    node = flying(10)
    for tick in range(100, 300):
        node.measure(tick)
        for frame in replayed:
            node.deliver(frame)
        node.actuate(tick)
        if node.guard.state is GuardState.LATCHED:
            assert node.session.counts["stale_frames"] == (tick - 99) * len(replayed)
            return tick
    raise AssertionError("the watchdog was fed")


def test_when_commands_are_played_back_then_the_watchdog_is_not_fed() -> None:
    assert latched_at(recorded(10)) == latched_at([]) < 200


def test_when_commands_are_played_back_then_they_do_not_prove_the_receiver_alive() -> None:
    node = flying(10)
    heard = node.session.heard_tick
    for frame in recorded(10):
        assert node.deliver(frame) == []
    assert node.session.heard_tick == heard
    assert node.session.counts["stale_frames"] == 10


def test_when_another_flights_commands_are_played_back_then_nothing_moves() -> None:
    node = flying(10)
    state = node.session.confirmed_state
    echo = Echo(10, 1, 123, (5000, -5000) * 10)
    for frame in (Commands(OTHER, 0, (echo,)), Commands(SESSION, 7, (echo,))):
        assert node.deliver(frame) == []
    assert node.session.confirmed_state == state
    assert node.session.command(110) is None
    assert node.session.counts["stale_frames"] == 2
