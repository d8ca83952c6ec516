from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from tenbaud.recording.encoding import channel_schema, row_encoder
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.reader import MessageStream, Recording
from tests.tenbaud.recording.rows import TICK, Rows, tick_row

ROWS_PER_CHUNK = 50
CHUNKS = 6


@pytest.fixture(params=[CompressionType.ZSTD, CompressionType.NONE])
def chunked(tmp_path: Path, request: pytest.FixtureRequest) -> tuple[Path, list[int]]:
    """A file of several chunks, and where each of them ends."""
    path = tmp_path / "a.mcap"
    ends = []
    with path.open("wb") as stream:
        writer = Writer(stream, compression=request.param)
        writer.start("tenbaud", "tenbaud")
        schema = writer.register_schema("tick", "jsonschema", channel_schema(TICK))
        channel = writer.register_channel("tick", "json", schema)
        encode = row_encoder(TICK)
        for tick in range(ROWS_PER_CHUNK * CHUNKS):
            writer.add_message(channel, tick, encode(tick_row(tick, tick / 3)), tick)
            if (tick + 1) % ROWS_PER_CHUNK == 0:
                writer.flush()
                ends.append(stream.tell())
        writer.finish()
    return path, ends


def test_cut_file_is_read_up_to_the_cut_wherever_it_falls(chunked: tuple[Path, list[int]]) -> None:
    path, ends = chunked
    whole = path.read_bytes()
    cuts = {len(whole) - 1, len(whole) - 9, *ends}
    cuts |= {end + extra for end in ends[:-1] for extra in (1, 8, 9, 30, 200, 700)}
    cuts |= set(range(9, ends[0], 97))
    for cut in sorted(cuts):
        path.write_bytes(whole[:cut])
        stream = MessageStream(path)
        ticks = [row["tick"] for _, _, row in stream]
        # The index behind a chunk may be cut without harm to the chunk.
        certain = ROWS_PER_CHUNK * sum(end <= cut for end in ends)
        assert ticks == list(range(len(ticks))), cut
        assert certain <= len(ticks) <= certain + ROWS_PER_CHUNK, cut
        assert not stream.complete, cut


def test_blocks_that_were_never_filled_count_as_a_cut(chunked: tuple[Path, list[int]]) -> None:
    path, ends = chunked
    whole = path.read_bytes()
    half_empty = whole[: ends[1] + 300] + bytes(len(whole) - ends[1] - 300)
    path.write_bytes(half_empty)
    stream = MessageStream(path)
    assert len(list(stream)) == 2 * ROWS_PER_CHUNK
    assert not stream.complete


def test_damaged_chunk_is_left_out_and_the_hole_is_reported(chunked: tuple[Path, list[int]]) -> None:
    path, ends = chunked
    damaged = bytearray(path.read_bytes())
    damaged[ends[1] + 200] ^= 1
    path.write_bytes(damaged)
    stream = MessageStream(path)
    ticks = [row["tick"] for _, _, row in stream]
    assert ticks == [*range(100), *range(150, 300)]
    assert not stream.complete
    (hole,) = stream.holes
    assert hole.missing == {"tick": (100, 149)}
    assert "tick of ticks 100 to 149" in str(hole)


@pytest.mark.parametrize("place", [0, 1, 4, 9, 17, 25, 33, 37, 41, 45, 49, 57, 60, 200])
@pytest.mark.parametrize("chunk", [0, 2, CHUNKS - 1])
def test_a_changed_byte_costs_one_chunk_at_most(
    chunked: tuple[Path, list[int]], place: int, chunk: int
) -> None:
    """Also in the lengths and names of the chunk, and in the first one, which describes the topic."""
    path, _ = chunked
    whole = path.read_bytes()
    start = chunk_starts(path)[chunk]
    for flip in (1, 0x40, 0xFF):
        damaged = bytearray(whole)
        damaged[start + place] ^= flip
        path.write_bytes(damaged)
        stream = MessageStream(path)
        ticks = [row["tick"] for _, _, row in stream]
        lost = set(range(CHUNKS * ROWS_PER_CHUNK)) - set(ticks)
        first = chunk * ROWS_PER_CHUNK
        assert lost in (set(), set(range(first, first + ROWS_PER_CHUNK))), (flip, sorted(lost)[:3])
        assert ticks == sorted(set(ticks))
        if lost and chunk != CHUNKS - 1:
            (hole,) = stream.holes
            assert hole.missing == {"tick": (first or None, first + ROWS_PER_CHUNK - 1)}
        elif lost:
            assert not stream.complete


def chunk_starts(path: Path) -> list[int]:
    """Where the chunks of a whole file begin, from its index."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        return [index.chunk_start_offset for index in summary.chunk_indexes]


def test_complete_file_says_so_only_after_its_end(chunked: tuple[Path, list[int]]) -> None:
    stream = MessageStream(chunked[0])
    assert not stream.complete
    assert len(list(stream)) == ROWS_PER_CHUNK * CHUNKS
    assert stream.complete


def test_recording_counts_rows_and_time_of_each_topic(tmp_path: Path, fly: Callable[..., Path]) -> None:
    recording = Recording(fly(tmp_path / "run", ticks=100) / "transmitter.mcap")
    assert recording.complete
    assert {name: len(topic) for name, topic in recording.topics.items()} == {
        "tick": 100,
        "estimate": 100,
        "sample": 10,
        "event": 1,
    }
    assert recording.topics["sample"].first_time_ns == 0
    assert recording.topics["sample"].last_time_ns == 900_000_000
    assert recording.metadata["seed"] == "7"


def test_wrong_files_are_named_with_what_to_do(tmp_path: Path) -> None:
    empty, text = tmp_path / "empty.mcap", tmp_path / "text.mcap"
    empty.write_bytes(b"")
    text.write_text("tick,angle\n0,0.1\n")
    for path, words in (
        (tmp_path / "none.mcap", "cannot be read"),
        (tmp_path, "cannot be read"),
        (empty, "is empty"),
        (text, "is not a recording"),
    ):
        with pytest.raises(RecordingError, match=words) as caught:
            MessageStream(path)
        assert str(path) in str(caught.value)


def test_file_of_another_program_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        channel = writer.register_channel("/imu", "cdr", 0)
        writer.add_message(channel, 0, b"\x00", 0)
        writer.finish()
    with pytest.raises(RecordingError, match=r"not written by tenbaud.*'/imu'"):
        list(MessageStream(path))


def test_file_cut_right_after_its_head_has_no_rows(
    tmp_path: Path, record: Callable[[Path, Rows], Path]
) -> None:
    path = record(tmp_path / "a.mcap", [(TICK, 0, tick_row(0, 0.0))])
    path.write_bytes(path.read_bytes()[:60])
    assert Recording(path).topics == {}
    assert not Recording(path).complete
