"""What one seed asks of a flight: its terms, and the ranges that its faults are drawn from.

The ranges themselves come from the seed, so that some flights meet one kind of fault only and others
all at once: a fixed mixture would never try what it does not contain.
"""

from __future__ import annotations

import random
from dataclasses import dataclass, replace

from channel.codec.coders.zoom import ZoomParameters
from channel.line.impairments import Impairments, LineFaults
from channel.protocol.sabotage import Sabotage
from channel.protocol.terms import Terms
from tenbaud.build.liveness import check_liveness, overtaking_ticks, round_trip, watchdog_ticks
from tests.channel.codec.parts import IMPULSE, PAPER, THREE_SIGNS, TICK_NS, TICK_S, terms

FAULTY_S = 20.0
QUIET_S = 25.0
"""With faults, then without; the second part must be enough to be locked again and accurate."""
SLOW_SAMPLES = 10
"""A longer command lead than this, and the plant runs away between a decision and its effect."""


@dataclass(frozen=True)
class Plan:
    """Everything that a seed decides."""

    seed: int
    zoom: ZoomParameters
    terms: Terms
    up: Impairments
    down: Impairments
    faults: LineFaults
    """of the receiver's clock"""
    partitions: tuple[tuple[int, int, str], ...]
    """(start, end, "up" or "down" or "both"), true time, ns"""
    restarts: tuple[tuple[int, str], ...]
    """(true time, which end), ns"""
    outages_ns: tuple[int, ...]
    """how long each restart takes"""
    sabotage: tuple[tuple[str, Sabotage], ...]
    mismatch: float
    watchdog_ticks: int = 50
    faulty_s: float = FAULTY_S
    quiet_s: float = QUIET_S

    @property
    def overtaking_ticks(self) -> int:
        """How long command frames overtake each other, as a configuration would know it."""
        return overtaking_ticks(self.terms, LineFaults(self.up, self.down))

    @property
    def is_slow(self) -> bool:
        """Whether the loop over this line is too slow for the estimate to be held to its bound."""
        return self.terms.lead_ticks * TICK_NS > SLOW_SAMPLES * self.terms.sample_ns

    @property
    def round_trip_ns(self) -> int:
        """Longest usual round trip: delivery, delays and spread of both directions."""
        lines = (self.up, self.down)
        delays = sum(one.delay_ns + one.jitter_ns for one in lines)
        return delays + self.terms.symbol_delay_ns


def draw(seed: int) -> Plan:
    """Return the plan of a seed."""
    plan = _draw_faults(seed)
    # Drawn apart, so that the faults of a seed stay what they were.
    chance = random.Random(f"{seed} liveness")
    stretch = chance.uniform(1.0, 6.0) if chance.random() < 0.25 else 1.0
    up, down = (_stretched(one, stretch) for one in (plan.up, plan.down))
    return with_liveness(replace(plan, up=up, down=down), chance)


def with_liveness(plan: Plan, chance: random.Random) -> Plan:
    """Return the plan with a lead and a watchdog of every kind that a configuration may have."""
    faults = LineFaults(plan.up, plan.down)
    needed = plan.terms.lead_needed_ticks + -(-faults.longest_delay_ns // TICK_NS)
    trip = round_trip(replace(plan.terms, lead_ticks=needed), faults, "real")
    shortest = max(plan.terms.lead_needed_ticks, trip.in_time_ticks - plan.terms.ticks_per_sample + 1)
    lead = chance.choice(
        (needed, needed, chance.randint(min(shortest, needed), needed), needed + chance.randint(1, 200))
    )
    plan_terms = replace(plan.terms, lead_ticks=lead)
    trip = round_trip(plan_terms, faults, "real")
    least = max(0, trip.longest_ticks - lead) + 1
    auto = watchdog_ticks(None, plan_terms, trip)
    watchdog = chance.choice((auto, auto, least, chance.randint(least, least + 100)))
    check_liveness(watchdog * TICK_S, plan_terms, trip)
    return replace(plan, terms=plan_terms, watchdog_ticks=watchdog)


def _stretched(one: Impairments, factor: float) -> Impairments:
    return replace(one, delay_ns=round(one.delay_ns * factor), jitter_ns=round(one.jitter_ns * factor))


def _draw_faults(seed: int) -> Plan:
    chance = random.Random(seed)
    ticks = chance.choice((5, 10))
    period_ns = ticks * TICK_NS
    up, down = (_impairments(chance, period_ns, upward) for upward in (True, False))
    plan_terms = terms(
        ticks_per_sample=ticks,
        rate_baud=100.0 / ticks,
        delivery=chance.choice(("start", "end")),
        repeats=chance.choice((0, 1, 2, 4)),
        deadline_allowance_ns=chance.choice((20, 60)) * 1_000_000 + 2 * up.jitter_ns,
    )
    delays_ns = sum(one.delay_ns + one.jitter_ns for one in (up, down))
    lead = plan_terms.lead_needed_ticks + -(-delays_ns // TICK_NS)
    plan_terms = replace(plan_terms, lead_ticks=lead)
    restarts = tuple(
        (round(chance.uniform(1.0, FAULTY_S) * 1e9), chance.choice(("transmitter", "receiver")))
        for _ in range(chance.choice((0, 0, 1, 2)))
    )
    return Plan(
        seed,
        chance.choice((PAPER, THREE_SIGNS, IMPULSE)),
        plan_terms,
        up,
        down,
        _clock(chance),
        tuple(_partition(chance) for _ in range(chance.choice((0, 0, 1, 2)))),
        tuple(sorted(restarts)),
        tuple(round(chance.uniform(0.05, 3.0) * 1e9) for _ in restarts),
        tuple(_sabotage(chance, ticks) for _ in range(chance.choice((0, 0, 1)))),
        chance.uniform(-0.2, 0.2),
    )


def _impairments(chance: random.Random, period_ns: int, upward: bool) -> Impairments:
    def maybe(largest: float) -> float:
        return chance.uniform(0.0, largest) if chance.random() < 0.5 else 0.0

    delay_ns = round(maybe(3.0) * period_ns)
    return Impairments(
        loss=maybe(0.3),
        burst_enter=maybe(0.05),
        burst_leave=chance.uniform(0.2, 1.0),
        flip=maybe(0.05) if upward else 0.0,
        raw=maybe(0.05),
        duplicate=maybe(0.5),
        reorder=maybe(0.1),
        delay_ns=delay_ns,
        jitter_ns=round(maybe(0.5) * min(delay_ns, period_ns)),
    )


def _clock(chance: random.Random) -> LineFaults:
    skew_ppm = chance.uniform(-200.0, 200.0) if chance.random() < 0.3 else 0.0
    jumps = tuple(
        sorted(
            (round(chance.uniform(1.0, FAULTY_S) * 1e9), round(chance.uniform(-0.3, 0.3) * 1e9))
            for _ in range(chance.choice((0, 0, 0, 1, 2)))
        )
    )
    return LineFaults(skew_ppm=skew_ppm, clock_steps=jumps)


def _partition(chance: random.Random) -> tuple[int, int, str]:
    start_ns = round(chance.uniform(0.5, FAULTY_S) * 1e9)
    end_ns = min(start_ns + round(chance.uniform(0.05, 5.0) * 1e9), round(FAULTY_S * 1e9))
    return start_ns, end_ns, chance.choice(("up", "down", "both"))


def _sabotage(chance: random.Random, ticks: int) -> tuple[str, Sabotage]:
    sample = chance.randrange(5, int(FAULTY_S * 100 / ticks))
    part, size = chance.choice((("model", 4), ("coder", 1)))
    return chance.choice(("transmitter", "receiver")), Sabotage(sample, part, chance.randrange(size))
