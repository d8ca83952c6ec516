from __future__ import annotations

import json
import zlib
from dataclasses import replace
from pathlib import Path

import pytest

from tenbaud import Run
from tenbaud.recording.errors import RecordingError
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay, replay_symbols, save_symbols
from tenbaud.replay.symbols import unpack
from tests.tenbaud.audit.doctor import Row, at, doctored
from tests.tenbaud.flown import flown
from tests.tenbaud.processes import run as run_command


@pytest.mark.parametrize(
    ("preset", "faults", "symbol_bytes"),
    [
        ("tuned-10baud", "", 15),
        ("tuned-10baud", "loss=0.3,up:flip=0.05,delay=20ms±5ms", None),
        ("tuned-10baud", "cut=4s+3s", None),
        ("usual-1000baud", "", 1500),
        ("static-10baud", "", 15),
    ],
)
def test_the_whole_flight_is_its_symbols(
    tmp_path: Path, preset: str, faults: str, symbol_bytes: int | None
) -> None:
    run = flown(tmp_path / "run", preset, link__impairments=faults)
    replayed = replay(load_record(run.path))
    assert replayed.equal, replayed.differences
    samples = len(run.table("receiver", "sample"))
    assert replayed.samples == samples
    assert replayed.digests_compared == samples + len(run.table("transmitter", "sample"))
    if symbol_bytes is not None:
        assert len(replayed.packed.symbols) == symbol_bytes
        assert replayed.packed.erasures == b""
    # And again from the file alone.
    file = tmp_path / "flight.symbols"
    save_symbols(replayed, file)
    unpacked = unpack(file)
    flown_samples, digest = replay_symbols(unpacked)
    rows = run.table("receiver", "sample").rows
    assert (flown_samples, digest) == (samples, rows[-1]["digest"])
    words = [word for epoch in unpacked.epochs for word in epoch.words]
    assert words == [None if row["word"] is None else tuple(row["word"]) for row in rows]


def test_a_changed_word_is_another_flight(tmp_path: Path) -> None:
    run = flown(tmp_path / "run")
    flipped = at("sample", 40, lambda row: {**row, "word": [-row["word"][0]]})
    replayed = replay(load_record(doctored(run.path, tmp_path / "bad", "receiver", "sample", flipped)))
    assert not replayed.equal
    assert "first at sample 40" in replayed.differences[0]


def test_set_points_given_by_hand_are_replayed(tmp_path: Path) -> None:
    """A flight whose reference was moved: recorded by a flight that had it so from the beginning."""
    moved = flown(tmp_path / "moved", receiver__reference__amplitude=0.5)
    config = moved.folder.config
    text = config.read_text()
    assert "amplitude = 0.5" in text
    config.write_text(text.replace("amplitude = 0.5", "amplitude = 0.4"))
    replayed = replay(load_record(moved.path))
    assert replayed.equal, replayed.differences
    assert replayed.steps[0] == (0, 0.5)
    file = tmp_path / "moved.symbols"
    save_symbols(replayed, file)
    unpacked = unpack(file)
    assert unpacked.steps == replayed.steps
    assert replay_symbols(unpacked)[1] == unpacked.last_digest


def test_a_recorded_flight_of_somebody_else_replays(tmp_path: Path) -> None:
    rows = "".join(f"{step},{step % 7},0.5,-0.5\n" for step in range(400))
    log = tmp_path / "log.csv"
    log.write_text("step,pitch_counts,right_volts,left_volts\n" + rows)
    settings = {"transmitter__rig": "replay", "receiver__controller": "recorded"}
    run = flown(tmp_path / "run", "uiuc-10baud", flight_log__file=str(log), **settings)
    assert replay(load_record(run.path)).equal


def test_the_command_shows_the_size_and_flies_the_file_again(tmp_path: Path) -> None:
    flown(tmp_path / "run")
    done = run_command("replay", "run", "--save", "flight.symbols", cwd=tmp_path)
    assert done.code == 0, done.err
    assert "120 samples, 120 bits: the whole flight is 15 bytes of symbols" in done.out
    assert "all 240 digests of both recordings are equal" in done.out
    again = run_command("replay", "flight.symbols", cwd=tmp_path)
    assert again.code == 0, again.err
    assert "it is the state with which the flight ended" in again.out
    assert run_command("replay", "run", "--save", "flight.symbols", cwd=tmp_path).code == 2


@pytest.mark.parametrize(
    ("end", "other", "outcome"),
    [
        ("receiver", "transmitter", "the receiver's recording are equal, and so are the commands\n"),
        ("transmitter", "receiver", "the transmitter's recording are equal\n"),
    ],
)
def test_the_command_says_which_recordings_were_compared(
    end: str, other: str, outcome: str, tmp_path: Path
) -> None:
    run = flown(tmp_path / "run")
    samples = len(run.table(end, "sample"))
    (run.path / f"{other}.mcap").unlink()
    done = run_command("replay", "run", cwd=tmp_path)
    assert done.code == 0, done.err
    assert f"all {samples} digests of {outcome}" in done.out


def test_a_corrupted_symbols_file_is_refused_or_found_out(tmp_path: Path) -> None:
    run = flown(tmp_path / "run")
    replayed = replay(load_record(run.path))
    data = replayed.packed.data
    file = tmp_path / "bad.symbols"
    for broken in (b"", data[:40], data[:-1], data + b"\0", b"x" + data):
        file.write_bytes(broken)
        with pytest.raises(RecordingError, match="is no symbols file"):
            unpack(file)
    for lacking in ("last_digest", "set_points", "epochs"):
        head = json.loads(zlib.decompress(replayed.packed.head))
        del head[lacking]
        packed = replace(replayed.packed, head=zlib.compress(json.dumps(head).encode()))
        file.write_bytes(packed.data)
        with pytest.raises(RecordingError, match=f"is no symbols file .*{lacking}"):
            unpack(file)
    file.write_bytes(data[:-1] + bytes([data[-1] ^ 1]))
    done = run_command("replay", "bad.symbols", cwd=tmp_path)
    assert done.code == 1
    assert "but the flight ended with" in done.out


def test_a_run_that_cannot_be_replayed_is_explained(tmp_path: Path) -> None:
    run = flown(tmp_path / "run")

    def other(row: Row) -> list[Row]:
        return [] if row["sample"] == 30 else [row]

    bad = doctored(run.path, tmp_path / "bad", "receiver", "sample", other)
    done = run_command("replay", str(bad), cwd=tmp_path)
    assert done.code == 2
    assert "lacks sample 30" in done.err
    assert Run(bad).complete
