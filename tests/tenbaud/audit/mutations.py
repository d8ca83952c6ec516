"""Recordings with one thing changed: a field of a row, a row less, a row twice, two rows swapped.

The files are whole ones: written anew, with checksums, and with the number of rows that they then hold.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import orjson
from mcap.writer import CompressionType, IndexType, Writer

from tenbaud.audit.base import FILED
from tenbaud.recording.encoding import channel_schema
from tenbaud.recording.kinds import KINDS
from tenbaud.recording.reader import MessageStream
from tenbaud.recording.writer import END_METADATA, RUN_METADATA

Message = tuple[str, int, dict[str, Any]]


class Mutation(NamedTuple):
    """One change of one recording."""

    end: str
    topic: str
    row: int
    """place among the rows of the topic"""
    kind: str
    """edit, null, delete, double, swap"""
    field: str = ""


class Original:
    """A run, read once, to be written with changes."""

    def __init__(self, run: Path) -> None:
        self.run = run
        self.messages: dict[str, list[Message]] = {}
        self.streams: dict[str, MessageStream] = {}
        for end in ("transmitter", "receiver"):
            stream = MessageStream(run / f"{end}.mcap")
            self.messages[end] = list(stream)
            self.streams[end] = stream

    def rows(self, end: str, topic: str) -> list[int]:
        """Return the places of a topic's rows among all messages of an end."""
        return [at for at, message in enumerate(self.messages[end]) if message[0] == topic]

    def row(self, mutation: Mutation) -> dict[str, Any]:
        """Return the row that a mutation changes, as it was."""
        at = self.rows(mutation.end, mutation.topic)[mutation.row]
        return self.messages[mutation.end][at][2]

    def mutations(self, rows_per_topic: int, noise: random.Random) -> Iterator[Mutation]:
        """Yield every kind of change, on some rows of each topic and field."""
        for end, topics in KINDS.items():
            for topic, kind in topics.items():
                count = len(self.rows(end, topic))
                if not count:
                    continue
                names = [*(field.name for field in kind.channel.fields), FILED]
                nullable = [name for name in names if name in kind.nullable]
                for what, fields in (("edit", names), ("null", nullable)):
                    for field in fields:
                        for row in _some(count, rows_per_topic, noise):
                            mutation = Mutation(end, topic, row, what, field)
                            there = field == FILED or self.row(mutation).get(field) is not None
                            # Most fields of most events are null, and are no claim when they are not.
                            if there or (what == "edit" and topic != "event"):
                                yield mutation
                for what in ("delete", "double"):
                    for row in _some(count, rows_per_topic, noise):
                        yield Mutation(end, topic, row, what)
                for row in _some(count - 1, rows_per_topic, noise) if count > 1 else ():
                    yield Mutation(end, topic, row, "swap")

    def write(self, mutation: Mutation, path: Path, noise: random.Random) -> None:
        """Write the recording of the changed end."""
        messages = list(self.messages[mutation.end])
        places = self.rows(mutation.end, mutation.topic)
        at = places[mutation.row]
        topic, time_ns, row = messages[at]
        match mutation.kind:
            case "edit" if mutation.field == FILED:
                messages[at] = (topic, time_ns + 1, row)
            case "edit":
                value = changed(row[mutation.field], noise)
                messages[at] = (topic, time_ns, {**row, mutation.field: value})
            case "null":
                messages[at] = (topic, time_ns, {**row, mutation.field: None})
            case "delete":
                del messages[at]
            case "double":
                messages.insert(at, messages[at])
            case "swap":
                other = places[mutation.row + 1]
                messages[at], messages[other] = messages[other], messages[at]
        write_recording(path, messages, self.streams[mutation.end])


def _some(count: int, most: int, noise: random.Random) -> list[int]:
    return sorted(noise.sample(range(count), min(count, most)))


def changed(value: Any, noise: random.Random) -> Any:
    """Return another value of the same type, as near as there is one."""
    match value:
        case None:
            return 1
        case bool():
            return not value
        case int():
            return value + noise.choice((-1, 1)) if value > 0 else value + 1
        case float():
            return math.nextafter(value, noise.choice((-math.inf, math.inf)))
        case str():
            return f"{value[:-1]}{'0' if value[-1:] != '0' else '1'}"
        case list() if value:
            at = noise.randrange(len(value))
            return [*value[:at], changed(value[at], noise), *value[at + 1 :]]
        case _:
            return [1]


def write_recording(path: Path, messages: list[Message], like: MessageStream) -> None:
    """Write a whole recording with these messages, headed as another one."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, index_types=IndexType.NONE)
        writer.start(profile="tenbaud", library="tenbaud")
        writer.add_metadata(RUN_METADATA, like.metadata[RUN_METADATA])
        channels: dict[str, int] = {}
        for topic, time_ns, row in messages:
            if topic not in channels:
                schema = channel_schema(like.channels[topic])
                schema_id = writer.register_schema(topic, "jsonschema", schema)
                channels[topic] = writer.register_channel(topic, "json", schema_id)
            writer.add_message(channels[topic], time_ns, orjson.dumps(row), time_ns)
        end = {**like.metadata[END_METADATA], "rows_written": str(len(messages))}
        writer.add_metadata(END_METADATA, end)
        writer.finish()
