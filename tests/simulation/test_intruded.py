"""Random flights in company: second receivers, recordings played back, forged frames."""

from __future__ import annotations

from dataclasses import replace

import pytest

from channel.line.impairments import Impairments
from channel.protocol.events import EventKind
from channel.protocol.frames import Symbol
from channel.protocol.wire import encode
from tests.simulation.faults import Plan
from tests.simulation.forgeries import quiet_plan
from tests.simulation.intruded import IntrudedWorld, Intrusion, draw_intrusion
from tests.simulation.soak import fly_intruded_seed

SEEDS, FLOWN = 16, (1, 2, 5)
"""`make soak` flies the others, and random ones. Those flown here have forged frames and a second
receiver; in two a recording is played back, in one the transmitter is killed."""
SECOND = 1_000_000_000


@pytest.mark.parametrize(
    "seed", [pytest.param(one, marks=() if one in FLOWN else pytest.mark.soak) for one in range(SEEDS)]
)
def test_when_everything_goes_wrong_in_company_then_nothing_is_unsafe_and_it_comes_back(
    seed: int,
) -> None:
    result = fly_intruded_seed(seed)
    assert result.problem is None, result.problem
    assert result.desyncs_missed == 0


def test_when_seeds_are_drawn_then_they_meet_every_kind_of_company() -> None:
    drawn = [draw_intrusion(seed) for seed in range(SEEDS)]
    assert {len(one.seconds) for one in drawn} == {0, 1, 2}
    assert len({one.rate_hz for one in drawn}) == 5
    assert {one.replayed_share for one in drawn} == {0.0, 0.5, 1.0}


def shorter() -> Plan:
    return replace(quiet_plan(3), faulty_s=10.0)


def test_when_a_second_receiver_comes_to_a_healthy_flight_then_it_is_refused_for_nothing() -> None:
    world = IntrudedWorld(shorter(), Intrusion(seconds=((2 * SECOND, 8 * SECOND),))).fly()
    assert world.node is not None
    session = world.node.session
    assert world.faults["second receivers"] == 1
    assert session.counts["claims_refused"] == 1
    assert session.counts["rejoins"] == world.watch.desyncs_raised == 0


def test_when_a_flight_is_played_back_into_itself_then_it_does_not_rejoin() -> None:
    world = IntrudedWorld(shorter(), Intrusion(rate_hz=100.0, replayed_share=1.0)).fly()
    assert world.node is not None
    assert world.intruder.counts["replayed"] > 500
    assert world.watch.rejoins == world.watch.desyncs_raised == 0
    assert world.node.session.counts["stale_frames"] > 100


def test_when_one_forged_symbol_comes_early_then_the_flight_keeps_its_schedule() -> None:
    plan = replace(shorter(), up=Impairments(), down=Impairments())
    world = IntrudedWorld(plan, Intrusion())
    taken: list[int] = []

    def forge() -> None:
        assert world.endpoint is not None
        receiver = world.endpoint.session
        for ahead in (3, 60):
            slot = receiver.state.sample + ahead
            world._receive(encode(Symbol(receiver.session_number, receiver.epoch, slot, 1)))
        taken.append(receiver.state.sample)

    world.at(5 * SECOND, forge)
    world.fly()
    assert world.endpoint is not None
    receiver = world.endpoint.session
    assert taken
    assert receiver.counts["erasures"] <= 4
    assert receiver.counts["out_of_bounds"] == 1
    assert receiver.counts["rejoins"] == 0
    assert [e.kind for e in receiver.events].count(EventKind.STALE) == 1
