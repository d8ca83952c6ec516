from __future__ import annotations

import errno
import os
import shutil
import signal
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from channel.links.endpoints import free_endpoint
from tenbaud import Run
from tenbaud.files.whole import WriteError
from tenbaud.recording import folder
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.inspect import describe_text
from tenbaud.recording.reader import MessageStream
from tenbaud.recording.recover import recover
from tenbaud.recording.writer import McapRecorder
from tests.tenbaud.ends import End, wait_for
from tests.tenbaud.flown import flown
from tests.tenbaud.processes import run as run_command
from tests.tenbaud.recording.rows import TICK, tick_row

LOSS_MAX_S = 1.0
FLOWN_S = 2.5


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return flown(tmp_path_factory.mktemp("runs") / "run", duration_s=60.0)


def whole_rows(path: Path) -> int:
    """What a reader that starts from the index at the end finds; it raises for a cut file."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        return summary.statistics.message_count


@pytest.mark.parametrize("links", [True, False])
def test_when_the_disk_turns_out_to_be_full_then_the_damaged_file_is_where_it_was(
    flight: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    cut = tmp_path / "transmitter.mcap"
    cut.write_bytes(flight.folder.transmitter.read_bytes()[:100_000])
    monkeypatch.setattr(os, "fsync", full)
    if not links:
        monkeypatch.setattr(Path, "hardlink_to", full)
    with pytest.raises(WriteError, match="No space left"):
        recover(cut)
    assert list(tmp_path.iterdir()) == [cut]
    assert cut.stat().st_size == 100_000


@pytest.mark.parametrize("links", [True, False])
def test_no_open_file_is_renamed_or_replaced_as_windows_would_refuse_it(
    flight: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    cut = tmp_path / "transmitter.mcap"
    cut.write_bytes(flight.folder.transmitter.read_bytes()[:100_000])
    renamed: list[Path] = []

    def watching(move: Callable[[Path, Path], Path]) -> Callable[[Path, Path], Path]:
        def watched(source: Path, target: Path) -> Path:
            opened = {os.path.realpath(one) for one in Path("/proc/self/fd").iterdir()}
            assert opened.isdisjoint({str(source), str(target)})
            renamed.append(source)
            return move(source, target)

        return watched

    monkeypatch.setattr(Path, "replace", watching(Path.replace))
    monkeypatch.setattr(Path, "rename", watching(Path.rename))
    if not links:
        monkeypatch.setattr(Path, "hardlink_to", lambda *_: (_ for _ in ()).throw(OSError))
    recover(cut)
    assert len(renamed) == (1 if links else 2)
    assert whole_rows(cut) > 0


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9, 0.999])
def test_a_cut_file_becomes_a_whole_one_with_every_row_up_to_the_cut(
    flight: Run, tmp_path: Path, share: float
) -> None:
    data = flight.folder.transmitter.read_bytes()
    cut = tmp_path / "transmitter.mcap"
    cut.write_bytes(data[: int(share * len(data))])
    readable = sum(len(table) for table in Run(cut).tables("transmitter").topics.values())
    with pytest.raises(Exception):  # noqa: B017  whatever another reader says of a torn file
        whole_rows(cut)
    (recovered,) = recover(cut)
    assert recovered.rows == readable == whole_rows(cut) > 0
    run = Run(cut)
    assert run.complete
    assert run.metadata == flight.metadata
    assert run.pitch.tolist() == flight.pitch[: len(run.pitch)].tolist()
    kept = tmp_path / "transmitter.cut.mcap"
    assert kept.read_bytes() == data[: int(share * len(data))]
    assert recovered.kept == kept


def test_a_whole_file_is_left_alone_and_nothing_is_overwritten(flight: Run, tmp_path: Path) -> None:
    copy = tmp_path / "receiver.mcap"
    copy.write_bytes(flight.folder.receiver.read_bytes())
    (recovered,) = recover(copy)
    assert recovered.kept is None
    assert list(tmp_path.iterdir()) == [copy]
    copy.write_bytes(copy.read_bytes()[:-100])
    (tmp_path / "receiver.cut.mcap").write_text("kept from an earlier time")
    with pytest.raises(RecordingError, match="exists already"):
        recover(copy)
    (elsewhere,) = recover(copy, tmp_path / "mended.mcap")
    assert whole_rows(tmp_path / "mended.mcap") == elsewhere.rows
    (tmp_path / "receiver.cut.mcap").unlink()
    assert recover(copy)[0].kept == tmp_path / "receiver.cut.mcap"
    (again,) = recover(copy)
    assert again.kept is None
    with pytest.raises(RecordingError, match="Give one recording"):
        recover(flight.path, tmp_path / "both.mcap")


def damaged(flight: Run, folder: Path, share: float) -> Path:
    """A copy of the receiver's recording with one bit changed in the chunk at this share of it."""
    data = bytearray(flight.folder.receiver.read_bytes())
    with flight.folder.receiver.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[int(share * len(summary.chunk_indexes))]
    data[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 4
    path = folder / "receiver.mcap"
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.7])
def test_a_changed_bit_costs_the_chunk_it_is_in_and_the_hole_is_reported(
    flight: Run, tmp_path: Path, share: float
) -> None:
    path = damaged(flight, tmp_path, share)
    (recovered,) = recover(path)
    (hole,) = recovered.holes
    first, last = hole.missing["tick"]
    whole = flight.table("receiver", "tick").keys
    assert Run(path).table("receiver", "tick").keys.tolist() == [
        tick for tick in whole.tolist() if not (first or 0) <= tick <= last
    ]
    # A chunk holds some ten of the sixty seconds.
    assert recovered.rows > 0.6 * whole_rows(flight.folder.receiver)
    assert whole_rows(path) == recovered.rows
    samples = hole.missing["sample"]
    assert f"sample of samples {samples[0]} to {samples[1]}" in str(recovered) or samples[0] is None
    # Whoever reads the recovered file later is told too.
    run = Run(path)
    assert run.complete
    assert [str(one) for one in run.tables("receiver").holes] == [str(hole)]
    assert any("has a hole" in note for note in run.notes)
    assert "has a hole" in describe_text(path)


def test_replay_and_audit_say_that_a_recording_has_holes(flight: Run, tmp_path: Path) -> None:
    folder = tmp_path / "run"
    shutil.copytree(flight.path, folder)
    damaged(flight, folder, 0.5)
    for mend in (False, True):
        if mend:
            recover(folder)
        audited = run_command("audit", str(folder), cwd=tmp_path)
        assert audited.code == 1
        assert "receiver.mcap has a hole at" in audited.out
        replayed = run_command("replay", str(folder), cwd=tmp_path)
        assert replayed.code != 0
        assert "receiver.mcap has a hole at" in replayed.err


def test_a_file_in_use_is_refused_and_its_flight_goes_on(
    flight: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "transmitter.mcap"
    with McapRecorder(path, {}) as recorder:
        recorder.write(TICK, 0, tick_row(0, 0.1))
        with pytest.raises(RecordingError, match="is in use"):
            recover(path)
        with pytest.raises(RecordingError, match="not overwritten"):
            McapRecorder(path, {})
        recorder.write(TICK, 1, tick_row(1, 0.1))
    assert [row["tick"] for _, _, row in MessageStream(path)] == [0, 1]
    assert [entry.name for entry in tmp_path.iterdir()] == ["transmitter.mcap"]
    assert recover(path)[0].kept is None


def test_without_locks_a_file_that_grows_is_in_use(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(folder, "fcntl", None)
    monkeypatch.setattr(folder, "QUIET_S", 1.3)
    path = tmp_path / "transmitter.mcap"
    flying = threading.Event()
    with McapRecorder(path, {}) as recorder:

        def fly() -> None:
            tick = 0
            while not flying.wait(0.02):
                recorder.write(TICK, tick, tick_row(tick, 0.1))
                tick += 1

        thread = threading.Thread(target=fly)
        thread.start()
        try:
            with pytest.raises(RecordingError, match="is in use"):
                recover(path)
        finally:
            flying.set()
            thread.join()
    assert recover(path)[0].kept is None


def test_no_link_is_followed(flight: Run, tmp_path: Path) -> None:
    """Neither one in a recording's place, nor one where the whole or the damaged file is to go."""
    precious = tmp_path / "precious"
    precious.write_bytes(flight.folder.transmitter.read_bytes()[:-100])
    before = precious.read_bytes()
    folder = tmp_path / "run"
    folder.mkdir()
    path = folder / "transmitter.mcap"
    path.symlink_to(precious)
    with pytest.raises(RecordingError, match="link"):
        recover(path)
    with pytest.raises(WriteError, match="links are not followed"):
        McapRecorder(path, {})
    path.unlink()
    path.write_bytes(before)
    for name in ("transmitter.cut.mcap", "out.mcap"):
        (folder / name).symlink_to(tmp_path / "nowhere")
    (folder / ".transmitter.mcap.unfinished").symlink_to(precious)
    with pytest.raises(RecordingError, match="exists already"):
        recover(path)
    with pytest.raises(RecordingError, match="exists already"):
        recover(path, folder / "out.mcap")
    (folder / "transmitter.cut.mcap").unlink()
    recover(path)
    assert precious.read_bytes() == before
    assert not (tmp_path / "nowhere").exists()
    assert (folder / "transmitter.cut.mcap").read_bytes() == before


def test_nothing_to_recover_is_said(tmp_path: Path) -> None:
    empty = tmp_path / "transmitter.mcap"
    empty.touch()
    told = run_command("recover", str(empty), cwd=tmp_path)
    assert told.code == 2
    assert "nothing in it to recover" in told.err


def test_a_killed_process_loses_at_most_the_last_second(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    more = ["--set", "link.peer_timeout_s=30"]
    receiver = End("receive", ["--listen", endpoint], tmp_path / "lower", *more)
    transmitter = End(
        "transmit", ["--connect", endpoint], tmp_path / "upper", "--duration", "3600", *more
    )
    ends = (transmitter, receiver)
    try:
        wait_for(
            lambda: transmitter.flies and transmitter.status["time_s"] >= FLOWN_S,
            lambda: f"{transmitter.status} {transmitter.said} {receiver.said}",
        )
        for end in ends:
            end.process.send_signal(signal.SIGKILL)
            end.process.wait()
        seen_s = {end.verb: end.status["time_s"] for end in ends}
    finally:
        for end in ends:
            if end.process.poll() is None:
                end.kill()
    for end, name in zip(ends, ("transmitter", "receiver"), strict=True):
        before = Run(end.folder)
        assert not before.complete
        lost_s = seen_s[end.verb] - before.time_s[-1]
        told = run_command("recover", str(end.folder), cwd=tmp_path)
        assert told.code == 0, told.err
        after = Run(end.folder)
        assert after.complete
        assert len(after.time_s) == len(before.time_s)
        assert whole_rows(end.folder / f"{name}.mcap") > 100
        # The clock here is the flight's own: what was flown and is not in the file.
        assert lost_s <= LOSS_MAX_S
        assert after.time_s[-1] > FLOWN_S - LOSS_MAX_S
    audited = run_command("audit", "upper", "lower", cwd=tmp_path)
    assert audited.code == 0, audited.out + audited.err
    assert "recording was recovered" in audited.out
