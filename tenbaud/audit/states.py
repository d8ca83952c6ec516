"""Both recordings against the replayed flight: every row present, every field as computed."""

from __future__ import annotations

from collections.abc import Iterable

from channel.codec.models.pitch import PitchModel
from tenbaud.audit.base import Evidence, claim
from transmitter.metrics.gap import GAP_EVERY_S

DIFFERS = "it is not what the symbols give"
BOTH = "recorded {}, computed {}"

SAMPLE_FIELDS = ("word", "range", "state", "coder", "digest")
ESTIMATE_FIELDS = ("coded_state", "live_state")
COMMAND_FIELDS = ("reference", "live_state", "command")


@claim(
    "states of both ends follow from the words",
    ("transmitter", "sample", *SAMPLE_FIELDS, "peer_digest", "about"),
    ("receiver", "sample", *SAMPLE_FIELDS),
)
def check_samples(evidence: Evidence) -> None:
    """Words, ranges, states and digests of either end."""
    if evidence.expected is None:
        return
    outputs = len(evidence.agreement.signals.outputs)
    # Recordings of before do not say what a word was about, in any row.
    says_about = any(row.about is not None for row in evidence.topic("transmitter", "sample"))
    says_about = says_about or evidence.agreement.two_way is not None
    corrected = evidence.agreement.codec.model.correction_size
    for end in evidence.rows:
        whole = end == "transmitter" and evidence.terms.downlink == "full"
        fields = (*SAMPLE_FIELDS, "peer_digest") if whole else SAMPLE_FIELDS
        without = tuple(name for name in fields if name != "range")
        for place, row in evidence.each(end, "sample"):
            if end == "transmitter" and row.sample in evidence.doubted:
                continue
            # None: flown with another receiver, or after the receiver's recording was cut.
            if (wanted := evidence.expected.samples.get(row.sample)) is not None:
                # Once a direction coder had a range for each corrected state.
                is_old = len(row.range or ()) == corrected != outputs
                place.compare(without if is_old else fields, row, wanted, DIFFERS, BOTH)
                if end == "transmitter" and (says_about or row.word is None):
                    place.compare(("about",), row, wanted, DIFFERS, BOTH)


@claim(
    "predicted states of each tick follow from the words", ("transmitter", "estimate", *ESTIMATE_FIELDS)
)
def check_estimates(evidence: Evidence) -> None:
    """The transmitter's estimates: one for each tick of each sample that it confirmed."""
    if evidence.expected is None or "transmitter" not in evidence.rows:
        return
    count = evidence.terms.ticks_per_sample
    confirmed = {row.sample for row in evidence.topic("transmitter", "sample")}
    ticks = (k * count + tick for k in sorted(confirmed) for tick in range(count))
    _check_keys(evidence, ("transmitter", "estimate", "tick"), ticks)
    for place, row in evidence.each("transmitter", "estimate"):
        if row.tick // count in evidence.doubted:
            continue
        if (wanted := evidence.expected.estimates.get(row.tick)) is not None:
            place.compare(ESTIMATE_FIELDS, row, wanted, DIFFERS, BOTH)


@claim("commands follow from the states and the set-point", ("receiver", "tick", *COMMAND_FIELDS))
def check_commands(evidence: Evidence) -> None:
    """The receiver's commands, its predicted states and its references: all ticks of all samples."""
    if evidence.expected is None or "receiver" not in evidence.rows:
        return
    _check_keys(evidence, ("receiver", "tick", "tick"), evidence.expected.commands)
    for place, row in evidence.each("receiver", "tick"):
        if (wanted := evidence.expected.commands.get(row.tick)) is not None:
            place.compare(COMMAND_FIELDS, row, wanted, DIFFERS, BOTH)


@claim("the gauge was read", ("transmitter", "gap", "sample"))
def check_gauge(evidence: Evidence) -> None:
    """The gauge is read once a second, at confirmed samples, if there is one."""
    if not evidence.topic("transmitter", "gap").recorded and not _has_gauge(evidence):
        return
    every = max(1, round(GAP_EVERY_S * 1e9 / evidence.terms.sample_ns))
    samples = (row.sample for row in evidence.topic("transmitter", "sample"))
    due = [sample for sample in samples if (sample + 1) % every == 0]
    _check_keys(evidence, ("transmitter", "gap", "sample"), due)


def _has_gauge(evidence: Evidence) -> bool:
    """Whether the summary is of a flight with a gauge, one of an earlier version not."""
    summary = evidence.summary("transmitter")
    is_pitch = isinstance(evidence.agreement.codec.model, PitchModel)
    return "disturbance_density" in summary and (is_pitch or summary["disturbance_density"] is not None)


@claim("a set-point moved by hand is an event")
def check_steering(evidence: Evidence) -> None:
    """A set-point that is not the configuration's was given by hand, and that is an event."""
    if evidence.steps and not evidence.is_steered:
        tick, angle = evidence.steps[0]
        place = evidence.at("receiver", "tick", f"tick {tick}")
        place.leak("reference", "no manual change of the set-point is recorded", f"{angle!r} rad")


def _check_keys(evidence: Evidence, where: tuple[str, str, str], keys: Iterable[int]) -> None:
    """Each of these keys has a row, and no other has; a recording that was cut may end early."""
    end, topic, name = where
    found = set(evidence.topic(end, topic).by_key())
    wanted = set(keys)
    complete = evidence.is_whole(end)
    count, lead = evidence.terms.ticks_per_sample, 0
    if end == "receiver":
        lead = evidence.terms.lead_ticks
    last = max(found, default=-1)
    for key in sorted(wanted - found):
        if complete or key < last:
            evidence.at(end, topic, f"{name} {key}").gap(name, "it is missing")
    for key in sorted(found - wanted) if complete else ():
        sample = f"sample {(key - lead) // count}" if name == "tick" else ""
        place = evidence.at(end, topic, f"{name} {key}")
        place.leak(name, "no sample that was recorded brings it", sample)
