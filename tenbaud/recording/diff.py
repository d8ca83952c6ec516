"""Two recordings side by side, to the last bit.

Rows of a topic are joined on its first field (tick or sample) while both files stream by, so that two
long flights need no memory. Wall-clock fields and the topic `event` are left out: two runs of one
flight need not share them. The two ends of one flight are compared sample by sample (`both_ends`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from channel.protocol.recording import RecordChannel
from tenbaud.recording.both_ends import compare_ends
from tenbaud.recording.comparison import Compared, KeyedRow, paired
from tenbaud.recording.encoding import END_METADATA
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import RECEIVER_NAME, TRANSMITTER_NAME, RunFolder
from tenbaud.recording.reader import Recording

IGNORED_TOPIC = "event"


@dataclass(frozen=True, slots=True)
class Comparison:
    """Two files to compare; `lockstep`: the two ends of one flight, by what both recorded."""

    first: Path
    second: Path
    lockstep: bool


def compare_runs(first: Path, second: Path | None = None) -> Compared:
    """Compare two runs, or the two ends of one.

    Two run folders: each end is compared with the same end. One run folder alone: its transmitter
    is compared with its receiver, on the fields of `sample` that both have. Two files are compared
    as they are. Raises RecordingError if there is nothing to compare.
    """
    compared = Compared()
    for pair in files_to_compare(first, second):
        here, there = Recording(pair.first), Recording(pair.second)
        for recording in (here, there):
            _check_whole(recording, compared)
        if pair.lockstep:
            compare_ends(here, there, compared)
        else:
            _compare_files(here, there, compared)
    return compared


def files_to_compare(first: Path, second: Path | None = None) -> list[Comparison]:
    """The files that `compare_runs` would open. Ends recorded in one folder only are left out."""
    if second is None:
        run = RunFolder(first)
        found = run.recordings()  # refuses links
        if len(found) == 1:
            raise RecordingError(
                f"{first} holds {found[0].name} alone. Give the folder of the other end too."
            )
        return [Comparison(run.transmitter, run.receiver, lockstep=True)]
    if first.is_dir() != second.is_dir():
        raise RecordingError(
            f"{first} and {second} cannot be compared: one is a folder, the other is not. "
            "Give two run folders or two recordings."
        )
    if not first.is_dir():
        ends = {first.name, second.name}
        return [Comparison(first, second, lockstep=ends == {TRANSMITTER_NAME, RECEIVER_NAME})]
    here = {path.name: path for path in RunFolder(first).recordings()}
    there = {path.name: path for path in RunFolder(second).recordings()}
    common = [Comparison(here[name], there[name], lockstep=False) for name in here if name in there]
    if common:
        return common
    if here and there:
        # Each machine kept its own end of the same flight.
        (own,), (other,) = here.values(), there.values()
        return [Comparison(own, other, lockstep=True)]
    raise RecordingError(
        f"{first if not here else second} holds no recording to compare. Give two run folders, "
        f"each with {TRANSMITTER_NAME} or {RECEIVER_NAME}."
    )


def _check_whole(recording: Recording, compared: Compared) -> None:
    """Note the missing data that a file reports itself."""
    end = recording.metadata_record(END_METADATA)
    if not recording.complete:
        compared.faults.append(f"{recording.path} was cut or damaged: rows after that are missing")
    held = sum(len(topic) for topic in recording.topics.values())
    written = end.get("rows_written", "")
    if written.isdecimal() and int(written) != held:
        compared.faults.append(f"{recording.path} holds {held} rows of {written} that were written")
    if end.get("rows_dropped", "0") != "0":
        compared.faults.append(
            f"{recording.path} lacks {end['rows_dropped']} rows: the recorder lost them"
        )


def _compare_files(first: Recording, second: Recording, compared: Compared) -> None:
    for topic in sorted((first.topics.keys() | second.topics.keys()) - {IGNORED_TOPIC}):
        channels = [side.topics[topic].channel for side in (first, second) if topic in side.topics]
        _compare_topic(first, second, channels[0], _fields(channels), compared)


def _fields(channels: list[RecordChannel]) -> list[str]:
    """The fields to compare, in the first channel's order."""
    timing = {field.name for channel in channels for field in channel.fields if field.timing}
    names = dict.fromkeys(field.name for channel in channels for field in channel.fields)
    return [name for name in names if name not in timing]


def _compare_topic(
    first: Recording, second: Recording, channel: RecordChannel, fields: list[str], compared: Compared
) -> None:
    topic, key_name = channel.topic, channel.fields[0].name
    left, right = _keyed(first, topic, key_name), _keyed(second, topic, key_name)
    after = [len(compared.missing)] * 2
    for here, there in paired(left, right):
        if here is None and there is not None:
            compared.lacks(first.path, topic, key_name, there.key)
            after[1] = len(compared.missing)
        elif there is None and here is not None:
            compared.lacks(second.path, topic, key_name, here.key)
            after[0] = len(compared.missing)
        elif here is not None and there is not None:
            compared.rows += 1
            after = [len(compared.missing)] * 2
            compared.compare((topic, key_name), here, there, fields, (first.path, second.path))
    for recording, count in ((first, after[0]), (second, after[1])):
        for entry in compared.missing[count:]:
            entry.ends = entry.ends or entry.path == recording.path


def _keyed(recording: Recording, topic: str, key_name: str) -> Iterator[KeyedRow]:
    for time_ns, row in recording.rows(topic):
        yield KeyedRow(row.get(key_name), time_ns, row)
