from __future__ import annotations

import signal
from pathlib import Path

import pytest
from mcap.reader import make_reader

from channel.links.endpoints import free_endpoint
from tenbaud import Run
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.recover import recover
from tests.tenbaud.ends import End, wait_for
from tests.tenbaud.flown import flown
from tests.tenbaud.processes import run as run_command

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
