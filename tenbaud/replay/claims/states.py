"""Both recordings against the flight flown again: each row there, each field as the words give it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from tenbaud.replay.claims.base import Claim, Evidence, Findings, Place, is_same

DIFFERS = "it is not what the symbols give"
MISSING = "it is missing"
ORPHAN = "no sample that was recorded brings it"

SAMPLE_FIELDS = ("word", "range", "state", "coder", "digest")
ESTIMATE_FIELDS = ("coded_state", "live_state")
COMMAND_FIELDS = ("reference_rad", "live_state", "command_volts")


def check_samples(evidence: Evidence, findings: Findings) -> None:
    """Words, ranges, states and digests of either end."""
    expected = evidence.expected
    if expected is None:
        return
    for end in evidence.rows:
        for row in evidence.topic(end, "sample"):
            wanted = expected.samples.get(row.sample)
            if wanted is None:
                # A transmitter that flew on with a receiver whose recording is another one.
                if _is_flown_here(evidence, row.sample):
                    place = Place(end, "sample", f"sample {row.sample}", "sample")
                    findings.leak(place, "no epoch that was recorded has it")
                continue
            fields = SAMPLE_FIELDS if end == "receiver" else (*SAMPLE_FIELDS, "peer_digest")
            _compare(Place(end, "sample", f"sample {row.sample}"), row, wanted, fields, findings)


def check_estimates(evidence: Evidence, findings: Findings) -> None:
    """The transmitter's estimates: one for each tick of each sample that it confirmed."""
    expected = evidence.expected
    if expected is None or evidence.end("transmitter") is None:
        return
    count = evidence.agreement.terms.ticks_per_sample
    confirmed = {row.sample for row in evidence.topic("transmitter", "sample")}
    ticks = (k * count + tick for k in sorted(confirmed) for tick in range(count))
    _check_ticks(evidence, "transmitter", "estimate", ticks, findings)
    for row in evidence.topic("transmitter", "estimate"):
        wanted = expected.estimates.get(row.tick)
        place = Place("transmitter", "estimate", f"tick {row.tick}")
        if wanted is not None:
            _compare(place, row, wanted, ESTIMATE_FIELDS, findings)


def check_commands(evidence: Evidence, findings: Findings) -> None:
    """The receiver's commands, what it believed and what it followed: all ticks of all samples."""
    expected = evidence.expected
    if expected is None or evidence.end("receiver") is None:
        return
    _check_ticks(evidence, "receiver", "tick", expected.commands, findings)
    for row in evidence.topic("receiver", "tick"):
        wanted = expected.commands.get(row.tick)
        place = Place("receiver", "tick", f"tick {row.tick}")
        if wanted is not None:
            _compare(place, row, wanted, COMMAND_FIELDS, findings)


def check_steering(evidence: Evidence, findings: Findings) -> None:
    """A set-point that is not the configuration's was given by hand, and that is an event."""
    if evidence.steps and not evidence.is_steered:
        tick, angle = evidence.steps[0]
        place = Place("receiver", "tick", f"tick {tick}", "reference_rad")
        findings.leak(place, "nobody was recorded to have moved the set-point", f"{angle!r} rad")


def _check_ticks(
    evidence: Evidence, end: str, topic: str, ticks: Iterable[int], findings: Findings
) -> None:
    """Each of these ticks has a row, and no other has; a recording that was cut may end early."""
    found = set(evidence.topic(end, topic).by_key())
    wanted = set(ticks)
    rows = evidence.rows[end]
    last = max(found, default=-1)
    for tick in sorted(wanted - found):
        if rows.complete or tick < last:
            findings.gap(Place(end, topic, f"tick {tick}", "tick"), MISSING)
    for tick in sorted(found - wanted):
        if rows.complete:
            findings.leak(Place(end, topic, f"tick {tick}", "tick"), ORPHAN)


def _is_flown_here(evidence: Evidence, sample: int) -> bool:
    """Whether a sample lies within what the recording with the words covers."""
    epochs = evidence.epochs
    return bool(epochs) and epochs[0].start.sample <= sample


def _compare(
    place: Place, row: Any, wanted: dict[str, Any], fields: Iterable[str], findings: Findings
) -> None:
    for name in fields:
        recorded, computed = getattr(row, name), wanted[name]
        if not is_same(recorded, computed):
            findings.leak(
                place._replace(field=name), DIFFERS, f"recorded {recorded}, computed {computed}"
            )


SAMPLES = Claim(
    "states of both ends follow from the words",
    check_samples,
    (
        ("transmitter", "sample", (*SAMPLE_FIELDS, "peer_digest")),
        ("receiver", "sample", SAMPLE_FIELDS),
    ),
)
ESTIMATES = Claim(
    "what was believed of each tick follows from the words",
    check_estimates,
    (("transmitter", "estimate", ESTIMATE_FIELDS),),
)
COMMANDS = Claim(
    "commands follow from the states and the set-point",
    check_commands,
    (("receiver", "tick", COMMAND_FIELDS),),
)
STEERING = Claim("a set-point moved by hand is an event", check_steering, ())
