"""Both recordings against the flight flown again: each row there, each field as the words give it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from tenbaud.audit.base import Claim, Evidence, Findings, Place, is_same
from transmitter.metrics.gap import GAP_EVERY_S

DIFFERS = "it is not what the symbols give"
MISSING = "it is missing"
ORPHAN = "no sample that was recorded brings it"

SAMPLE_FIELDS = ("word", "range", "state", "coder", "digest")
ESTIMATE_FIELDS = ("coded_state", "live_state")
COMMAND_FIELDS = ("reference", "live_state", "command")


def check_samples(evidence: Evidence, findings: Findings) -> None:
    """Words, ranges, states and digests of either end."""
    expected = evidence.expected
    if expected is None:
        return
    for end in evidence.rows:
        for row in evidence.topic(end, "sample"):
            wanted = expected.samples.get(row.sample)
            if wanted is None:
                continue  # flown with another receiver, or after the receiver's recording was cut
            fields: tuple[str, ...] = SAMPLE_FIELDS
            if end == "transmitter":
                # Recordings of before do not say what a word was about.
                says = row.about is not None or row.word is None
                fields = (*fields, "peer_digest", *(("about",) if says else ()))
            _compare(Place(end, "sample", f"sample {row.sample}"), row, wanted, fields, findings)


def check_estimates(evidence: Evidence, findings: Findings) -> None:
    """The transmitter's estimates: one for each tick of each sample that it confirmed."""
    expected = evidence.expected
    if expected is None or evidence.end("transmitter") is None:
        return
    count = evidence.agreement.terms.ticks_per_sample
    confirmed = {row.sample for row in evidence.topic("transmitter", "sample")}
    ticks = (k * count + tick for k in sorted(confirmed) for tick in range(count))
    _check_keys(evidence, ("transmitter", "estimate", "tick"), ticks, findings)
    for row in evidence.topic("transmitter", "estimate"):
        wanted = expected.estimates.get(row.tick)
        place = Place("transmitter", "estimate", f"tick {row.tick}")
        if wanted is not None:
            _compare(place, row, wanted, ESTIMATE_FIELDS, findings)


def check_commands(evidence: Evidence, findings: Findings) -> None:
    """The receiver's commands, its predicted states and its references: all ticks of all samples."""
    expected = evidence.expected
    if expected is None or evidence.end("receiver") is None:
        return
    _check_keys(evidence, ("receiver", "tick", "tick"), expected.commands, findings)
    for row in evidence.topic("receiver", "tick"):
        wanted = expected.commands.get(row.tick)
        place = Place("receiver", "tick", f"tick {row.tick}")
        if wanted is not None:
            _compare(place, row, wanted, COMMAND_FIELDS, findings)


def check_gauge(evidence: Evidence, findings: Findings) -> None:
    """The gauge is read once a second, at confirmed samples, if there is one."""
    if not evidence.topic("transmitter", "gap").recorded:
        return
    every = max(1, round(GAP_EVERY_S * 1e9 / evidence.agreement.terms.sample_ns))
    samples = (row.sample for row in evidence.topic("transmitter", "sample"))
    due = [sample for sample in samples if (sample + 1) % every == 0]
    _check_keys(evidence, ("transmitter", "gap", "sample"), due, findings)


def check_steering(evidence: Evidence, findings: Findings) -> None:
    """A set-point that is not the configuration's was given by hand, and that is an event."""
    if evidence.steps and not evidence.is_steered:
        tick, angle = evidence.steps[0]
        place = Place("receiver", "tick", f"tick {tick}", "reference")
        findings.leak(place, "nobody was recorded to have moved the set-point", f"{angle!r} rad")


def _check_keys(
    evidence: Evidence, where: tuple[str, str, str], keys: Iterable[int], findings: Findings
) -> None:
    """Each of these keys has a row, and no other has; a recording that was cut may end early."""
    end, topic, name = where
    found = set(evidence.topic(end, topic).by_key())
    wanted = set(keys)
    complete = evidence.rows[end].complete
    terms = evidence.agreement.terms
    count, lead = terms.ticks_per_sample, terms.lead_ticks if end == "receiver" else 0
    last = max(found, default=-1)
    for key in sorted(wanted - found):
        if complete or key < last:
            findings.gap(Place(end, topic, f"{name} {key}", name), MISSING)
    for key in sorted(found - wanted):
        if complete:
            sample = f"sample {(key - lead) // count}" if name == "tick" else ""
            findings.leak(Place(end, topic, f"{name} {key}", name), ORPHAN, sample)


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
        ("transmitter", "sample", (*SAMPLE_FIELDS, "peer_digest", "about")),
        ("receiver", "sample", SAMPLE_FIELDS),
    ),
)
ESTIMATES = Claim(
    "predicted states of each tick follow from the words",
    check_estimates,
    (("transmitter", "estimate", ESTIMATE_FIELDS),),
)
COMMANDS = Claim(
    "commands follow from the states and the set-point",
    check_commands,
    (("receiver", "tick", COMMAND_FIELDS),),
)
GAUGE = Claim("the gauge was read", check_gauge, (("transmitter", "gap", ("sample",)),))
STEERING = Claim("a set-point moved by hand is an event", check_steering, ())
