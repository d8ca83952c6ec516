"""Running studies: the same figures from every runner, and nothing lost when somebody dies."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from channel.links.endpoints import free_endpoint
from tenbaud.studies import run as running
from tenbaud.studies.chunk import ChunkResult, ChunkTask, fly_chunk
from tenbaud.studies.run import run_study
from tenbaud.studies.settings import StudyError
from tenbaud.studies.study import Study
from tenbaud.studies.table import Results
from tests.rules.sources import TOP
from tests.tenbaud.studies.small import SMALL, study_of

psutil: Any = import_module("psutil")
pq: Any = import_module("pyarrow.parquet")
ENVIRONMENT = os.environ | {"PYTHONPATH": str(TOP), "OMP_NUM_THREADS": "1"}


def ignore(done: int, total: int) -> None:
    """Take no notice of the progress."""


def flown(study: Study, folder: Path, **how: Any) -> Any:
    return run_study(study, Results(study, folder), ignore, **how)


@pytest.fixture
def expected(tmp_path: Path) -> Any:
    return flown(study_of(), tmp_path / "expected")


def test_when_two_processes_fly_then_the_table_is_that_of_one(tmp_path: Path, expected: Any) -> None:
    table = flown(study_of(), tmp_path / "pool", workers=2)
    assert table.equals(expected)
    assert pq.read_table(tmp_path / "pool" / "results.parquet").equals(expected)
    assert table.num_rows == 12
    assert table["flight"].to_pylist() == list(range(12))
    assert len(set(table["error_live_rms"].to_pylist())) == 12


def test_when_a_study_was_interrupted_then_only_what_is_missing_is_flown(
    tmp_path: Path, expected: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    flights: list[int] = []

    def counted(task: ChunkTask) -> ChunkResult:
        if len(flights) == 3:
            raise KeyboardInterrupt
        flights.append(task.chunk)
        return fly_chunk(task)

    monkeypatch.setattr(running, "fly_chunk", counted)
    folder = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt):
        flown(study_of(), folder)
    assert flights == [0, 1, 2]
    # One chunk is half written, as after a power cut; one write was never finished.
    damaged = folder / "chunks" / "000001.parquet"
    damaged.write_bytes(damaged.read_bytes()[:200])
    (folder / "chunks" / ".000004.parquet.0123abcd.part").write_bytes(b"half")
    monkeypatch.setattr(
        running, "fly_chunk", lambda task: flights.append(task.chunk) or fly_chunk(task)
    )
    assert flown(study_of(), folder).equals(expected)
    assert flights[3:] == [1, 3, 4, 5]
    assert not list((folder / "chunks").glob(".*.part"))


def test_when_a_folder_holds_another_study_then_it_is_left_alone(tmp_path: Path) -> None:
    flown(study_of(), tmp_path)
    before = (tmp_path / "results.parquet").read_bytes()
    with pytest.raises(StudyError, match="another study"):
        flown(study_of(seeds=[7]), tmp_path)
    assert (tmp_path / "results.parquet").read_bytes() == before


def test_when_a_flight_has_no_figures_then_the_table_says_why(tmp_path: Path) -> None:
    study = study_of(
        grid={"coder.correction": ["held", "impulse"]}, set={"coder": {"gains": [4000.0, 9e7]}}
    )
    table = flown(study, tmp_path)
    assert "ok" not in table["outcome"].to_pylist()
    assert all("diverged" in one or "sin takes" in one for one in table["outcome"].to_pylist())


def test_when_a_worker_runs_other_sources_then_it_refuses(tmp_path: Path) -> None:
    from tenbaud.studies.chunk import task_of

    with pytest.raises(StudyError, match="another version"):
        fly_chunk(task_of(study_of(), 0)._replace(sources="other"))


def test_when_a_pool_process_is_killed_then_its_chunks_are_flown_again(
    tmp_path: Path, expected: Any
) -> None:
    from multiprocessing import active_children

    killed = []

    def kill_one(done: int, total: int) -> None:
        if done >= 4 and not killed and (children := active_children()):
            killed.append(children[0].pid)
            os.kill(killed[0], signal.SIGKILL)

    study = study_of()
    table = run_study(study, Results(study, tmp_path / "out"), kill_one, workers=2)
    assert killed
    assert table.equals(expected)


def test_when_the_command_is_killed_then_the_same_command_goes_on(
    tmp_path: Path, expected: Any
) -> None:
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps(SMALL))
    out = tmp_path / "out"
    command = [sys.executable, "-m", "tenbaud", "sweep", str(path), "--out", str(out), "--workers", "1"]
    command.append("--no-plots")
    first = subprocess.Popen(command, env=ENVIRONMENT, stderr=subprocess.DEVNULL)
    try:
        _until(lambda: len(list((out / "chunks").glob("*.parquet"))) >= 2)
    finally:
        first.kill()
        first.wait()
    kept = {one: one.stat().st_mtime_ns for one in (out / "chunks").glob("*.parquet")}
    subprocess.run(command, env=ENVIRONMENT, check=True, capture_output=True, timeout=60)
    assert all(one.stat().st_mtime_ns == written for one, written in kept.items())
    assert pq.read_table(out / "results.parquet").equals(expected)


def test_when_the_command_is_killed_then_its_processes_do_not_outlive_it(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps(SMALL | {"seeds": 2000}))
    command = [sys.executable, "-m", "tenbaud", "sweep", str(path), "--out", str(tmp_path / "out")]
    first = subprocess.Popen([*command, "--workers", "2"], env=ENVIRONMENT, stderr=subprocess.DEVNULL)
    try:
        _until(lambda: len(list((tmp_path / "out" / "chunks").glob("*.parquet"))) >= 2)
        workers = [
            one for one in psutil.Process(first.pid).children() if "spawn_main" in str(one.cmdline())
        ]
    finally:
        first.kill()
        first.wait()
    assert len(workers) == 2
    _until(lambda: not any(worker.is_running() for worker in workers), 10.0)


def test_when_no_scheduler_answers_then_the_error_says_where(tmp_path: Path) -> None:
    address = free_endpoint().replace("tcp/", "tcp://")
    with pytest.raises(StudyError, match=f"no Dask scheduler answers at {address}"):
        flown(study_of(), tmp_path, scheduler=address)


def test_when_a_cluster_loses_a_worker_in_flight_then_nothing_is_lost(tmp_path: Path) -> None:
    study = study_of(seeds=12)
    expected = flown(study, tmp_path / "one")
    address = free_endpoint().replace("tcp/", "tcp://")
    with cluster(address, tmp_path) as workers:
        killed = []

        def kill_one(done: int, total: int) -> None:
            if not killed and 0 < done < total // 2:
                killed.append(workers[0].pid)
                workers[0].kill()

        results = Results(study, tmp_path / "cluster")
        table = run_study(study, results, kill_one, scheduler=address)
    assert killed
    assert table.equals(expected)


@contextmanager
def cluster(address: str, folder: Path) -> Iterator[list[subprocess.Popen[bytes]]]:
    """Within the `with` there are a real scheduler and two workers, each a separate process."""
    host, _, port = address.removeprefix("tcp://").rpartition(":")
    dask = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    started: list[subprocess.Popen[bytes]] = []

    def start(command: list[str]) -> subprocess.Popen[bytes]:
        log = (folder / f"{len(started)}.log").open("wb")
        started.append(
            subprocess.Popen(command, env=ENVIRONMENT, cwd=folder, stdout=log, stderr=subprocess.STDOUT)
        )
        return started[-1]

    try:
        start([*dask, "--host", host, "--port", port, "--no-dashboard", "--no-show"])
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny"]
        worker += ["--nthreads", "1", "--host", host, "--no-dashboard", "--death-timeout", "60"]
        workers = [start(worker) for _ in range(2)]
        _until_workers(address, 2)
        yield workers
    finally:
        for process in reversed(started):
            process.kill()
            process.wait()


def _until_workers(address: str, count: int) -> None:
    from distributed import Client

    with Client(address, timeout=40) as client:  # type: ignore[no-untyped-call]
        client.wait_for_workers(count, timeout=40)  # type: ignore[no-untyped-call]


def _until(condition: Any, timeout_s: float = 60.0) -> None:
    until = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < until, "it never came to this"
        time.sleep(0.02)
