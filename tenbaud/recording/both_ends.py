"""The two ends of one flight side by side: each sample of each epoch that both flew.

The receiver flies on until it hears of a new epoch, and its last echoes may be lost. So at the end of
an epoch the transmitter may lack samples, which is no fault; anything else that an end lacks is one.
"""

from __future__ import annotations

from collections.abc import Iterator
from operator import attrgetter, lt
from pathlib import Path
from typing import NamedTuple

from tenbaud.recording.comparison import Compared, Difference, paired, unlike_field
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import TRANSMITTER_NAME
from tenbaud.recording.reader import Recording
from tenbaud.recording.rows import Row

TOPIC, KEY = "sample", "sample"
Epoch = tuple[object, object]
"""(number, first sample)"""


class _Sample(NamedTuple):
    epoch: Epoch
    sample: int
    time_ns: int
    row: Row


def compare_ends(first: Recording, second: Recording, compared: Compared) -> None:
    """Compare the samples that both recorded, and note those missing in one."""
    ends = [first, second]
    if not _is_transmitter(first) and _is_transmitter(second):
        ends.reverse()
    upper, lower = ends
    # An end that recorded no sample at all cannot be checked, and `topic` says so.
    names = [
        [field.name for field in end.topic(TOPIC).channel.fields if not field.timing] for end in ends
    ]
    fields = [name for name in names[0] if name in names[1]]
    shared = set(_epochs(upper)) & set(_epochs(lower))
    walk = _Walk(upper, lower, shared, fields, compared)
    seen = walk.run()
    _check_failures(ends, shared, seen, compared)
    _compare_assumed(upper, lower, compared)
    alone = len(set(_epochs(lower)) - shared) + len(set(_epochs(upper)) - shared)
    if alone:
        compared.notes.append(f"epochs that one end alone began: {alone}; not compared")
    if walk.unheard:
        compared.notes.append(
            f"samples of the receiver that the transmitter never confirmed: {walk.unheard}"
        )


class _Walk:
    """Both files streaming by, sample by sample."""

    def __init__(
        self,
        upper: Recording,
        lower: Recording,
        shared: set[Epoch],
        fields: list[str],
        compared: Compared,
    ) -> None:
        self.unheard = 0
        """samples at the ends of epochs that the transmitter lacks"""
        self._upper, self._lower = upper, lower
        self._shared, self._fields, self._compared = shared, fields, compared
        self._pending: list[_Sample] = []
        self._found = False
        self._failures = {sample for end in (upper, lower) for _, sample in _failures(end)}

    def run(self) -> set[int]:
        """Compare; return the samples with a recorded failure that were compared."""
        left, right = _samples(self._upper, self._compared), _samples(self._lower, self._compared)
        seen: set[int] = set()
        for here, there in paired(left, right, attrgetter("sample"), lt):
            if here is None:
                self._only_lower(there)
            elif there is not None:
                self._both(here, there)
                seen |= {here.sample} & self._failures
            elif here.epoch in self._shared:
                self._compared.lacks(self._lower.path, TOPIC, KEY, here.sample)
        self.unheard += len(self._pending)
        return seen

    def _only_lower(self, there: _Sample | None) -> None:
        if there is not None and there.epoch in self._shared:
            if self._pending and self._pending[-1].epoch != there.epoch:
                self.unheard += len(self._pending)
                self._pending.clear()
            self._pending.append(there)

    def _both(self, here: _Sample, there: _Sample) -> None:
        compared = self._compared
        # What was pending lies before a sample that the transmitter does have.
        for one in self._pending:
            if one.epoch == here.epoch:
                compared.lacks(self._upper.path, TOPIC, KEY, one.sample)
            else:
                self.unheard += 1
        self._pending.clear()
        if here.epoch != there.epoch:
            compared.faults.append(
                f"sample {here.sample} is in epoch {here.epoch[0]} for the transmitter and in epoch "
                f"{there.epoch[0]} for the receiver"
            )
            return
        compared.rows += 1
        unlike = None if self._found else unlike_field(here.row, there.row, self._fields)
        if unlike is not None:
            self._found = True
            where = (TOPIC, KEY, here.sample, here.time_ns)
            paths = (self._upper.path, self._lower.path)
            compared.differences.append(Difference(*where, *unlike, *paths))


def _check_failures(
    ends: list[Recording], shared: set[Epoch], seen: set[int], compared: Compared
) -> None:
    """A sample of which a failure was recorded must have been compared."""
    numbers = {number for number, _ in shared}
    failed = {pair for end in ends for pair in _failures(end)}
    for epoch, sample in sorted(failed):
        if epoch in numbers and sample not in seen:
            compared.faults.append(
                f"sample {sample} is missing, of which an end recorded that the two differed after it"
            )


def _compare_assumed(upper: Recording, lower: Recording, compared: Compared) -> None:
    """Find the first difference among samples that were never confirmed (narrow downlink).

    The transmitter recorded what it assumed of them when what came down fitted no state. Where its
    assumption of word or command symbols was wrong, the states after that need not be equal.
    """
    assumed = {
        (row["epoch"], row[KEY]): (time_ns, row)
        for time_ns, row in upper.rows("assumed")
        if _are_numbers(row, "epoch", KEY)
    }
    if not assumed:
        return
    sent = {row.get(KEY): row.get("symbols") or [] for _, row in lower.rows("down_symbols")}
    over: set[object] = set()
    for there in _samples(lower, Compared()):
        number = there.epoch[0]
        time_ns, here = assumed.get((number, there.sample), (0, None))
        if here is None or number in over:
            continue
        symbols = here.get("symbols") or []
        same = sent.get(there.sample, [])[: len(symbols)] == symbols
        same = same and here.get("word") == there.row.get("word")
        unlike = unlike_field(here, there.row, ["state", "coder"])
        if not same or unlike is not None:
            over.add(number)
        if same and unlike is not None:
            where = ("assumed", KEY, there.sample, time_ns)
            compared.differences.append(Difference(*where, *unlike, upper.path, lower.path))


def _failures(recording: Recording) -> set[tuple[int, int]]:
    """Return (epoch, sample) of the differences that an end reported."""
    rows = (row for _, row in recording.rows("lockstep_failure"))
    return {(row["epoch"], row["sample"]) for row in rows if _are_numbers(row, "epoch", "sample")}


def _epochs(recording: Recording) -> list[Epoch]:
    """Return the epochs of an end, in the order of the file; one for all from before they were kept."""
    found: list[Epoch] = [(row.get("epoch"), row.get("sample")) for _, row in recording.rows("epoch")]
    return found or [(0, 0)]


def _samples(recording: Recording, compared: Compared) -> Iterator[_Sample]:
    """Yield the samples of an end, with their epochs; what is doubled or out of order is a fault."""
    epochs = _epochs(recording)
    index, before = 0, -1
    for time_ns, row in recording.rows(TOPIC):
        if not _are_numbers(row, KEY):
            raise RecordingError(f"{recording.path} holds a sample without a number.")
        sample = row[KEY]
        if sample <= before:
            compared.faults.append(f"sample {sample} is doubled or out of order in {recording.path}")
            continue
        before = sample
        while index + 1 < len(epochs):
            start = epochs[index + 1][1]
            if not isinstance(start, int) or start > sample:
                break
            index += 1
        yield _Sample(epochs[index], sample, time_ns, row)


def _are_numbers(row: Row, *names: str) -> bool:
    return all(isinstance(row.get(name), int) for name in names)


def _is_transmitter(recording: Recording) -> bool:
    path: Path = recording.path
    return recording.metadata.get("role", "") == "transmitter" or path.name == TRANSMITTER_NAME
