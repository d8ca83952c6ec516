"""Recordings of flights with a narrow downlink: flown again, audited, packed; from either end alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tenbaud.audit.audit import audit
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay, replay_symbols, save_symbols
from tenbaud.replay.symbols import unpack
from tests.tenbaud.flown import flown

NARROW: dict[str, Any] = {"channel__downlink": "narrow"}
ROUGH = "loss=0.03,cut=4s+2s"


@pytest.mark.parametrize(
    ("preset", "settings"),
    [
        ("tuned-10baud", {}),
        ("tuned-10baud", {"link__impairments": ROUGH, "duration_s": 20.0}),
        ("tuned-10baud", {"downlink__scheme": "coded", "downlink__directions": [[0.5, -0.5]]}),
        ("paper-20baud", {"duration_s": 6.0, "channel__delivery": "end"}),
    ],
)
def test_both_recordings_show_equal_states(
    tmp_path: Path, preset: str, settings: dict[str, Any]
) -> None:
    run = flown(tmp_path / "run", preset, **{**NARROW, **settings})
    record = load_record(run.path)
    again = replay(record)
    assert again.equal, again.differences
    assert again.samples == run.summary["samples"]
    result = audit(run.path)
    assert result.passed, result.leaks + result.gaps
    assert result.jittered_states == again.samples
    theirs = record.rows["receiver"].topics["sample"].by_key()
    pairs = [(row, theirs[row.sample]) for row in record.rows["transmitter"].topics["sample"]]
    assert len(pairs) > 0.6 * again.samples
    assert all(ours.digest == other.digest for ours, other in pairs)


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
def test_either_recording_is_enough(tmp_path: Path, end: str) -> None:
    run = flown(tmp_path / "run", **NARROW, link__impairments="loss=0.05")
    other = {"transmitter": "receiver", "receiver": "transmitter"}[end]
    (run.path / f"{other}.mcap").unlink()
    again = replay(load_record(run.path))
    assert again.equal, again.differences
    assert again.digests_compared == again.samples > 100


def test_the_whole_flight_is_its_symbols_of_both_directions(tmp_path: Path) -> None:
    run = flown(tmp_path / "run", **NARROW, link__impairments="loss=0.1")
    replayed = replay(load_record(run.path))
    # A bit a sample up and one more that marks erasures, two down.
    assert len(replayed.packed.symbols) == len(replayed.packed.erasures) == replayed.samples // 8
    assert len(replayed.packed.down) == 2 * replayed.samples // 8
    save_symbols(replayed, tmp_path / "flight.symbols")
    unpacked = unpack(tmp_path / "flight.symbols")
    assert replay_symbols(unpacked) == (replayed.samples, unpacked.last_digest)


def test_a_state_that_was_corrupt_does_not_follow_from_the_symbols(tmp_path: Path) -> None:
    broken = flown(tmp_path / "run", **NARROW, receiver__sabotage="sample=40,field=angle")
    assert broken.summary["rejoins"] == 1
    result = audit(broken.path)
    assert not result.passed
    assert any("not what the symbols give" in line for line in result.leaks)


def test_the_rows_of_either_end_can_be_read(tmp_path: Path) -> None:
    run = flown(tmp_path / "run", duration_s=3.0, link__impairments="down:loss=0.2", **NARROW)
    sent = run.tables("receiver").topics["down_symbols"]["symbols"]
    came = run.tables("transmitter").topics["down_symbols"]["symbols"]
    assert sent.shape == came.shape == (30, 2)
    lost = came != came  # null is NaN here
    assert 3 < lost.sum() < 30
    assert (came[~lost] == sent[~lost]).all()


def test_a_flight_shorter_than_a_confirmation_takes_has_flown_all_the_same(tmp_path: Path) -> None:
    run = flown(tmp_path / "run", duration_s=0.8, **NARROW)
    assert run.summary["exit_code"] == 0
    assert run.summary["narrow"]["samples_confirmed"] < 0.5 * run.summary["samples"]
