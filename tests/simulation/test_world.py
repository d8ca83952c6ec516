"""Whole flights under everything that can go wrong at once, one seed each."""

from __future__ import annotations

from dataclasses import replace

import pytest

from channel.line.impairments import Impairments, LineFaults
from channel.protocol.sabotage import Sabotage
from tests.simulation.faults import Plan, draw
from tests.simulation.soak import CANARY_SEED, fly_canary, fly_seed
from tests.simulation.watch import LivenessViolation, SafetyViolation
from tests.simulation.world import World
from transmitter.session.owing import Owing
from transmitter.session.session import TransmitterSession

SEEDS, FLOWN = 24, (0, 1, 2, 3)
"""`make soak` flies the others, and random ones. Of those flown here one has a long lead and a clock
that jumps, one twenty rejoins; either end is killed, and the line cut in each direction and in both."""


@pytest.mark.parametrize(
    "seed",
    [pytest.param(one, marks=() if one in FLOWN else pytest.mark.soak) for one in range(SEEDS)],
)
def test_when_everything_goes_wrong_then_nothing_is_unsafe_and_it_comes_back(seed: int) -> None:
    result = fly_seed(seed)
    assert result.problem is None, result.problem
    assert result.desyncs_missed == 0
    assert result.recovery_samples is not None, "the watch holds it to its bound"


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
def test_when_an_old_recording_is_played_to_a_restarted_end_then_it_comes_back(end: str) -> None:
    plan = replace(draw(2037), restarts=((9_000_000_000, end),), outages_ns=(1_000_000_000,))
    world = World(plan)
    receive, heard = world._receive, []

    def tapped(data: bytes | None) -> None:
        if data is not None and world.now_ns < 4_000_000_000:
            heard.append(data)
            again_ns = world.now_ns + 10_000_000_000
            world.at(again_ns, lambda: receive(data))
        receive(data)

    world._receive = tapped  # type: ignore[method-assign]
    world.fly()
    assert len(heard) > 20


def test_when_the_watchdog_counted_ticks_that_are_owed_nothing_then_the_harness_would_find_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    base = plan_of(up=Impairments(), down=Impairments())
    plan = replace(
        base,
        terms=replace(base.terms, lead_ticks=60),
        sabotage=(("transmitter", Sabotage(60, "coder", 0)),),
    )
    assert World(plan).fly().watch.rejoins == 1
    monkeypatch.setattr(Owing, "owed_ticks", lambda _owing, tick: tick + 1)
    with pytest.raises(LivenessViolation):
        World(plan).fly()


def test_when_the_same_seed_flies_twice_then_everything_is_the_same() -> None:
    first, second = (World(draw(1)).fly() for _ in range(2))
    assert first.watch.decided_digests == second.watch.decided_digests
    assert len(first.watch.decided_digests) > 100
    assert first.faults == second.faults


def test_when_an_end_stays_silent_about_a_difference_then_the_harness_finds_out() -> None:
    with pytest.raises(SafetyViolation, match="nobody said so"):
        fly_canary(CANARY_SEED)


def test_when_old_epochs_were_obeyed_then_the_harness_would_find_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plan = plan_of(up=Impairments(), down=Impairments(loss=0.3, delay_ns=300_000_000))
    World(plan).fly()
    monkeypatch.setattr(
        TransmitterSession, "command", lambda _session, _tick: (0.123, -0.123), raising=True
    )
    with pytest.raises(SafetyViolation, match="decided"):
        World(plan).fly()


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
@pytest.mark.parametrize("delay_periods", [0, 1, 5])
def test_when_one_end_is_corrupted_then_it_is_found_and_corrected_in_time(
    end: str, delay_periods: int
) -> None:
    delay_ns = delay_periods * 100_000_000 // 2
    line = Impairments(delay_ns=delay_ns)
    plan = replace(plan_of(up=line, down=line), sabotage=((end, Sabotage(60, "coder", 0)),))
    world = World(plan)
    times: dict[str, int] = {}
    original = world.watch.on_delivered

    def on_delivered(node):  # type: ignore[no-untyped-def]
        original(node)
        if node.session.counts["desyncs"]:
            times.setdefault("found", world.now_ns)
        if node.session.counts["rejoins"]:
            times.setdefault("rejoined", world.now_ns)

    world.watch.on_delivered = on_delivered  # type: ignore[method-assign]
    world.fly()
    sample_ns, round_trip_ns = plan.terms.sample_ns, 2 * delay_ns
    # The corrupted state is the one after sample 60, whose word leaves at its first tick; the clock
    # of the flight begins a handshake after true time 0.
    begun_ns = round_trip_ns + 10_000_000 + 60 * sample_ns
    assert 0 <= times["found"] - begun_ns <= sample_ns + round_trip_ns
    assert 0 <= times["rejoined"] - times["found"] <= 3 * sample_ns + round_trip_ns
    assert world.watch.desyncs_raised == 1


def plan_of(up: Impairments, down: Impairments) -> Plan:
    """Return a plan of the paper's flight with these lines and no other fault: a short flight."""
    base = draw(0)
    delay_ns = up.delay_ns + up.jitter_ns + down.delay_ns + down.jitter_ns
    terms = replace(
        base.terms,
        ticks_per_sample=10,
        rate_baud=10.0,
        delivery="start",
        repeats=2,
        deadline_allowance_ns=20_000_000,
        lead_ticks=3 + delay_ns // 10_000_000,
    )
    plan = Plan(0, base.zoom, terms, up, down, LineFaults(), (), (), (), (), 0.1)
    return replace(plan, faulty_s=10.0, quiet_s=15.0)
