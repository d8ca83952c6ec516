"""The two ends of one flight side by side: each sample of each epoch that both flew.

The receiver flies on until it hears of a new epoch, and its last echoes may be lost. So at the end of
an epoch the transmitter may lack samples, which is no fault; anything else that an end lacks is one.
"""

from __future__ import annotations

from collections.abc import Iterator

from tenbaud.recording.comparison import Compared, KeyedRow, paired, unlike_field
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import TRANSMITTER_NAME
from tenbaud.recording.reader import Recording
from tenbaud.recording.rows import Row

TOPIC = KEY = "sample"
STATE = ("state", "coder")
Epoch = tuple[object, object]
"""(number, first sample)"""


def compare_ends(first: Recording, second: Recording, compared: Compared) -> None:
    """Compare the samples that both recorded, and note those missing in one."""
    ends = [first, second]
    if not _is_transmitter(first) and _is_transmitter(second):
        ends.reverse()
    upper, lower = ends
    epochs = [set(_epochs(end)) for end in ends]
    shared = epochs[0] & epochs[1]
    failed = {pair for end in ends for pair in _failures(end)}
    samples = {sample for _, sample in failed}
    seen, unheard = _compare_samples(upper, lower, shared, samples, compared)
    numbers = {number for number, _ in shared}
    for epoch, sample in sorted(failed):
        if epoch in numbers and sample not in seen:
            compared.faults.append(
                f"sample {sample} is missing, of which an end recorded that the two differed after it"
            )
    _compare_assumed(upper, lower, compared)
    if alone := len(epochs[0] ^ epochs[1]):
        compared.notes.append(f"epochs that one end alone began: {alone}; not compared")
    if unheard:
        compared.notes.append(
            f"samples of the receiver that the transmitter never confirmed: {unheard}"
        )


def _compare_samples(
    upper: Recording, lower: Recording, shared: set[Epoch], failed: set[int], compared: Compared
) -> tuple[set[int], int]:
    """Compare while both files stream by.

    Return which of the failed samples were compared, and how many samples the transmitter lacks at the
    ends of epochs.
    """
    # An end that recorded no sample at all cannot be checked, and `topic` says so.
    names = [
        [field.name for field in end.topic(TOPIC).channel.fields if not field.timing]
        for end in (upper, lower)
    ]
    fields = [name for name in names[0] if name in names[1]]
    seen, unheard = set[int](), 0
    pending: list[KeyedRow] = []
    for here, there in paired(_samples(upper, compared), _samples(lower, compared)):
        if here is None:
            if there is not None and there.epoch in shared:
                pending.append(there)
            continue
        if there is None:
            if here.epoch in shared:
                compared.lacks(lower.path, TOPIC, KEY, here.key)
            continue
        # What was pending lies before a sample that the transmitter does have.
        for one in pending:
            if one.epoch == here.epoch:
                compared.lacks(upper.path, TOPIC, KEY, one.key)
            else:
                unheard += 1
        pending.clear()
        seen |= {here.key} & failed
        if here.epoch != there.epoch:
            numbers = [str(one.epoch[0]) for one in (here, there)]
            compared.faults.append(
                f"sample {here.key} is in epoch {numbers[0]} for the transmitter and in epoch "
                f"{numbers[1]} for the receiver"
            )
            continue
        compared.rows += 1
        compared.compare((TOPIC, KEY), here, there, fields, (upper.path, lower.path))
    return seen, unheard + len(pending)


def _compare_assumed(upper: Recording, lower: Recording, compared: Compared) -> None:
    """Find the first difference among samples that were never confirmed (narrow downlink).

    The transmitter recorded what it assumed of them when what came down fitted no state. Where its
    assumption of word or command symbols was wrong, the states after that need not be equal.
    """
    assumed = {
        (row["epoch"], row[KEY]): KeyedRow(row[KEY], time_ns, row)
        for time_ns, row in upper.rows("assumed")
        if _are_numbers(row, "epoch", KEY)
    }
    if not assumed:
        return
    sent = {row.get(KEY): row.get("symbols") or [] for _, row in lower.rows("down_symbols")}
    over: set[object] = set()
    for there in _samples(lower, Compared()):
        number = there.epoch[0]
        here = assumed.get((number, there.key))
        if here is None or number in over:
            continue
        symbols = here.row.get("symbols") or []
        same = sent.get(there.key, [])[: len(symbols)] == symbols
        same = same and here.row.get("word") == there.row.get("word")
        if not same or unlike_field(here.row, there.row, STATE) is not None:
            over.add(number)
        if same:
            compared.compare(("assumed", KEY), here, there, STATE, (upper.path, lower.path))


def _failures(recording: Recording) -> set[tuple[int, int]]:
    """Return (epoch, sample) of the differences that an end reported."""
    rows = (row for _, row in recording.rows("lockstep_failure"))
    return {(row["epoch"], row["sample"]) for row in rows if _are_numbers(row, "epoch", "sample")}


def _epochs(recording: Recording) -> list[Epoch]:
    """Return the epochs of an end, in the order of the file; one for all from before they were kept."""
    found: list[Epoch] = [(row.get("epoch"), row.get("sample")) for _, row in recording.rows("epoch")]
    return found or [(0, 0)]


def _samples(recording: Recording, compared: Compared) -> Iterator[KeyedRow]:
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
        yield KeyedRow(sample, time_ns, row, epochs[index])


def _are_numbers(row: Row, *names: str) -> bool:
    return all(isinstance(row.get(name), int) for name in names)


def _is_transmitter(recording: Recording) -> bool:
    return recording.metadata.get("role") == "transmitter" or recording.path.name == TRANSMITTER_NAME
