"""The long run: seed after seed for as many minutes as are given, and what came of it.

    python -m tests.simulation.soak --minutes 10        writes soak.json
    python -m tests.simulation.soak --seed 4711         repeats one flight
    python -m tests.simulation.soak --canary            a flight that must be found faulty

A seed that fails is printed with the command that repeats it, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import time
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

from channel.protocol.sabotage import Sabotage
from tests.channel.protocol.fuzz import fuzz_all
from tests.simulation.clean import fly_clean
from tests.simulation.faults import draw
from tests.simulation.intruded import IntrudedWorld, draw_intrusion
from tests.simulation.narrow_world import NarrowWorld, narrowed
from tests.simulation.watch import LivenessViolation, SafetyViolation
from tests.simulation.world import World

CANARY_SEED = 2
FUZZ_INPUTS = 1_000_000
CLEAN_SYMBOLS = 1_000_000
CLEAN_MINUTES_MIN = 10.0
"""A shorter soak flies and fuzzes a share of these."""


@dataclass
class SeedResult:
    """What one seed showed."""

    seed: int
    simulated_s: float = 0.0
    samples: int = 0
    recovery_samples: float | None = None
    """from the last fault to lockstep"""
    beyond_samples: float | None = None
    """the same, less the round trip and the command lead"""
    desyncs_raised: int = 0
    desyncs_missed: int = 0
    rejoins: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    problem: str | None = None
    kind: str = "alone"
    """or "in company", or "narrow": alone, with the narrow downlink"""


def fly_seed(seed: int) -> SeedResult:
    """Fly one seed; a violation is in the result, with the command that repeats it."""
    return _fly(World(draw(seed)), "--seed")


def fly_intruded_seed(seed: int) -> SeedResult:
    """Fly one seed in company: an intruder on the line, second receivers."""
    result = _fly(IntrudedWorld(draw(seed), draw_intrusion(seed)), "--intruded-seed")
    result.kind = "in company"
    return result


def fly_narrow_seed(seed: int) -> SeedResult:
    """Fly one seed with the narrow downlink."""
    result = _fly(NarrowWorld(narrowed(draw(seed))), "--narrow-seed")
    result.kind = "narrow"
    return result


def fly_any(seed: int) -> SeedResult:
    """Fly a seed of a soak: of six, two are in company and one has the narrow downlink."""
    if seed % 6 == 1:
        return fly_narrow_seed(seed)
    return fly_intruded_seed(seed) if seed % 3 == 2 else fly_seed(seed)


def _fly(world: World, option: str) -> SeedResult:
    plan = world.plan
    seed = plan.seed
    problem = None
    try:
        world.fly()
    except (SafetyViolation, LivenessViolation) as error:
        again = f"python -m tests.simulation.soak {option} {seed}"
        problem = f"{type(error).__name__} in seed {seed}: {error}\n  again: {again}"
    watch = world.watch
    recovered = world.recovered_ns
    expected_ns = plan.round_trip_ns + plan.terms.lead_ticks * plan.terms.tick_ns
    world.faults["corrupted codecs"] += len(plan.sabotage)
    world.faults["clock jumps"] += len(plan.faults.clock_steps)
    return SeedResult(
        seed,
        world.now_ns / 1e9,
        watch.samples,
        None if recovered is None else recovered / plan.terms.sample_ns,
        None if recovered is None else (recovered - expected_ns) / plan.terms.sample_ns,
        watch.desyncs_raised,
        watch.desyncs_missed,
        watch.rejoins,
        world.faults,
        problem,
    )


def fly_canary(seed: int) -> None:
    """Fly with a transmitter that keeps a lockstep failure to itself; must raise."""
    plan = replace(draw(seed), sabotage=(("receiver", Sabotage(30, "coder", 0)),))
    World(plan, blind=True).fly()


def soak(minutes: float, first_seed: int, workers: int) -> dict[str, object]:
    """Fly seeds for some minutes; return the report."""
    until = time.monotonic() + 60.0 * minutes
    share = min(1.0, minutes / CLEAN_MINUTES_MIN)
    faults: Counter[str] = Counter()
    results = 0
    totals: Counter[str] = Counter()
    worst, beyond = Counter[str](), Counter[str]()
    hours = 0.0
    problems: list[str] = []
    started = time.monotonic()
    context = multiprocessing.get_context("spawn")
    with context.Pool(workers) as pool, context.Pool(2) as beside:
        clean = beside.apply_async(fly_clean, (round(CLEAN_SYMBOLS * share),))
        fuzzed = beside.apply_async(fuzz_all, (round(FUZZ_INPUTS * share), first_seed))
        seeds = iter(range(first_seed, 2**62))
        while time.monotonic() < until:
            batch = [next(seeds) for _ in range(4 * workers)]
            for result in pool.imap_unordered(fly_any, batch):
                results += 1
                hours += result.simulated_s / 3600.0
                faults.update(result.faults)
                totals["samples"] += result.samples
                totals["rejoins"] += result.rejoins
                totals["desyncs_raised"] += result.desyncs_raised
                totals["desyncs_missed"] += result.desyncs_missed
                kind = result.kind
                totals[f"seeds {kind}"] += 1
                worst[kind] = max(worst[kind], result.recovery_samples or 0.0)
                beyond[kind] = max(beyond[kind], result.beyond_samples or 0.0)
                if result.problem is not None:
                    problems.append(result.problem)
                    print(result.problem, flush=True)
        simulated_s = time.monotonic() - started
        report = {
            "minutes": minutes,
            "seeds": results,
            "first_seed": first_seed,
            "simulated_hours": round(hours, 3),
            "times_real_time_all_workers": round(3600.0 * hours / simulated_s, 1),
            "workers": workers,
            **{name: totals[name] for name in ("samples", "rejoins", "desyncs_raised")},
            "desyncs_missed": totals["desyncs_missed"],
            "seeds_in_company": totals["seeds in company"],
            "seeds_narrow": totals["seeds narrow"],
            "worst_recovery_samples": _rounded(worst),
            "worst_recovery_beyond_round_trip_and_lead_samples": _rounded(beyond),
            "faults_injected": dict(sorted(faults.items())),
            "frames_fuzzed": fuzzed.get(),
            "clean_run": clean.get(),
            "failed_seeds": problems,
        }
    return report


def _rounded(figures: Counter[str]) -> dict[str, float]:
    return {name: round(figure, 2) for name, figure in sorted(figures.items())}


def main() -> int:
    """Run as a command."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--seed", type=int, help="fly this one seed and stop")
    parser.add_argument("--intruded-seed", type=int, help="fly this one seed in company and stop")
    parser.add_argument("--narrow-seed", type=int, help="fly this one narrow seed and stop")
    parser.add_argument("--first-seed", type=int, default=1_000)
    parser.add_argument("--workers", type=int, default=max(1, multiprocessing.cpu_count()))
    parser.add_argument("--canary", action="store_true", help="must fail")
    parser.add_argument("--output", type=Path, default=Path("soak.json"))
    options = parser.parse_args()
    if options.canary:
        fly_canary(CANARY_SEED)
        return 0
    for seed, fly in (
        (options.seed, fly_seed),
        (options.intruded_seed, fly_intruded_seed),
        (options.narrow_seed, fly_narrow_seed),
    ):
        if seed is not None:
            result = fly(seed)
            print(result.problem or f"seed {result.seed} is well: {result}")
            return 1 if result.problem else 0
    try:
        fly_canary(CANARY_SEED)
    except SafetyViolation as error:
        print(f"the canary was found, as it must be: {error}")
    else:
        print("the canary was not found: this harness cannot fail, so its results mean nothing")
        return 1
    report = soak(options.minutes, options.first_seed, options.workers)
    text = json.dumps(report, indent=2)
    options.output.write_text(text + "\n")
    print(text)
    clean = report["clean_run"]
    assert isinstance(clean, dict)
    failed = report["failed_seeds"] or report["desyncs_missed"] or clean["desyncs"]
    return 1 if failed or clean["exit_code"] else 0


if __name__ == "__main__":
    sys.exit(main())
