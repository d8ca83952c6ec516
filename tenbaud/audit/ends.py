"""The two accounts of one flight against each other, and each against its own epochs."""

from __future__ import annotations

from bisect import bisect_left
from typing import Any

from tenbaud.audit.base import Claim, Evidence, Findings, Place, is_same
from tenbaud.replay.rows import KEY_MAX

EPOCH_FIELDS = ("sample", "epoch", "state", "coder", "hold")
SAMPLE_FIELDS = ("word", "range", "state", "coder", "digest")


def check_accounts(evidence: Evidence, findings: Findings) -> None:
    """A sample that both recorded has the same word, range, state and digest in both."""
    theirs = evidence.topic("receiver", "sample").by_key()
    receiver = evidence.end("receiver")
    epochs = _epochs_of_both(evidence)
    for row in evidence.topic("transmitter", "sample"):
        place = Place("transmitter", "sample", f"sample {row.sample}")
        other = theirs.get(row.sample)
        if row.digest != row.peer_digest:
            findings.leak(
                place._replace(field="peer_digest"),
                "the two ends differed here",
                f"{row.digest} and {row.peer_digest}",
            )
        if other is None:
            if receiver is not None and receiver.complete and _covers(epochs, evidence, row.sample):
                findings.gap(
                    Place("receiver", "sample", f"sample {row.sample}", "sample"),
                    "it is missing, and the transmitter has its echo",
                )
            continue
        for name in SAMPLE_FIELDS:
            ours, received = getattr(row, name), getattr(other, name)
            if not is_same(ours, received):
                findings.leak(
                    place._replace(field=name),
                    "the receiver recorded something else",
                    f"{ours} and {received}",
                )
        if row.peer_digest != other.digest:
            findings.leak(
                place._replace(field="peer_digest"),
                "the receiver recorded something else",
                f"{row.peer_digest} and {other.digest}",
            )


def check_epochs(evidence: Evidence, findings: Findings) -> None:
    """Epochs are counted by ones, and the transmitter's begin as the receiver's do."""
    for end in evidence.rows:
        before: Any = None
        for row in evidence.topic(end, "epoch"):
            place = Place(end, "epoch", f"epoch {row.epoch}")
            # An epoch 0 again is another receiver's, or the same one started again.
            if before is not None and row.epoch not in (0, before.epoch + 1) and end == "receiver":
                findings.gap(place._replace(field="epoch"), "it follows another than the one before")
            if before is not None and (
                row.sample < before.sample or (row.epoch != 0 and row.epoch <= before.epoch)
            ):
                findings.leak(place._replace(field="sample"), "it is out of order")
            if row == before:
                findings.leak(place, "it is recorded twice")
            before = row
    theirs = {row.epoch: row for row in evidence.topic("receiver", "epoch")}
    receiver = evidence.end("receiver")
    first = min((row.sample for row in theirs.values()), default=0)
    for row in _of_this_receiver(evidence):
        other = theirs.get(row.epoch)
        if other is None:
            if receiver is not None and receiver.complete and row.sample >= first and theirs:
                findings.gap(
                    Place("receiver", "epoch", f"epoch {row.epoch}"),
                    "it is missing, and the transmitter began it",
                )
            continue
        for name in EPOCH_FIELDS:
            ours, received = getattr(row, name), getattr(other, name)
            if not is_same(ours, received):
                findings.leak(
                    Place("transmitter", "epoch", f"epoch {row.epoch}", name),
                    "the receiver recorded something else",
                    f"{ours} and {received}",
                )


def check_confirmed(evidence: Evidence, findings: Findings) -> None:
    """The transmitter confirms the samples of each epoch one after another, from its first one."""
    epochs = [row.sample for row in evidence.topic("transmitter", "epoch")]
    if not epochs:
        return
    place = 0
    expected: int | None = None
    for row in evidence.topic("transmitter", "sample"):
        while place < len(epochs) and epochs[place] <= row.sample:
            expected = epochs[place]
            place += 1
        if expected is None or row.sample > expected:
            findings.gap(
                Place("transmitter", "sample", f"sample {expected}", "sample"),
                "it is missing",
                f"the next one is {row.sample}",
            )
        expected = row.sample + 1


def check_begun(evidence: Evidence, findings: Findings) -> None:
    """The transmitter recorded each of the receiver's epochs of which it confirmed samples."""
    ours = {(row.epoch, row.sample) for row in evidence.topic("transmitter", "epoch")}
    theirs = evidence.topic("receiver", "epoch").rows
    confirmed = sorted(evidence.topic("transmitter", "sample").by_key())
    for row, end in zip(theirs, _ends_of(theirs), strict=True):
        first = bisect_left(confirmed, row.sample)
        begun = first < len(confirmed) and confirmed[first] < end
        if begun and (row.epoch, row.sample) not in ours:
            place = Place("transmitter", "epoch", f"epoch {row.epoch}", "sample")
            findings.gap(place, "it is missing, and samples of it were confirmed")


def _epochs_of_both(evidence: Evidence) -> list[tuple[int, int]]:
    """Return (first sample, first sample of the next epoch) of the epochs that both recorded."""
    ours = {(row.epoch, row.sample) for row in evidence.topic("transmitter", "epoch")}
    theirs = evidence.topic("receiver", "epoch").rows
    pairs = zip(theirs, _ends_of(theirs), strict=True)
    return [(row.sample, end) for row, end in pairs if (row.epoch, row.sample) in ours]


def _ends_of(epochs: list[Any]) -> list[int]:
    """Return where each epoch ends: the last one nowhere."""
    return [*(row.sample for row in epochs[1:]), *[KEY_MAX + 1] * bool(epochs)]


def _covers(epochs: list[tuple[int, int]], evidence: Evidence, sample: int) -> bool:
    return any(first <= sample < end for first, end in epochs)


def _of_this_receiver(evidence: Evidence) -> list[Any]:
    """Return the transmitter's epochs with the receiver whose recording is here.

    Each receiver, and one that was started again, counts its epochs from 0.
    """
    flights: list[list[Any]] = []
    for row in evidence.topic("transmitter", "epoch"):
        if not flights or row.epoch == 0:
            flights.append([])
        flights[-1].append(row)
    if len(flights) == 1:
        return flights[0]
    theirs = {(row.epoch, row.sample) for row in evidence.topic("receiver", "epoch")}
    return [row for one in flights if any((e.epoch, e.sample) in theirs for e in one) for row in one]


ACCOUNTS = Claim(
    "both ends recorded the same samples",
    check_accounts,
    (
        ("transmitter", "sample", (*SAMPLE_FIELDS, "peer_digest")),
        ("receiver", "sample", SAMPLE_FIELDS),
    ),
)
EPOCHS = Claim(
    "both ends recorded the same epochs",
    check_epochs,
    (("transmitter", "epoch", EPOCH_FIELDS), ("receiver", "epoch", EPOCH_FIELDS)),
)
BEGUN = Claim(
    "the transmitter recorded the epochs that it flew",
    check_begun,
    (("transmitter", "epoch", ("sample", "epoch")),),
)
CONFIRMED = Claim(
    "the transmitter confirmed sample by sample",
    check_confirmed,
    (("transmitter", "sample", ("sample",)),),
)
