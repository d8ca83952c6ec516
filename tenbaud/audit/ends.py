"""The two recordings of one flight against each other, and each against its own epochs."""

from __future__ import annotations

from bisect import bisect_left
from typing import Any

from tenbaud.audit.base import Evidence, claim
from tenbaud.replay.rows import KEY_MAX

EPOCH_FIELDS = ("sample", "epoch", "state", "coder", "hold")
SAMPLE_FIELDS = ("word", "range", "state", "coder", "digest")
UNLIKE = "the receiver recorded something else"
BOTH = "{} and {}"


@claim(
    "both ends recorded the same epochs",
    ("transmitter", "epoch", *EPOCH_FIELDS),
    ("receiver", "epoch", *EPOCH_FIELDS),
)
def check_epochs(evidence: Evidence) -> None:
    """Epochs are counted by ones, and the transmitter's begin as the receiver's do."""
    for end in evidence.rows:
        before: Any = None
        for place, row in evidence.each(end, "epoch"):
            # An epoch 0 again is another receiver's, or the same one started again.
            if before is not None and row.epoch not in (0, before.epoch + 1) and end == "receiver":
                place.gap("epoch", "it follows another than the one before")
            if before is not None and (
                row.sample < before.sample or (row.epoch != 0 and row.epoch <= before.epoch)
            ):
                place.leak("sample", "it is out of order")
            if row == before:
                place.leak("", "it is recorded twice")
            before = row
    theirs = {row.epoch: row for row in evidence.topic("receiver", "epoch")}
    first = min((row.sample for row in theirs.values()), default=0)
    for row in _of_this_receiver(evidence):
        other, label = theirs.get(row.epoch), f"epoch {row.epoch}"
        if other is not None:
            place = evidence.at("transmitter", "epoch", label)
            place.compare(EPOCH_FIELDS, row, other, UNLIKE, BOTH)
        elif evidence.is_whole("receiver") and row.sample >= first and theirs:
            place = evidence.at("receiver", "epoch", label)
            place.gap("", "it is missing, and the transmitter began it")


@claim("the transmitter recorded the epochs that it flew", ("transmitter", "epoch", "sample", "epoch"))
def check_begun(evidence: Evidence) -> None:
    """The transmitter recorded each of the receiver's epochs of which it confirmed samples."""
    ours = {(row.epoch, row.sample) for row in evidence.topic("transmitter", "epoch")}
    theirs = evidence.topic("receiver", "epoch").rows
    confirmed = sorted(evidence.topic("transmitter", "sample").by_key())
    for row, end in zip(theirs, _ends_of(theirs), strict=True):
        first = bisect_left(confirmed, row.sample)
        begun = first < len(confirmed) and confirmed[first] < end
        if begun and (row.epoch, row.sample) not in ours:
            place = evidence.at("transmitter", "epoch", f"epoch {row.epoch}")
            place.gap("sample", "it is missing, and samples of it were confirmed")


@claim("the transmitter confirmed sample by sample", ("transmitter", "sample", "sample"))
def check_confirmed(evidence: Evidence) -> None:
    """The transmitter confirms the samples of each epoch one after another, from its first one."""
    epochs = [row.sample for row in evidence.topic("transmitter", "epoch")]
    if not epochs:
        return
    index = 0
    expected: int | None = None
    for row in evidence.topic("transmitter", "sample"):
        while index < len(epochs) and epochs[index] <= row.sample:
            expected = epochs[index]
            index += 1
        if expected is None or row.sample > expected:
            place = evidence.at("transmitter", "sample", f"sample {expected}")
            place.gap("sample", "it is missing", f"the next one is {row.sample}")
        expected = row.sample + 1


@claim(
    "both ends recorded the same samples",
    ("transmitter", "sample", *SAMPLE_FIELDS, "peer_digest"),
    ("receiver", "sample", *SAMPLE_FIELDS),
)
def check_accounts(evidence: Evidence) -> None:
    """A sample that both recorded has the same word, range, state and digest in both."""
    theirs = evidence.topic("receiver", "sample").by_key()
    epochs = _epochs_of_both(evidence)
    for place, row in evidence.each("transmitter", "sample"):
        other = theirs.get(row.sample)
        # Of the receiver's digest the last digits are known, or none: its frame was lost.
        if not row.digest.endswith(row.peer_digest):
            detail = f"{row.digest} and {row.peer_digest}"
            place.leak("peer_digest", "the two ends differed here", detail)
        if other is not None:
            if row.sample not in evidence.doubted:
                place.compare(SAMPLE_FIELDS, row, other, UNLIKE, BOTH)
            if not other.digest.endswith(row.peer_digest):
                place.leak("peer_digest", UNLIKE, BOTH.format(row.peer_digest, other.digest))
        elif evidence.is_whole("receiver") and any(a <= row.sample < b for a, b in epochs):
            there = evidence.at("receiver", "sample", place.row)
            there.gap("sample", "it is missing, and the transmitter has its echo")


def _epochs_of_both(evidence: Evidence) -> list[tuple[int, int]]:
    """Return (first sample, first sample of the next epoch) of the epochs that both recorded."""
    ours = {(row.epoch, row.sample) for row in evidence.topic("transmitter", "epoch")}
    theirs = evidence.topic("receiver", "epoch").rows
    pairs = zip(theirs, _ends_of(theirs), strict=True)
    return [(row.sample, end) for row, end in pairs if (row.epoch, row.sample) in ours]


def _ends_of(epochs: list[Any]) -> list[int]:
    """Return where each epoch ends: the last one nowhere."""
    return [*(row.sample for row in epochs[1:]), *[KEY_MAX + 1] * bool(epochs)]


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
