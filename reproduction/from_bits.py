"""How near a flight's bits come to the plant: `python -m reproduction.from_bits RESULTS.jsonl`.

Every flight has a plant of its own, each parameter 5 to 15 % off the model that flies. The results of
flights that are in the file already are kept; the table is printed at the end.
"""

from __future__ import annotations

import argparse
import json
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tenbaud.flight.fly import fly
from tenbaud.identification.api import identify
from tenbaud.identification.beside import MEASURED, TRUE

SEEDS = range(101, 117)
LETTERS = ("a_w", "a_th", "k_v", "theta_0")


class Case(NamedTuple):
    """Flights that differ in their seed."""

    preset: str
    seconds: float
    disturbance: str

    @property
    def name(self) -> str:
        return f"{self.preset}, {self.seconds:g} s, {self.disturbance or 'none'}"


WHITE = "q=2e-3"
CASES = (
    *(Case(preset, 100.0, WHITE) for preset in ("paper-10baud", "tuned-10baud")),
    *(Case(preset, 100.0, "") for preset in ("paper-10baud", "tuned-10baud", "history-10baud")),
    *(Case(preset, 100.0, WHITE) for preset in ("paper-20baud", "tuned-20baud")),
    *(Case(preset, 1000.0, WHITE) for preset in ("paper-10baud", "tuned-10baud")),
)


def flown(case: Case, seed: int) -> dict[str, Any]:
    """Fly once, identify from the bits, and return both with what they are compared with."""
    draw = random.Random(seed)
    mismatch = tuple([draw.choice((-1, 1)) * draw.uniform(0.05, 0.15) for _ in range(3)])
    settings: dict[str, Any] = {
        "duration_s": case.seconds,
        "seed": seed,
        "transmitter.plant.mismatch": mismatch,
        "transmitter.plant.disturbance": case.disturbance,
    }
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        fly(case.preset, settings=settings, out=run)
        found = identify(run, from_bits=True, fly=False)
    return {
        "case": case.name,
        "seed": seed,
        "bits": list(found.estimates.values()),
        "deviations": list(found.deviations.values()),
        "true": found.beside[TRUE],
        "measured": found.beside.get(MEASURED),
        "refused": list(found.refused),
    }


def table(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Yield the lines of a Markdown table."""
    yield "| flights | from | " + " | ".join(LETTERS) + " | within 2 errors | refused |"
    yield "|---|---|" + "---|" * (len(LETTERS) + 2)
    for case in CASES:
        own = [row for row in rows if row["case"] == case.name]
        if not own:
            continue
        true = np.array([row["true"] for row in own])
        off = np.array([row["bits"] for row in own]) - true
        within = np.abs(off) <= 2.0 * np.array([row["deviations"] for row in own])
        shares = " ".join(f"{share:.0f}" for share in 100.0 * within.mean(axis=0))
        refused = sum(bool(row["refused"]) for row in own)
        yield f"| {case.name} ({len(own)}) | bits | {_errors(off, true)} | {shares} % | {refused} |"
        kept = [place for place, row in enumerate(own) if row["measured"]]
        if not kept:
            continue
        measured = np.array([own[place]["measured"] for place in kept])
        yield f"| | measurements | {_errors(measured - true[kept], true[kept])} | | |"


def _errors(off: np.ndarray, true: np.ndarray) -> str:
    shares = 100.0 * np.abs(off / true)
    pairs = zip(np.median(shares, axis=0), np.percentile(shares, 90.0, axis=0), strict=True)
    return " | ".join(f"{middle:.2g}, {most:.2g} %" for middle, most in pairs)


def main() -> None:
    """Fly what is missing in the file, and print the table: median and 90th percentile of errors."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("results", type=Path)
    parser.add_argument("--most", type=int, default=len(CASES) * len(SEEDS), help="flights at most")
    given = parser.parse_args()
    lines = given.results.read_text().splitlines() if given.results.exists() else []
    rows = [json.loads(line) for line in lines]
    known = {(row["case"], row["seed"]) for row in rows}
    missing = [(case, seed) for seed in SEEDS for case in CASES if (case.name, seed) not in known]
    with given.results.open("a") as stream:
        for case, seed in missing[: given.most]:
            rows.append(flown(case, seed))
            stream.write(json.dumps(rows[-1]) + "\n")
            stream.flush()
    print("\n".join(table(rows)))


if __name__ == "__main__":
    main()
