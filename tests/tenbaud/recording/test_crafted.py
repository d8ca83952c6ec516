"""Files made to harm their readers: refused or skipped, with a message and within bounds."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tenbaud import Run
from tenbaud.recording.encoding import channel_schema
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.inspect import describe_text
from tenbaud.recording.reader import MessageStream, Recording
from tests.tenbaud.flown import flown
from tests.tenbaud.processes import REPOSITORY
from tests.tenbaud.processes import run as run_command
from tests.tenbaud.recording.craft import chunk, mcap_file, messages_of
from tests.tenbaud.recording.rows import TICK, tick_row
from transmitter.session.records import TICK_CHANNEL

DESCRIBED = [(1, "tick", channel_schema(TICK))]
HEAD = [("run", {"role": "transmitter", "tick_s": "0.01"})]


def tick(number: int, **changed: Any) -> bytes:
    row = dict(zip([one.name for one in TICK.fields], tick_row(number, 0.1), strict=True))
    return json.dumps(row | changed).encode()


def good(first: int, count: int = 20) -> bytes:
    return chunk(messages_of([(1, number, tick(number)) for number in range(first, first + count)]))


def ticks_of(path: Path) -> list[int]:
    return [row["tick"] for _, _, row in MessageStream(path)]


BAD_CHUNKS: dict[str, Callable[[], bytes]] = {
    "4 GiB claimed": lambda: chunk(b"", packed=bytes(1000), size=1 << 32),
    "4 GiB real": lambda: chunk(b"", packed=huge(), size=1 << 32, checksum=0),
    "bomb below the bound": lambda: chunk(bytes(15 << 20), checksum=0),
    "zstd garbage": lambda: chunk(b"", packed=b"garbage" * 9, size=100),
    "lz4 garbage": lambda: chunk(b"", "lz4", packed=b"garbage" * 9, size=100),
    "lz4 bomb": lambda: chunk(bytes(15 << 20), "lz4", size=100, checksum=0),
    "another size": lambda: chunk(b"abc", size=2, checksum=0),
    "unknown packing": lambda: chunk(b"", "brotli", packed=b"abc", size=3),
    "record beyond its chunk": lambda: chunk(b"\x05" + b"\xff" * 8 + b"abc"),
    "message without head": lambda: chunk(b"\x05" + (3).to_bytes(8, "little") + b"abc"),
}


def huge() -> bytes:
    """A zstd frame of 4 GiB of zeros, in 131 kB as the one that was found."""
    block = ((128 << 10) << 3 | 1 << 1).to_bytes(3, "little") + b"\0"
    head = b"\x28\xb5\x2f\xfd" + bytes([0b11100000]) + (1 << 32).to_bytes(8, "little")
    return head + block * ((1 << 32) // (128 << 10) - 1) + bytes([block[0] | 1]) + block[1:]


@pytest.mark.parametrize("name", BAD_CHUNKS)
def test_a_bad_chunk_is_read_past_at_once_and_reported(tmp_path: Path, name: str) -> None:
    path = tmp_path / "transmitter.mcap"
    path.write_bytes(mcap_file([good(0), BAD_CHUNKS[name](), good(40)], DESCRIBED, HEAD))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    started_s = time.process_time()
    stream = MessageStream(path)
    ticks = [row["tick"] for _, _, row in stream]
    assert ticks == [*range(20), *range(40, 60)]
    assert not stream.complete
    (hole,) = stream.holes
    assert hole.missing == {"tick": (20, 39)}
    assert "has a hole" in describe_text(path)
    # The kind of bound, not a measure of speed: the 4 GiB took more than a minute.
    assert time.process_time() - started_s < 5.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200 << 10


BAD_ROWS: dict[str, tuple[bytes, str]] = {
    "empty": (b"", "row 3 of the topic 'tick' is no JSON"),
    "no object": (b"[1]", "row 3 of the topic 'tick' is no JSON object"),
    "two rows": (tick(3) + b"," + tick(4), "row 3 of the topic 'tick' is no JSON"),
    "no fields": (b"{}", "row 3 of the topic 'tick' lacks the field 'tick'"),
    "text for a number": (tick(3, lateness_ms="1"), "has '1' for 'lateness_ms': not a number"),
    "text in a list": (tick(3, measured=["1"]), r"has \['1'\] for 'measured'"),
    "no tick": (tick(3, tick=None), "has None for 'tick': not a whole number"),
    "half a tick": (tick(3, tick=0.5), "has 0.5 for 'tick'"),
    "a tick beyond all flights": (tick(3, tick=1 << 62), "which no flight reaches"),
    "deep": (b"[" * 100_000, "is no JSON"),
}


@pytest.mark.parametrize("name", BAD_ROWS)
def test_a_bad_row_is_named_with_file_and_number(tmp_path: Path, name: str) -> None:
    data, words = BAD_ROWS[name]
    path = tmp_path / "transmitter.mcap"
    rows = [(1, number, data if number == 3 else tick(number)) for number in range(6)]
    path.write_bytes(mcap_file([chunk(messages_of(rows))], DESCRIBED, HEAD))
    for read in (ticks_of, lambda one: list(Recording(one).rows("tick")), lambda one: Run(one).pitch):
        with pytest.raises(RecordingError, match=words) as caught:
            read(path)
        assert str(path) in str(caught.value)
        assert "the file was changed, or another program wrote it" in str(caught.value)


def test_rows_of_a_channel_that_is_described_nowhere_are_left_out_and_counted(tmp_path: Path) -> None:
    path = tmp_path / "transmitter.mcap"
    body = [good(0), chunk(messages_of([(7, 0, b"{}"), (7, 0, b"x")])), good(20)]
    path.write_bytes(mcap_file(body, DESCRIBED, HEAD))
    recording = Recording(path)
    assert len(recording.topics["tick"]) == 40
    assert recording.strays == 2
    assert "2 rows are left out" in describe_text(path)


def test_a_field_of_another_type_than_ours_is_refused(tmp_path: Path) -> None:
    schema = channel_schema(TICK_CHANNEL).replace(b'"array"', b'"string"', 1)
    path = tmp_path / "transmitter.mcap"
    path.write_bytes(mcap_file([], [(1, "tick", schema)], HEAD))
    with pytest.raises(RecordingError, match="its field 'measured' is a text, here it is a list"):
        list(MessageStream(path))


def test_ticks_far_apart_ask_for_no_time_base(tmp_path: Path) -> None:
    path = tmp_path / "transmitter.mcap"
    rows = [(1, 0, tick(0)), (1, 1, tick(1 << 50))]
    path.write_bytes(mcap_file([chunk(messages_of(rows))], DESCRIBED, HEAD))
    run = Run(path)
    with pytest.raises(RecordingError, match="2 ticks between tick 0 and tick 1125899906842624"):
        _ = run.pitch
    assert run.table("transmitter", "tick")["tick"].tolist() == [0.0, float(1 << 50)]


def test_lists_of_unlike_lengths_ask_for_no_memory(tmp_path: Path) -> None:
    path = tmp_path / "transmitter.mcap"
    rows = [(1, 0, tick(0, measured=[0.5] * 1000))]
    rows += [(1, number, tick(number)) for number in range(1, 20_000)]
    path.write_bytes(mcap_file([chunk(messages_of(rows))], DESCRIBED, HEAD))
    with pytest.raises(RecordingError, match="up to 1000 values, and most far fewer"):
        _ = Run(path).pitch


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_a_pipe_in_the_place_of_a_file_is_not_waited_for(tmp_path: Path) -> None:
    run = flown(tmp_path / "run", duration_s=1.0)
    for path in (run.folder.summary, run.folder.receiver):
        path.unlink()
        os.mkfifo(path)
    again = Run(run.path)
    assert again.summary == {}
    assert again.ends == ["transmitter"]
    with pytest.raises(RecordingError, match="it is not a file"):
        Recording(run.folder.receiver)


def test_what_would_steer_a_terminal_is_not_printed(tmp_path: Path) -> None:
    path = tmp_path / "transmitter.mcap"
    head = [("run", {"role": "transmitter", "preset": "x\x1b[2J\x07"})]
    path.write_bytes(mcap_file([good(0)], DESCRIBED, head))
    assert "\x1b" not in describe_text(path)
    assert "\x07" not in describe_text(path)


def test_a_recording_of_another_version_is_said_to_be_one_and_read(tmp_path: Path) -> None:
    run = flown(tmp_path / "run", duration_s=2.0)
    data = run.folder.transmitter.read_bytes()
    version = run.metadata["version"]
    other = f"9{version[1:]}"
    run.folder.transmitter.write_bytes(
        data.replace(
            b"version" + len(version).to_bytes(4, "little") + version.encode(),
            b"version" + len(version).to_bytes(4, "little") + other.encode(),
            1,
        )
    )
    words = f"was recorded by tenbaud {other}; this is {version}"
    assert words in describe_text(run.path)
    assert any(words in note for note in Run(run.path).notes)
    for command in (["convert", "--to", "json"], ["replay"], ["audit"]):
        told = run_command(command[0], "run", *command[1:], cwd=tmp_path)
        assert told.code == 0, told.err
        assert words in told.out + told.err


@pytest.mark.parametrize("inputs", [150, pytest.param(100_000, marks=pytest.mark.soak)])
def test_only_errors_of_ours_come_out_of_the_readers(tmp_path: Path, inputs: int) -> None:
    run = flown(
        tmp_path / "run",
        duration_s=1.0,
        link__impairments="loss=0.1",
        channel__delivery="end",
        transmitter__sabotage="sample=4,field=range",
    )
    arguments = [str(run.path), str(inputs), "20261126"]
    done = subprocess.run(
        [sys.executable, "-m", "tests.tenbaud.recording.fuzz", *arguments],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=True,
    )
    told = json.loads(done.stdout)
    assert not told["faults"], "\n".join(told["faults"][:5])
    assert min(told["accepted"], told["refused"]) > inputs / 20
    assert told["slowest_s"] < 20.0
    assert told["grown_kib"] < 300 << 10
