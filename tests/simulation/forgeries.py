"""Forged frames by the thousand, in the middle of flights: no exception, and no harm that lasts.

Every message type is made with a good check and with fields as they are, nearly as they are, extreme
or random (`tests.simulation.intruder`), and given to both ends between the honest traffic, from one
message a second to a flood. When it ends, lockstep must be back within the bound of `IntrudedWorld` and
stay: `Watch.check_recovery` lets no rejoin follow.
"""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

from channel.line.impairments import Impairments, LineFaults
from tests.simulation.faults import FAULTY_S, Plan, draw
from tests.simulation.intruded import IntrudedWorld, Intrusion

RATES_HZ = (1.0, 10.0, 100.0, 500.0)
FLOOD_HZ = 2000.0
"""Long runs only."""


def forgeries(messages: int, seed: int, flood: bool = False) -> dict[str, int]:
    """Feed the given number of forged messages to flights; return how many there were of which kind.

    Raises what an end raises, and `SafetyViolation` or `LivenessViolation` with the seed to repeat.
    """
    chance = random.Random(seed)
    counts: Counter[str] = Counter()
    rates = (*RATES_HZ, FLOOD_HZ) if flood else RATES_HZ
    flown = 0
    while sum(counts[name] for name in counts if name.startswith("forged ")) < messages:
        rate_hz = rates[flown % len(rates)]
        flight_seed = chance.randrange(2**32)
        try:
            fly_among_forgeries(flight_seed, rate_hz, counts)
        except Exception as error:
            again = f"fly_among_forgeries({flight_seed}, {rate_hz}, Counter())"
            raise AssertionError(f"{again}: {repr(error)[:500]}") from error
        flown += 1
    counts["flights"] = flown
    return dict(counts)


def fly_among_forgeries(seed: int, rate_hz: float, counts: Counter[str]) -> None:
    """Fly once, on a line that does nothing wrong but delay, and add up what was forged."""
    world = IntrudedWorld(quiet_plan(seed), Intrusion(rate_hz, replayed_share=0.0))
    world.fly()
    counts.update(world.intruder.counts)
    counts["out of bounds"] += world.out_of_bounds
    counts["rejoins"] += world.watch.rejoins
    assert world.now_ns > FAULTY_S * 1e9


def quiet_plan(seed: int) -> Plan:
    """Return the plan of a seed without any fault of its own."""
    plan = draw(seed)
    lines = [Impairments(delay_ns=one.delay_ns) for one in (plan.up, plan.down)]
    return replace(
        plan,
        up=lines[0],
        down=lines[1],
        faults=LineFaults(),
        partitions=(),
        restarts=(),
        outages_ns=(),
        sabotage=(),
        quiet_s=15.0,
    )
