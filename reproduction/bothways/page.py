"""docs/BOTHWAYS.md: aims beside what was measured, which rate a line needs, all points."""

from __future__ import annotations

import math
from pathlib import Path

from reproduction.bothways.draw import ERRORS, LISTS, Points
from reproduction.bothways.flights import SCORED_FROM
from reproduction.bothways.study import (
    AIM_SAMPLES,
    BAUDS,
    FIRST_SEED,
    FLIPS,
    LOSSES,
    SAMPLES,
    TRIPS,
    Found,
    Point,
    aims,
    corruptions,
)
from reproduction.bothways.subjects import BITS, SUBJECTS
from tenbaud.files.whole import write_whole

ENOUGH = 1.1
"""error and tracking, over those of the full downlink, that a line is held to carry"""
NAMES = {
    "announced": "mirrored law, announced set-points",
    "live": "mirrored law, live set-points",
    "coded": "coded commands",
}
AIMS = {
    "20 down, announced, clean": ("error", 1.02),
    "20 down, announced, loss 1 %": ("error", 1.02),
    "20 down, announced, a round trip of one sample": ("error", 1.02),
    "20 down, announced, loss 5 %": ("error", 1.2),
    "10 down, announced, clean": ("error", 1.05),
    "10 down, announced, loss 1 %": ("error", 1.05),
    "20 down, live set-points, clean": ("tracking", 1.06),
    "20 down, coded commands, clean": ("tracking", 1.1),
    "40 down, announced, loss 10 %": ("error", 1.3),
}
CORRUPTED = 30
INTRODUCTION = """# Both directions

A flight at 10 bit/s up (pitch axis) or 20 (helicopter) and R_d symbols/s down: what the downlink costs
when it is as narrow as the uplink. The state machine, the words and the list of hypotheses are
explained in [a narrow downlink](theory/downlink.md). Ratios are to the downlink `full`, whose commands
and echoes are exact, in a flight with the same disturbances and the same uplink faults; faults act on
both directions of the narrow flight alike. **A mirrored law runs beside the plant as well as at the
receiver**: only set-points cross the line. With coded commands the controller is at the receiver alone.

`tenbaud figures bothways --docs docs` makes this page{quick}.
"""
HOW = """## How it was flown

Both ends run in one process without sessions: the receiver's state machine, the transmitter's list, and
the simulated rig of the presets `tuned-10baud` and `helicopter-20baud`, 10 % off their models and
disturbed, read through encoders. A down symbol comes in the sample it was sent in, or a round trip
later; a mirrored law flies without command lead, and coded commands, as `full`, with that of the round
trip. Set-points are words of {bits} bits, announced as far ahead as a word and the round trip need, or,
*live*, sent when they change. After a rejoin the transmitter has the receiver's state 6 samples and two
round trips later.

Layouts: announced set-points have one command symbol in every fourth idle sample (every eighth with one
symbol a sample); live set-points and coded commands have one in every sample (two at 100 down; every
other sample with one symbol a sample). The helicopter sends 20 samples a second, so 10 symbols/s down
are less than one a sample and are refused.

{seeds} seeds from {first} on; {lengths} each; the first table has four seeds of 2500 samples. Layouts
and the numbers of the list were chosen while looking at the seeds 1 to 4, 11 to 28 and 101 to 130, and
are frozen. Errors are rms over all outputs, tracking over those that have a set-point, without the
first {skipped} samples. CPU is the processor time of the transmitter's list over the time flown, in
plain Python, on two cores that were doing other work as well: it is lower on an idle machine.
"""


def write_page(path: Path, found: Points, quick: bool) -> None:
    """Write the page."""
    parts = [
        INTRODUCTION.format(
            quick="; this is the quick form, of few and short flights" if quick else "",
        ),
        *([] if quick else [_aims(found)]),
        _needed(found),
        f"![Error over that of the full downlink]({ERRORS})\n",
        "Pitch axis. Bars are 95 % intervals over the seeds. Points above 10 are drawn at 10.\n",
        f"![Confirmation delay, list, CPU and rejoins against loss]({LISTS})\n",
        _all(found),
        _how(found),
    ]
    write_whole(path, "\n".join(parts).rstrip() + "\n")


def _aims(found: Points) -> str:
    rows = [
        "## Aims and measurements",
        "",
        "Pitch axis, 10 bit/s up, 10 % off the model, q = 2e-3 rad²/s³. Error and tracking are rms,",
        "over those of `full`; ± is a 95 % interval.",
        "",
        "| | aim, at most | measured | reached |",
        "|---|---|---|---|",
    ]
    for name, point in aims().items():
        kind, most = AIMS[name]
        one = found[point]
        value = one.error if kind == "error" else one.tracking
        half = f" ± {one.error_half:.3f}" if kind == "error" else ""
        beside = f", tracking {one.tracking:.3f}" if kind == "error" else f", error {one.error:.3f}"
        rows.append(
            f"| {name}: {kind} | {most:g} | {value:.3f}{half}{beside} | {_reached(value, most)} |"
        )
    for end, at_receiver in (("receiver", True), ("transmitter", False)):
        median, largest = corruptions(at_receiver, CORRUPTED)
        text = f"{median:g} (largest of {CORRUPTED}: {largest})"
        rows.append(
            f"| a corrupt state at the {end} is found, samples, median, clean | 12 | {text} "
            f"| {_reached(median, 12)} |"
        )
    wrong, confirmed = (
        sum(getattr(one, name) for one in found.values()) for name in ("wrong", "confirmed")
    )
    rows.append(
        f"| wrong confirmations in all flights here | 0 | {wrong} of {confirmed:,} "
        f"| {_reached(wrong, 0)} |"
    )
    for subject, baud in (("pitch", 20), ("helicopter", 40)):
        lossy = found.get(Point(subject, "announced", baud, loss=0.05))
        if lossy is None:
            continue
        rows += [
            f"| {subject}, {baud} down (two symbols a sample), announced, loss 5 %: CPU of the list, "
            f"% of a core | 10 | {100.0 * lossy.cpu:.1f} | {_reached(100.0 * lossy.cpu, 10.0)} |",
            "| the same: times real time, both ends and the plant in one process | at least 20 "
            f"| {lossy.speed:.0f} | {'yes' if lossy.speed >= 20 else 'no'} |",
        ]
    return "\n".join(rows) + "\n"


def _reached(value: float, most: float) -> str:
    return "yes" if value <= most else "no"


def _lines() -> list[tuple[str, dict[str, float]]]:
    return [
        *((f"loss {100 * one:g} %" if one else "clean", {"loss": one}) for one in LOSSES),
        *((f"flips {100 * one:g} %", {"flip": one}) for one in FLIPS),
        *((f"round trip {one}", {"trip": float(one)}) for one in TRIPS),
    ]


def _needed(found: Points) -> str:
    rows = [
        "## Which rate a line needs",
        "",
        f"The least of {', '.join(map(str, BAUDS))} symbols/s down with which error and tracking are",
        f"at most {ENOUGH} times those of `full`. Round trips are in samples; faults act both ways.",
        "Two seeds leave a few hundredths to chance: the intervals below say where a rate is near the "
        "edge.",
        "",
    ]
    kinds = [
        (subject, scheme)
        for subject in SUBJECTS
        for scheme in ("announced", "coded")
        if any((one.subject, one.scheme) == (subject, scheme) for one in found)
    ]
    rows.append("| line | " + " | ".join(f"{one}, {NAMES[two]}" for one, two in kinds) + " |")
    rows.append("|---|" + "---|" * len(kinds))
    for name, line in _lines():
        cells = []
        for subject, scheme in kinds:
            points = [one for one in found if _is_of(one, subject, scheme) and _is_on(one, line)]
            good = [
                one.baud
                for one in points
                if found[one].error <= ENOUGH and found[one].tracking <= ENOUGH
            ]
            cells.append(str(min(good)) if good else "none of these" if points else "not flown")
        if set(cells) != {"not flown"}:
            rows.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(rows) + "\n"


def _is_of(point: Point, subject: str, scheme: str) -> bool:
    return (point.subject, point.scheme) == (subject, scheme) and point.samples != AIM_SAMPLES


def _is_on(point: Point, line: dict[str, float]) -> bool:
    return all(getattr(point, name) == line.get(name, 0) for name in ("loss", "flip", "trip"))


COLUMNS = """\
Error, tracking and largest error are over those of `full`. *Confirmed after* is in samples, *list* the
mean number of hypotheses, and *applied off* the rms of the inputs as applied less those that the
receiver's state commands."""


def _all(found: Points) -> str:
    rows = ["## All points", "", COLUMNS, ""]
    for subject in SUBJECTS:
        for scheme, name in NAMES.items():
            points = [one for one in found if _is_of(one, subject, scheme)]
            if points:
                rows += [f"### {subject}: {name}", "", *_table(points, found), ""]
    return "\n".join(rows)


def _table(points: list[Point], found: Points) -> list[str]:
    rows = [
        "| down | line | error | tracking | largest error | confirmed after, median / 99.9 % | list "
        "| rejoins/h | CPU, % | applied off |",
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    names = {tuple(sorted(line.items())): name for name, line in _lines()}
    for point in sorted(points, key=lambda one: (one.baud, one.trip, one.flip, one.loss)):
        given = {"loss": point.loss, "flip": point.flip, "trip": point.trip}
        line = {name: value for name, value in given.items() if value} or {"loss": 0.0}
        rows.append(f"| {point.baud} | {names[tuple(sorted(line.items()))]} | {_cells(found[point])} |")
    return rows


def _cells(one: Found) -> str:
    if math.isinf(one.error):
        return "diverged | | | | | | | "
    delay = f"{one.delay:.0f} / {one.delay_late:.0f}" if one.confirmed else "never"
    return (
        f"{one.error:.3f} ± {one.error_half:.3f} | {one.tracking:.3f} | {one.largest:.2f} "
        f"| {delay} | {one.size:.1f} | {one.rejoins_h:.1f} "
        f"| {100.0 * one.cpu:.1f} | {one.applied:.3f} V"
    )


def _how(found: Points) -> str:
    lengths = " and ".join(f"{count} samples ({name})" for name, count in SAMPLES.items())
    return HOW.format(
        bits=BITS,
        seeds=min(one.seeds for one in found),
        first=FIRST_SEED,
        lengths=lengths,
        skipped=SCORED_FROM,
    )
