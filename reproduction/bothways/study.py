"""The points of the study, and what is found at each. What is flown is kept, and not flown again."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from channel.errors import CodecDiverged
from reproduction.bothways.flights import NarrowFlight, full
from reproduction.bothways.lines import Faults
from reproduction.bothways.subjects import PITCH, SUBJECTS, machine_of, parts_of
from reproduction.studies.kept import Kept, OnProgress

FIRST_SEED = 2001
"""None of those that were looked at while the layouts and the numbers of the list were chosen: 1 to 4,
11 to 28 and 101 to 130."""
SAMPLES = {"pitch": 1000, "helicopter": 400}
"""100 s and 20 s: whole periods of the set-points, but that of travel"""
BAUDS = (10, 20, 40, 100)
LOSSES = (0.0, 0.01, 0.05, 0.1, 0.2)
FLIPS = (0.01, 0.05)
TRIPS = (1, 5, 10)
AIM_SAMPLES = 2500
"""of the points of the table of aims"""


@dataclass(frozen=True, slots=True)
class Point:
    """What is flown with `seeds` seeds; loss and flip of both directions, the round trip in samples."""

    subject: str
    scheme: str
    baud: int
    loss: float = 0.0
    flip: float = 0.0
    trip: int = 0
    seeds: int = 2
    samples: int = 0
    """0: as many as the subject usually flies"""

    @property
    def flown(self) -> int:
        return self.samples or SAMPLES[self.subject]


@dataclass(frozen=True, slots=True)
class Found:
    """What came of a point. Ratios are to the downlink "full" with the same seeds."""

    error: float
    error_half: float
    """half the width of the 95 % interval over the seeds"""
    tracking: float
    largest: float
    delay: float
    """median samples from a sample to its confirmation"""
    delay_late: float
    """the 99.9th of a hundred"""
    size: float
    """mean length of the list"""
    rejoins_h: float
    cpu: float
    """share of a core in real time"""
    speed: float
    """times real time, both ends and the plant in one process"""
    applied: float
    """rms of applied less commanded, in the unit of the inputs"""
    wrong: int
    confirmed: int


NONE = math.nan
DIVERGED = Found(
    math.inf, 0.0, math.inf, math.inf, NONE, NONE, NONE, 0.0, NONE, NONE, NONE, wrong=0, confirmed=0
)
"""Of a point in one of whose flights the estimate left all bounds, so that it ended."""


def symbols_of(point: Point) -> int:
    """Return the down symbols a sample; 0: the rate is below one."""
    return int(point.baud * parts_of(point.subject).sample_s + 1e-9)


def aims() -> dict[str, Point]:
    """Return the points of the table of aims."""

    def more(scheme: str, baud: int, **line: float) -> Point:
        return Point("pitch", scheme, baud, seeds=4, samples=AIM_SAMPLES, **line)  # type: ignore[arg-type]

    return {
        "20 down, announced, clean": more("announced", 20),
        "20 down, announced, loss 1 %": more("announced", 20, loss=0.01),
        "20 down, announced, a round trip of one sample": more("announced", 20, trip=1),
        "20 down, announced, loss 5 %": more("announced", 20, loss=0.05),
        "10 down, announced, clean": more("announced", 10),
        "10 down, announced, loss 1 %": more("announced", 10, loss=0.01),
        "20 down, live set-points, clean": more("live", 20),
        "20 down, coded commands, clean": more("coded", 20),
        "40 down, announced, loss 10 %": more("announced", 40, loss=0.1),
    }


def grid(quick: bool = False) -> list[Point]:
    """Return the points of the pictures and tables."""
    found = []
    for scheme in ("announced", "coded"):
        for baud in reversed(BAUDS):
            # Coded commands at 10 down: on fewer lines.
            few = (scheme, baud) == ("coded", 10)
            found += [Point("pitch", scheme, baud, loss=loss) for loss in LOSSES[: 3 if few else None]]
            found += [Point("pitch", scheme, baud, flip=flip) for flip in FLIPS[: 1 if few else None]]
            found += [Point("pitch", scheme, baud, trip=trip) for trip in TRIPS]
    found += [Point("pitch", "live", baud) for baud in BAUDS]
    for baud in (20, 40, 100):
        lines: list[dict[str, float]] = [{}, {"loss": 0.05}, {"flip": 0.01}, {"trip": 1}]
        found += [Point("helicopter", "announced", baud, **line) for line in lines]  # type: ignore[arg-type]
    for baud in (40, 100):
        found += [Point("helicopter", "coded", baud, loss=loss) for loss in (0.0, 0.05)]
    if not quick:
        return found
    return [
        Point(one.subject, one.scheme, one.baud, one.loss, seeds=1, samples=80)
        for one in found
        if (one.subject, one.flip, one.trip) == ("pitch", 0.0, 0)
        and one.baud in (20, 40)
        and one.loss in (0.0, 0.05)
        and (one.scheme, one.baud) != ("coded", 20)
    ]


def fly(point: Point) -> Found:
    """Fly a point."""
    parts, subject = parts_of(point.subject), SUBJECTS[point.subject]
    faults = Faults.both(point.loss, point.flip)
    pairs, delays, sizes = [], [], []
    squares = [0.0] * 4
    rejoins = wrong = confirmed = 0
    largest = cpu_s = applied = taken_s = 0.0
    for seed in range(FIRST_SEED, FIRST_SEED + point.seeds):
        machine, wanted = machine_of(point.subject, point.scheme, symbols_of(point), point.trip)
        body, trip = subject.body(seed), point.trip
        flight = NarrowFlight(machine, wanted, body, parts.targets, seed, faults, round_trip=trip)
        begin = time.process_time()
        try:
            one = flight.fly(point.flown)
        except CodecDiverged:
            return DIVERGED
        taken_s += time.process_time() - begin
        own = full(
            parts.codec,
            parts.law,
            subject.body(seed),
            parts.targets,
            parts.start,
            seed,
            point.flown,
            faults,
            round_trip=trip,
        )
        pairs.append(math.sqrt(one.error / own.error))
        for at, value in enumerate((one.error, own.error, one.tracking, own.tracking)):
            squares[at] += value
        delays += one.delays
        sizes += one.sizes
        rejoins, wrong = rejoins + len(one.rejoins), wrong + one.wrong
        confirmed, largest = confirmed + one.confirmed, max(largest, one.largest / own.largest)
        cpu_s, applied = cpu_s + one.cpu_s, applied + one.difference
    samples = point.seeds * point.flown
    mean = sum(pairs) / len(pairs)
    spread = math.sqrt(sum((one - mean) ** 2 for one in pairs) / max(1, len(pairs) - 1))
    delays.sort()
    return Found(
        error=math.sqrt(squares[0] / squares[1]),
        error_half=1.96 * spread / math.sqrt(len(pairs)),
        tracking=math.sqrt(squares[2] / squares[3]),
        largest=largest,
        delay=delays[len(delays) // 2] if delays else math.nan,
        delay_late=delays[int(0.999 * len(delays))] if delays else math.nan,
        size=sum(sizes) / max(1, len(sizes)),
        rejoins_h=rejoins * 3600.0 / (samples * parts.sample_s),
        cpu=cpu_s / (samples * parts.sample_s),
        speed=samples * parts.sample_s / taken_s,
        applied=math.sqrt(applied / samples),
        wrong=wrong,
        confirmed=confirmed,
    )


def corruptions(at_receiver: bool, count: int) -> tuple[float, int]:
    """Return median and largest number of samples until a corrupt state is found, on a clean line."""
    machine, wanted = machine_of("pitch", "announced", 2, 0)
    targets = parts_of("pitch").targets
    flight = NarrowFlight(machine, wanted, PITCH.body(FIRST_SEED), targets, FIRST_SEED)
    flight.fly(150)
    found = []
    for _ in range(count):
        flight.fly(32)
        flight.corrupt(at_receiver)
        begin, asked = flight.sample, len(flight.result.rejoins)
        while len(flight.result.rejoins) == asked:
            flight.fly(1)
        found.append(flight.sample - begin)
    return statistics.median(found), max(found)


def fly_all(points: Iterable[Point], path: Path, on_progress: OnProgress) -> dict[Point, Found]:
    """Fly what the file does not hold yet, and keep each point in it as it comes."""
    own = b"".join(
        (Path(__file__).parent / name).read_bytes()
        for name in ("flights.py", "lines.py", "study.py", "subjects.py")
    )
    return Kept(path, Point, Found, own).fly_all(fly, points, on_progress)
