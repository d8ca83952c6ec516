"""Whole flights with the narrow downlink under everything that can go wrong, one seed each."""

from __future__ import annotations

from dataclasses import replace

import pytest

from channel.line.impairments import Impairments
from channel.protocol.frames import Why
from channel.protocol.sabotage import Sabotage
from tests.simulation.faults import Plan, draw
from tests.simulation.narrow_world import NarrowWorld, narrowed
from tests.simulation.test_world import plan_of

S = 1_000_000_000
SEEDS = (4, 11)
"""The receiver is killed twice, with fifteen rejoins; it is corrupted, and its clock jumps."""
MORE_SEEDS = 40


def clean() -> Plan:
    return plan_of(up=Impairments(), down=Impairments())


@pytest.mark.parametrize(
    "seed",
    [pytest.param(seed, marks=() if seed in SEEDS else pytest.mark.soak) for seed in range(MORE_SEEDS)],
)
def test_when_everything_goes_wrong_then_nothing_wrong_is_confirmed_and_it_comes_back(
    seed: int,
) -> None:
    world = NarrowWorld(narrowed(draw(seed))).fly()
    assert world.watch.desyncs_missed == 0
    assert world.watch.samples > 200


def test_when_the_receiver_is_restarted_then_the_flight_goes_on_in_its_new_session() -> None:
    plan = replace(clean(), restarts=((9 * S, "receiver"),), outages_ns=(S,))
    world = NarrowWorld(narrowed(plan)).fly()
    assert world.node is not None
    session = world.node.session
    assert (session.session_number, session.rejoins_asked) == (1003, {Why.UNKNOWN: 1})
    assert world.node.rearmed == 0
    assert world.watch.samples > 200


def test_when_the_transmitter_is_restarted_then_both_start_afresh() -> None:
    plan = replace(clean(), restarts=((9 * S, "transmitter"),), outages_ns=(S,))
    world = NarrowWorld(narrowed(plan)).fly()
    assert world.node is not None
    assert world.endpoint is not None
    assert world.endpoint.session.counts["rejoins"] == 1
    assert world.node.session.counts["confirmed"] > 120


def test_when_the_line_is_cut_then_the_guard_ramps_down_and_it_comes_back() -> None:
    plan = replace(clean(), partitions=((5 * S, 10 * S, "both"),))
    world = NarrowWorld(narrowed(plan)).fly()
    assert world.node is not None
    assert world.node.rearmed == 1
    assert world.node.ticks_down > 100
    assert world.watch.samples > 150


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
def test_when_one_end_is_corrupted_then_it_is_found_within_twelve_samples(end: str) -> None:
    plan = replace(clean(), sabotage=((end, Sabotage(60, "coder", 0)),))
    world = NarrowWorld(narrowed(plan)).fly()
    assert world.node is not None
    session = world.node.session
    assert session.rejoins_asked == {Why.REST: 1}
    asked = next(event for event in session.events if event.cause is Why.REST)
    assert 60 * 0.1 < asked.time_ns / 1e9 < (60 + 20) * 0.1
    assert world.watch.samples > 200
