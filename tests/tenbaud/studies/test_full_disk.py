"""Studies on disks that fill up: said in words, and the same command goes on with what is missing."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from channel.links.endpoints import free_endpoint
from tenbaud.files.whole import WriteError
from tenbaud.studies.run import run_study
from tenbaud.studies.table import Results
from tests.tenbaud.endings.commands import fill, left_below, small_disk
from tests.tenbaud.studies.small import study_of
from tests.tenbaud.studies.test_run import cluster, flown, ignore


@pytest.mark.parametrize("workers", [1, 2])
def test_when_the_disk_fills_up_then_it_is_reported_and_the_same_command_goes_on(
    tmp_path: Path, workers: int
) -> None:
    study = study_of()
    expected = flown(study, tmp_path / "expected")
    with small_disk(tmp_path / "disk", room_bytes=262_144) as disk:

        def fill_up(done: int, total: int) -> None:
            if done:
                fill(disk)

        with pytest.raises(WriteError, match=os.strerror(errno.ENOSPC)):
            run_study(study, Results(study, disk / "out"), fill_up, workers)
        kept = left_below(disk)
        assert kept
        assert {path.suffix for path in kept} == {".parquet"}
        (disk / "filled").unlink()
        assert run_study(study, Results(study, disk / "out"), ignore, workers).equals(expected)


def test_workers_of_a_cluster_need_no_disk(tmp_path: Path) -> None:
    study = study_of()
    expected = flown(study, tmp_path / "expected")
    address = free_endpoint().replace("tcp/", "tcp://")
    with small_disk(tmp_path / "disk", room_bytes=262_144) as disk, cluster(address, disk):
        fill(disk)
        assert flown(study, tmp_path / "out", scheduler=address).equals(expected)
