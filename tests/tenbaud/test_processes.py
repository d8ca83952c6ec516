"""Two processes that disagree, die or are stopped: clear messages, motors safe, recordings closed."""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path

import pytest

from channel.links.endpoints import free_endpoint
from tenbaud.recording.reader import Recording
from tests.tenbaud.ends import PATIENCE_S
from tests.tenbaud.processes import finish, fly_pair, start

# Our own sine, wrong in the last place: always, or from the n-th call on. The probe of the handshake
# calls it some 2000 times, four calls a tick.
OTHER_SINE = """
import math, channel.codec.numerics as numerics
right, calls = numerics.sin, 0
def sin(x):
    global calls
    calls += 1
    y = right(x)
    return math.nextafter(y, math.inf) if calls > FIRST_WRONG_CALL else y
numerics.sin = sin
from tenbaud.cli.app import main
main()
"""


def test_when_one_ends_sine_differs_then_the_probe_refuses(tmp_path: Path) -> None:
    wrong = OTHER_SINE.replace("FIRST_WRONG_CALL", "0")
    upper, lower = fly_pair(tmp_path, receiver={"code": wrong})
    assert (upper.code, lower.code) == (3, 3)
    for ended in (upper, lower):
        assert "numerics probe differs" in ended.err


@pytest.mark.parametrize("clock", ["virtual", "real"])
def test_when_one_ends_sine_changes_in_flight_then_the_first_sample_is_named(
    tmp_path: Path, clock: str
) -> None:
    wrong = OTHER_SINE.replace("FIRST_WRONG_CALL", "4000")
    upper, lower = fly_pair(
        tmp_path,
        "--clock",
        clock,
        receiver={"code": wrong},
        transmitter={"arguments": ["--duration", "30", "--on-desync", "stop"]},
    )
    assert (upper.code, lower.code) == (5, 5), upper.err + lower.err
    recording = Recording(tmp_path / "transmit-run" / "transmitter.mcap")
    rows = [row for _, row in recording.rows("sample")]
    assert all(row["digest"] == row["peer_digest"] for row in rows[:-1])
    last = rows[-1]
    assert last["digest"] != last["peer_digest"]
    for ended in (upper, lower):
        assert f"after sample {last['sample']}: transmitter {last['digest']}" in ended.err
        assert f"receiver {last['peer_digest']}" in ended.err
    ticks = [row for _, row in recording.rows("tick")]
    assert ticks[-1]["applied"] == [0.0, 0.0]
    assert ticks[-1]["guard"] == "latched"


@pytest.mark.skipif(sys.platform != "linux", reason="GLIBC_TUNABLES is for glibc on Linux")
def test_when_one_end_has_no_fma_then_the_digests_are_the_same(tmp_path: Path) -> None:
    masked = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA"}
    upper, lower = fly_pair(
        tmp_path,
        "--clock",
        "virtual",
        receiver={"environment": masked},
        transmitter={"arguments": ["--duration", "30"]},
    )
    assert (upper.code, lower.code) == (0, 0), upper.err + lower.err
    assert upper.summary["digest_checks"] == 300
    assert upper.summary["desyncs"] == 0


def test_when_configurations_differ_then_both_name_the_field(tmp_path: Path) -> None:
    upper, lower = fly_pair(tmp_path, receiver={"arguments": ["--set", "coder.window_signs=3"]})
    assert (upper.code, lower.code) == (3, 3)
    for ended in (upper, lower):
        assert "coder.window_signs: here 2, there 3" in ended.err


def test_when_the_clocks_differ_then_both_say_so(tmp_path: Path) -> None:
    upper, lower = fly_pair(
        tmp_path,
        "--set",
        "link.peer_timeout_s=2",
        receiver={"arguments": ["--clock", "virtual"]},
        transmitter={"arguments": ["--clock", "real"]},
    )
    assert lower.code == 3
    assert "--clock" in lower.err
    assert upper.code in (3, 4)
    assert "--clock" in upper.err


@pytest.mark.parametrize("verb", ["transmit", "receive"])
def test_when_the_peer_is_absent_then_it_is_reported_in_time(tmp_path: Path, verb: str) -> None:
    flag = "--connect" if verb == "transmit" else "--listen"
    process = start(
        verb, flag, free_endpoint(), "--set", "link.peer_timeout_s=1", "--json", cwd=tmp_path
    )
    ended = finish(process)
    assert ended.code == 4
    assert "is it running" in ended.err


def _pair_in_flight(tmp_path: Path) -> dict[str, object]:
    """Start both ends on the real clock and return once both have recorded some flight."""
    endpoint = free_endpoint()
    shared = ["--set", "link.peer_timeout_s=3", "--json"]
    pair = {
        "receive": start("receive", "--listen", endpoint, "--out", "lower", *shared, cwd=tmp_path),
        "transmit": start(
            "transmit", "--connect", endpoint, "--out", "upper", "--duration", "600", *shared,
            cwd=tmp_path,
        ),
    }  # fmt: skip
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        recording = tmp_path / "upper" / "transmitter.mcap"
        if recording.is_file() and recording.stat().st_size > 20_000:
            return pair
        time.sleep(0.1)
    raise AssertionError("the pair did not get into flight")


@pytest.mark.parametrize(
    ("verb", "number", "codes"),
    [
        ("transmit", signal.SIGINT, {"transmit": 130, "receive": 0}),
        ("receive", signal.SIGTERM, {"transmit": 4, "receive": 130}),
        ("transmit", signal.SIGKILL, {"transmit": -9, "receive": 4}),
        ("receive", signal.SIGKILL, {"transmit": 4, "receive": -9}),
    ],
)
def test_when_one_end_is_stopped_or_killed_then_the_other_ends_safely(
    tmp_path: Path, verb: str, number: int, codes: dict[str, int]
) -> None:
    pair = _pair_in_flight(tmp_path)
    pair[verb].send_signal(number)
    ended = {name: finish(process) for name, process in pair.items()}
    assert {name: end.code for name, end in ended.items()} == codes, ended
    upper = Recording(tmp_path / "upper" / "transmitter.mcap")
    lower = Recording(tmp_path / "lower" / "receiver.mcap")
    assert upper.complete == (codes["transmit"] != -9)
    assert lower.complete == (codes["receive"] != -9)
    assert len(upper.topics["tick"]) > 100
    if codes["transmit"] != -9:
        last = list(upper.rows("tick"))[-1][1]
        assert last["applied"] == [0.0, 0.0]


def test_two_processes_replay_a_log_that_has_its_own_tick_limits_and_start(tmp_path: Path) -> None:
    rows = [f"{0.02 * at:.2f},{0.3 + 0.01 * at:.3f},{11.3 if at > 20 else 0},0" for at in range(200)]
    (tmp_path / "log.csv").write_text("\n".join(["clock,angle,u1,u2", *rows]) + "\n")
    shared = ("--clock", "virtual", "--rig", "replay:log.csv", "--preset", "tuned-10baud")
    upper, lower = fly_pair(tmp_path, *shared, "--columns", "angle=angle,front=u1,rear=u2,time=clock")
    assert (upper.code, lower.code) == (0, 0), upper.err + lower.err
    assert upper.summary["duration_s"] == 4.0
    assert upper.summary["config_digest"] == lower.summary["config_digest"]
    for end in (upper, lower):
        assert "tick 0.02 s" in end.err
        assert "front up to 11.3 V (limit 12)" in end.err
        assert "the codec starts at pitch = 0.3 rad, as the recording" in end.err
