"""What `ChunkWriter` writes is what the `mcap` package reads, its indexes and summary included."""

from __future__ import annotations

from collections import Counter
from io import BytesIO

import pytest
from mcap.reader import make_reader
from mcap.records import Footer, McapRecord, SummaryOffset
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from tenbaud.recording.chunk_writer import ChunkWriter

MESSAGES = [(1 + tick % 2, 10 * (tick ^ 1), f'{{"tick":{tick}}}'.encode()) for tick in range(1000)]
"""(channel, time, data), times slightly out of order, as rows of ticks and samples are"""


def written(chunk_bytes: int = 4096, messages: list[tuple[int, int, bytes]] = MESSAGES) -> bytes:
    stream = BytesIO()
    writer = ChunkWriter(stream, chunk_bytes)
    writer.start("tenbaud", "test")
    writer.add_metadata("run", {"seed": "7"})
    for topic in ("tick", "sample"):
        writer.register(topic, b"{}")
    for message in messages:
        writer.add_message(*message)
    writer.add_metadata("recorder", {"rows_written": str(len(messages))})
    writer.finish()
    return stream.getvalue()


def records(data: bytes) -> list[McapRecord]:
    """Return all records but the footer: the package also points at a group that has no records."""
    return [
        record
        for record in StreamReader(BytesIO(data), emit_chunks=True).records
        if not isinstance(record, Footer)
        and not (isinstance(record, SummaryOffset) and record.group_length == 0)
    ]


def test_every_message_comes_back_through_the_index() -> None:
    reader = make_reader(BytesIO(written()), validate_crcs=True)
    found = [
        (channel.id, message.log_time, message.data)
        for _, channel, message in reader.iter_messages(log_time_order=True)
    ]
    assert found == sorted(MESSAGES, key=lambda message: message[1])
    some = reader.iter_messages(topics=["sample"], starting_at=2000, ending_before=3000)
    wanted = [one for one in MESSAGES if one[0] == 2 and 2000 <= one[1] < 3000]
    assert Counter(message.data for _, _, message in some) == Counter(one[2] for one in wanted)
    metadata = {one.name: one.metadata for one in reader.iter_metadata()}
    assert metadata == {"run": {"seed": "7"}, "recorder": {"rows_written": "1000"}}


def test_records_are_those_of_the_package_writer() -> None:
    stream = BytesIO()
    writer = Writer(stream, chunk_size=4096, compression=CompressionType.ZSTD)
    writer.start("tenbaud", "test")
    writer.add_metadata("run", {"seed": "7"})
    for topic in ("tick", "sample"):
        writer.register_channel(topic, "json", writer.register_schema(topic, "jsonschema", b"{}"))
    for channel_id, time_ns, data in MESSAGES:
        writer.add_message(channel_id, time_ns, data, time_ns)
    writer.add_metadata("recorder", {"rows_written": "1000"})
    writer.finish()
    assert records(written()) == records(stream.getvalue())


@pytest.mark.parametrize("messages", [[], MESSAGES[:1]])
def test_a_short_file_is_whole(messages: list[tuple[int, int, bytes]]) -> None:
    reader = make_reader(BytesIO(written(messages=messages)), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(messages)
