"""Flights under fire as a user flies them: what the summary, the recordings and the exit code say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tenbaud.recording.reader import Recording
from tests.tenbaud.processes import Ended, run

FAULTS = "loss=0.1,up:flip=0.02,duplicate=0.1,delay=30ms±10ms,cut=10s+2s"


def demo(folder: Path, *arguments: str) -> Ended:
    flight = ("--duration", "18", "--mismatch", "0.1", "--out", "run")
    return run("demo", "--json", *flight, *arguments, cwd=folder)


def failures(folder: Path, end: str) -> list[dict[str, Any]]:
    recording = Recording(folder / "run" / f"{end}.mcap")
    if "lockstep_failure" not in recording.topics:
        return []
    return [row for _, row in recording.rows("lockstep_failure")]


def test_when_everything_goes_wrong_then_it_is_counted_and_the_flight_ends_well(
    tmp_path: Path,
) -> None:
    ended = demo(tmp_path, "--impair", FAULTS, "--figure")
    assert ended.code == 0, ended.err
    summary = ended.summary
    assert summary["desyncs"] == 0
    assert summary["rejoins"] >= 1
    assert summary["rejoin_bytes"] > 0
    assert summary["guard_rearmed"] >= 1
    assert {"lost", "flipped", "duplicated", "cut off"} <= summary["impaired_up"].keys()
    assert "flipped" not in summary["impaired_down"]
    assert (tmp_path / "run" / "flight.png").stat().st_size > 10_000
    same = run("diff", "run", cwd=tmp_path)
    assert same.code == 0, same.out


def test_when_the_line_is_impaired_twice_alike_then_the_flights_are_equal(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        assert demo(tmp_path / name, "--impair", FAULTS, "--set", "link.kind=memory").code == 0
    compared = run("diff", "one/run", "two/run", cwd=tmp_path)
    assert compared.code == 0, compared.out


@pytest.mark.parametrize("link", ["memory", "zenoh"])
def test_when_one_end_is_corrupted_then_both_write_it_down_and_the_flight_goes_on(
    tmp_path: Path, link: str
) -> None:
    ended = demo(tmp_path, "--sabotage", "sample=150,field=range", "--set", f"link.kind={link}")
    assert ended.code == 0, ended.err
    assert (ended.summary["desyncs"], ended.summary["rejoins"]) == (1, 1)
    assert ended.summary["digest_checks"] > 170
    upper, lower = failures(tmp_path, "transmitter"), failures(tmp_path, "receiver")
    assert [row["sample"] for row in upper + lower] == [150] * 3
    found, complete = upper
    assert found["peer_state"] is None
    (other,) = lower
    assert complete["state"] == other["peer_state"] == complete["peer_state"]
    assert complete["coder"] == other["peer_coder"]
    assert complete["peer_coder"] == other["coder"]
    assert complete["coder"][0] > complete["peer_coder"][0]
    assert (complete["digest"], complete["peer_digest"]) == (other["peer_digest"], other["digest"])
    assert complete["input_samples"] == other["input_samples"] == list(range(87, 151))
    assert complete["input_words"] == other["input_words"]
    named = run("diff", "run", cwd=tmp_path)
    assert named.code == 1
    assert "sample 150" in named.out
    assert "field 'coder[0]'" in named.out


def test_when_it_is_set_to_stop_then_a_difference_ends_the_flight(tmp_path: Path) -> None:
    ended = demo(tmp_path, "--sabotage", "sample=100,field=angle", "--on-desync", "stop")
    assert ended.code == 5
    assert "after sample 100" in ended.err
    assert ended.summary["rejoins"] == 0
    assert ended.summary["duration_s"] < 18.0


def test_when_nobody_asked_for_a_difference_then_the_flight_goes_on_but_it_is_loud(
    tmp_path: Path,
) -> None:
    from channel.links.endpoints import free_endpoint
    from tests.tenbaud.processes import finish, start

    endpoint = free_endpoint()
    lower = start(
        *("receive", "--listen", endpoint, "--clock", "virtual", "--json", "--out", "lower"),
        *("--sabotage", "sample=150,field=rate"),
        cwd=tmp_path,
    )
    upper = run(
        *("transmit", "--connect", endpoint, "--clock", "virtual", "--json", "--out", "upper"),
        *("--duration", "30"),
        cwd=tmp_path,
    )
    ended = finish(lower)
    assert (upper.code, ended.code) == (5, 5)
    assert "nobody asked for it" in upper.err
    assert upper.summary["duration_s"] == 30.0
    assert upper.summary["rejoins"] == 1


def test_when_an_impairment_makes_no_sense_then_it_is_a_usage_error(tmp_path: Path) -> None:
    ended = demo(tmp_path, "--impair", "loss=2")
    assert ended.code == 2
    assert "loss=2" in ended.err


def test_when_symbols_are_best_effort_then_a_flight_is_the_same(tmp_path: Path) -> None:
    ended = demo(tmp_path, "--set", "link.best_effort=true")
    assert ended.code == 0
    assert ended.summary["erasures"] == 0
    assert ended.summary["digest_checks"] == 180
