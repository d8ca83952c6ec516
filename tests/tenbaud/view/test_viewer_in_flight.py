"""A viewer that is killed, stopped or slow, beside a flight on the real clock."""

from __future__ import annotations

import json
import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tenbaud.view.server import Address
from tests.tenbaud.confirmed import PATIENT, check_flown
from tests.tenbaud.machine import Pacer
from tests.tenbaud.processes import finish, start
from tests.tenbaud.view.viewers import beside, is_free, needs_page

pytestmark = [
    needs_page,
    pytest.mark.real_time,
    pytest.mark.skipif(not Path("/proc").is_dir(), reason="finds processes in /proc"),
]

DURATION_S = 4
STOPPED_S, RUNNING_S = 0.4, 0.1
PATIENCE_S = 240.0


def slow_then_killed(viewer: int) -> None:
    """Let it run for a fifth of the time only, then kill it."""
    for _ in range(4):
        os.kill(viewer, signal.SIGSTOP)
        time.sleep(STOPPED_S)
        os.kill(viewer, signal.SIGCONT)
        time.sleep(RUNNING_S)
    os.kill(viewer, signal.SIGKILL)


def stopped(viewer: int) -> None:
    """Let it stand until the flight ends."""
    os.kill(viewer, signal.SIGSTOP)


@pytest.mark.parametrize("trouble", [slow_then_killed, stopped])
def test_a_viewer_in_trouble_does_not_hold_the_flight_up(
    tmp_path: Path, trouble: Callable[[int], None]
) -> None:
    port = Address(port=0).checked().port
    arguments = ("--view-port", str(port), "--clock", "real", "--duration", str(DURATION_S))
    process = start("demo", "--view", *arguments, *PATIENT, "--out", "run", cwd=tmp_path)
    _wait_until_flying(tmp_path / "run" / "transmitter.mcap")
    (viewer,) = beside(port)
    with Pacer() as pacer:
        trouble(viewer)
        ended = finish(process, PATIENCE_S)
    assert ended.code == 0, ended.err
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    check_flown(summary, 10 * DURATION_S)
    said = "the live page ended before the flight, by signal 9" in ended.err
    assert said is (trouble is slow_then_killed)
    assert beside(port) == []
    assert is_free(port)
    pacer.need_idle()
    # A loop that waited for its viewer would miss hundreds.
    assert summary["rejoins"] == 0
    assert summary["erasures"] <= 2
    assert summary["ticks_missed"] <= 25


def _wait_until_flying(recording: Path) -> None:
    until_s = time.monotonic() + PATIENCE_S
    while not recording.exists() or recording.stat().st_size == 0:
        assert time.monotonic() < until_s, "no flight"
        time.sleep(0.02)
    time.sleep(0.5)
