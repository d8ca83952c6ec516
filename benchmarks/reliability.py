"""Measures what docs/RELIABILITY.md says, and writes its tables and figures anew.

    python -m benchmarks.reliability            some minutes; --quick for a look

The prose of the page is left alone: each table stands between two marks and is replaced. It is a
benchmark and no command of the tool, because it describes this software and not a user's flight.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import re
import statistics
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.recovery import Recovery, recoveries
from channel.protocol.wire import DATAGRAM
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.flight import transmit

DOCS = Path(__file__).parents[1] / "docs"
PAGE = DOCS / "RELIABILITY.md"
TORQUE = "q=2e-3"
LOSSES = (0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5)
FLIPS = (0.0, 0.005, 0.01, 0.02, 0.05)
TRIPS = (0, 1, 2, 4, 6, 8, 10)
FAULTS = "loss=0.1,up:flip=0.01"
CODERS = {"paper": ("paper-10baud", {"window_signs": 3}), "tuned": ("tuned-10baud", {})}


@dataclass(frozen=True)
class Case:
    """One flight to fly."""

    coder: str
    impairments: str
    seed: int
    duration_s: float
    trip_periods: int = 0


@dataclass(frozen=True)
class Flown:
    """What came of it; errors in rad."""

    coded_rms: float
    coded_max: float
    live_rms: float
    desyncs: int
    rejoins: int
    rejoin_bytes: int
    times_real_time: float
    ended_well: bool


def fly(case: Case) -> Flown:
    """Fly a case in this process, both ends, without a recording."""
    preset, coder = CODERS[case.coder]
    items = [case.impairments] if case.impairments else []
    if case.trip_periods:
        items.append(f"delay={50 * case.trip_periods}ms")
    values: dict[str, Any] = {
        "seed": case.seed,
        "duration_s": case.duration_s,
        "timing": {"lead_ticks": 3 + 10 * case.trip_periods},
        "channel": {"repeats": 4},
        "coder": coder,
        "link": {"impairments": ",".join(items)},
        "transmitter": {"plant": {"disturbance": TORQUE}},
    }
    agreement = agree(load_config(preset, None, values), "virtual")
    run = transmit.prepare(agreement, None, DATAGRAM)
    outcome = transmit.fly_virtual(run, build_receiver(agreement, None, DATAGRAM), lambda: False)
    scores, counts = run.node.scores, run.node.session.counts
    return Flown(
        scores.first.coded.rms or 0.0,
        scores.first.coded.largest,
        scores.first.live.rms or 0.0,
        counts["desyncs"],
        counts["rejoins"],
        run.rejoin_bytes,
        case.duration_s / run.flight_s,
        outcome.code == 0,
    )


class Results:
    """All flights, found again by what was asked."""

    def __init__(self, seeds: int, duration_s: float) -> None:
        self.seeds = seeds
        self.duration_s = duration_s
        self.flown: dict[Case, Flown] = {}

    def cases(self) -> Iterator[Case]:
        """Yield every flight of every table."""
        for seed in range(1, self.seeds + 1):
            for coder in CODERS:
                for loss in LOSSES:
                    yield self.case(coder, f"up:loss={loss}" if loss else "", seed)
            for flip in FLIPS:
                yield self.case("paper", f"up:flip={flip}" if flip else "", seed)
            for trip in TRIPS:
                for faults in ("", FAULTS):
                    yield self.case("paper", faults, seed, trip)

    def case(self, coder: str, impairments: str, seed: int, trip: int = 0) -> Case:
        """Return one case."""
        return Case(coder, impairments, seed, self.duration_s, trip)

    def of(self, coder: str, impairments: str, trip: int = 0) -> list[Flown]:
        """Return the flights of all seeds."""
        seeds = range(1, self.seeds + 1)
        return [self.flown[self.case(coder, impairments, seed, trip)] for seed in seeds]

    def rms(self, coder: str, impairments: str, trip: int = 0, live: bool = False) -> float:
        """Return the root mean square over all seeds, rad."""
        flights = self.of(coder, impairments, trip)
        squares = [(one.live_rms if live else one.coded_rms) ** 2 for one in flights]
        return math.sqrt(statistics.fmean(squares))

    def fly_all(self) -> None:
        """Fly on every core."""
        cases = list(dict.fromkeys(self.cases()))
        with multiprocessing.get_context("spawn").Pool() as pool:
            for case, flown in zip(cases, pool.imap(fly, cases), strict=True):
                self.flown[case] = flown


def loss_rows(results: Results) -> list[list[str]]:
    """Return the table of the error against loss."""
    rows = [["bits lost", "law", "paper, 3 signs: rms", "over law", "tuned: rms", "over law"]]
    for loss in LOSSES:
        asked = f"up:loss={loss}" if loss else ""
        law = (1.0 - loss) ** -1.5
        row = [f"{loss:.0%}", f"{law:.2f}"]
        for coder in CODERS:
            rms = results.rms(coder, asked)
            ratio = rms / results.rms(coder, "")
            row += [f"{1000 * rms:.1f} mrad ({ratio:.2f})", f"{ratio / law - 1:+.0%}"]
        rows.append(row)
    return rows


def flip_rows(results: Results) -> list[list[str]]:
    """Return the table of the error against flipped bits."""
    rows = [["bits flipped", "rms", "largest", "desyncs"]]
    for flip in FLIPS:
        asked = f"up:flip={flip}" if flip else ""
        flights = results.of("paper", asked)
        rows.append(
            [
                f"{flip:.1%}",
                f"{1000 * results.rms('paper', asked):.1f} mrad",
                f"{1000 * max(one.coded_max for one in flights):.0f} mrad",
                str(sum(one.desyncs for one in flights)),
            ]
        )
    return rows


def trip_rows(results: Results) -> list[list[str]]:
    """Return the table of both errors over the round trip."""
    rows = [["round trip, periods", "coded", "live", "coded, faults", "live, faults", "rejoins/h"]]
    for trip in TRIPS:
        row = [str(trip)]
        for faults in ("", FAULTS):
            errors = [results.rms("paper", faults, trip, live) for live in (False, True)]
            row += [f"{1000 * error:.1f} mrad" for error in errors]
        flights = results.of("paper", FAULTS, trip)
        hours = results.duration_s * results.seeds / 3600.0
        rows.append([*row, f"{sum(one.rejoins for one in flights) / hours:.0f}"])
    return rows


def recovery_rows(found: Sequence[Recovery]) -> list[list[str]]:
    """Return the table of recoveries, in samples."""
    rows = [["what happened", "round trip", "fault to detection", "to rejoined", "control bytes"]]
    rows += [
        [
            one.what,
            f"{one.trip_samples:g}",
            "-" if one.detected_samples is None else f"{one.detected_samples:.2f}",
            f"{one.rejoined_samples:.2f}",
            "-" if one.control_bytes is None else str(one.control_bytes),
        ]
        for one in found
    ]
    return rows


def speed_rows(results: Results) -> list[list[str]]:
    """Return the table of speeds, in times real time on one core of a machine with others at work."""
    rows = [["flight at 10 baud", "times real time, median of its flights"]]
    for what, faults, trip in (
        ("clean, no round trip", "", 0),
        ("faults on, no round trip", FAULTS, 0),
        ("faults on, round trip of ten periods", FAULTS, 10),
    ):
        flights = results.of("paper", faults, trip)
        rows.append([what, f"{statistics.median(one.times_real_time for one in flights):.0f}"])
    return rows


def draw(results: Results, output: Path) -> None:
    """Draw the error over loss and over the round trip."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    law = [(1.0 - loss) ** -1.5 for loss in LOSSES]
    left.fill_between(
        LOSSES, [0.75 * y for y in law], [1.25 * y for y in law], color="#dddddd", label="law ± 25 %"
    )
    left.plot(LOSSES, law, color="#777777", label=r"$(1-p)^{-3/2}$")
    for coder, colour, name in (("paper", "#0b6fb8", "paper, 3 signs"), ("tuned", "#d9730d", "tuned")):
        clean = results.rms(coder, "")
        ratios = [results.rms(coder, f"up:loss={p}" if p else "") / clean for p in LOSSES]
        left.plot(LOSSES, ratios, "o-", color=colour, markersize=4, label=name)
    left.set_xlabel("share of bits lost, p")
    left.set_ylabel("rms error, relative to p = 0")
    for faults, style, name in (("", "-", "clean"), (FAULTS, "--", "10 % lost, 1 % flipped")):
        for live, colour, kind in ((False, "#0b6fb8", "coded"), (True, "#d9730d", "live")):
            errors = [1000 * results.rms("paper", faults, trip, live) for trip in TRIPS]
            right.plot(TRIPS, errors, f"o{style}", color=colour, markersize=4, label=f"{kind}, {name}")
    right.set_xlabel("round trip, symbol periods")
    right.set_ylabel("rms error, mrad")
    for panel in (left, right):
        panel.set_ylim(bottom=0.0)
        panel.grid(visible=True, color="#e6e6e6", linewidth=0.6)
        panel.spines[["top", "right"]].set_visible(False)
        panel.legend(frameon=False, fontsize=8)
    figure.savefig(output, dpi=150)


def replaced(page: str, name: str, rows: list[list[str]]) -> str:
    """Return the page with one of its tables replaced; ValueError when it has no such marks."""
    lines = [f"| {' | '.join(row)} |" for row in rows]
    lines.insert(1, "|" + "---|" * len(rows[0]))
    pattern = rf"(<!-- table: {name} -->\n).*?(<!-- end -->)"
    text = "\n".join(lines)
    changed, count = re.subn(pattern, lambda m: f"{m[1]}{text}\n{m[2]}", page, flags=re.S)
    if count != 1:
        raise ValueError(f"{PAGE} has no marks for the table {name!r}")
    return changed


def main() -> int:
    """Measure, and write page and figure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="one short flight per case; shows only")
    options = parser.parse_args()
    results = Results(1, 60.0) if options.quick else Results(3, 300.0)
    results.fly_all()
    tables = {
        "loss": loss_rows(results),
        "flips": flip_rows(results),
        "round trips": trip_rows(results),
        "recovery": recovery_rows(recoveries()),
        "speed": speed_rows(results),
    }
    for name, rows in tables.items():
        print(name, *("  " + "  ".join(row) for row in rows), sep="\n")
    if not all(one.ended_well for one in results.flown.values()):
        print("a flight did not end well")
        return 1
    if options.quick:
        return 0
    page = PAGE.read_text()
    for name, rows in tables.items():
        page = replaced(page, name, rows)
    PAGE.write_text(page)
    (DOCS / "figures").mkdir(exist_ok=True)
    draw(results, DOCS / "figures" / "reliability.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
