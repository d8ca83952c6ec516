"""Recordings of earlier versions open, replay and audit for ever."""

from __future__ import annotations

from pathlib import Path

import pytest

from tenbaud import Run
from tenbaud.audit.audit import audit
from tenbaud.recording.comparison import Verdict
from tenbaud.recording.diff import compare_runs
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay

RECORDINGS = Path(__file__).parents[2] / "golden" / "recordings"
TWO_EPOCHS = RECORDINGS / "two-epochs-0.1.0"


def test_every_recording_here_is_tested() -> None:
    assert [path for path in sorted(RECORDINGS.iterdir()) if path.is_dir()] == [TWO_EPOCHS]


def test_it_opens() -> None:
    run = Run(TWO_EPOCHS)
    assert run.complete
    assert run.metadata["version"] == "0.1.0"
    assert len(run.table("transmitter", "tick")) == 400
    assert run.pitch[-1] == 1.717297062678292
    # Its rows are read with the names of today.
    assert run.table("transmitter", "tick")["measured"].shape == (400, 1)
    assert run.table("receiver", "tick")["reference"][0].tolist() == [run.reference[5]]
    assert run.table("receiver", "tick")["command"].shape[1] == 2
    assert run.table("transmitter", "gap")["density"][-1] == pytest.approx(0.00666499)
    assert run.config.timing.lead_ticks == 5
    assert run.summary["rejoins"] == 1


def test_it_replays_to_the_last_bit() -> None:
    replayed = replay(load_record(TWO_EPOCHS))
    assert replayed.equal, replayed.differences
    assert (replayed.epochs, replayed.samples, replayed.digests_compared) == (2, 78, 141)


def test_its_audit_passes() -> None:
    result = audit(TWO_EPOCHS)
    assert result.passed, result.leaks + result.gaps
    assert (result.counted.symbols_sent, result.counted.erased) == (70, 27)
    assert result.rejoin_bytes == 64


def test_its_ends_do_not_differ() -> None:
    compared = compare_runs(TWO_EPOCHS)
    assert compared.verdict is Verdict.EQUAL, str(compared)
    assert compared.rows == 63
