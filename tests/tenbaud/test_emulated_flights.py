"""Whole flights: emulated rig, bridge, transmitter, Zenoh, receiver, and back to the motors."""

from __future__ import annotations

import json
import os
from functools import cache
from pathlib import Path

import pytest

from channel.protocol.wire import DATAGRAM
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.flight import transmit
from tenbaud.flight.summary import transmitter_part
from tenbaud.recording.reader import Recording
from tests.tenbaud.confirmed import check_flown, need_idle
from tests.tenbaud.emulated_flight import PATIENT, RigProcess, demo, fly_emulated
from tests.tenbaud.ends import wait_for

SECONDS = 3.0
SOAK_SECONDS = 60.0
OFF = [0.0, 0.0]
TCP = ("--port", "tcp:127.0.0.1:0")
# With an enable element the emulated body starts at tick 0, as the simulated one does; without it the
# first voltage that is not zero starts it, some ticks later.
VECTORS = (
    "--set",
    "transmitter.quarc.command_fields=['front','rear','enable']",
    "--set",
    "transmitter.quarc.fields=['seq','flags','travel','pitch','elevation']",
)
PEERS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "cobs": ((), ()),
    "ascii": ((), ()),
    "quarc": ((*TCP, *VECTORS), VECTORS),
}
"""What the rig and what both ends are started with, by format."""


@cache
def simulated_rms(seconds: float, lead_ticks: int) -> float:
    """Return the error of the same flight with the simulated rig, on the virtual clock."""
    changed = {
        "duration_s": seconds,
        "timing": {"lead_ticks": lead_ticks},
        "coder": {"window_signs": 3},
        "transmitter": {"plant": {"mismatch": 0.1}},
    }
    agreement = agree(load_config(None, None, changed), "virtual")
    run = transmit.prepare(agreement, None, DATAGRAM)
    endpoint = build_receiver(agreement, None, DATAGRAM)
    outcome = transmit.fly_virtual(run, endpoint, lambda: False)
    rms: float = transmitter_part(run, outcome)["error_coded_rms_rad"]
    return rms


@pytest.mark.real_time
@pytest.mark.parametrize("form", ["cobs", pytest.param("ascii", marks=pytest.mark.soak), "quarc"])
def test_an_emulated_rig_flies_like_the_simulated_one(form: str, tmp_path: Path) -> None:
    rig, ends = PEERS[form]
    flown = fly_emulated(form, tmp_path / "real", seconds=SECONDS, rig_arguments=rig, arguments=ends)
    assert flown.code == 0, flown.said
    summary, device = flown.summary, flown.device
    check_flown(summary, round(10 * SECONDS))
    assert summary["rig"].get("lost", 0) == 0
    expected = simulated_rms(SECONDS, summary["lead_ticks"])
    # What a busy machine erased or missed makes it another flight, by so much at most.
    held_up = (summary["erasures"] + summary["commands_late"] + summary["ticks_missed"]) / summary[
        "samples"
    ]
    assert summary["error_coded_rms_rad"] == pytest.approx(expected, rel=0.1 + held_up)
    assert device.get("watchdog_trips", 0) == 0
    assert (device["volts"], device["enabled"]) == (OFF, False)
    # One command a tick at most, so more of them than ticks are those of the way down.
    assert summary["rig"]["writes"] > 100 * SECONDS - summary["ticks_missed"]


def test_a_rig_that_goes_silent_ends_at_the_safe_voltage_on_both_sides(tmp_path: Path) -> None:
    flown = fly_emulated("cobs", tmp_path / "run", seconds=8.0, rig_arguments=("--fault", "silent@0.5"))
    assert flown.code == 6, flown.said
    assert "no sample from the rig" in flown.summary["sensor_fault"]
    device = flown.device
    assert device["watchdog_trips"] == 1, "the device's side: its own watchdog"
    assert (device["volts"], device["enabled"]) == (OFF, False)
    last = _last_tick(tmp_path / "run")
    assert last["guard"] == "latched", "the transmitter's side: the end of the ramp"
    assert last["applied"] == OFF


def test_an_unplugged_rig_ends_the_flight_and_flies_again_when_it_is_back(tmp_path: Path) -> None:
    link = tmp_path / "rig"
    rig = RigProcess("cobs", "--port", f"pty:{link}", "--fault", "unplug@0.5..3", "--watchdog", "1")
    try:
        # Less patient than the watch for a stuck encoder, which sees the standing counts too.
        stale = ("--set", "transmitter.bridge.stale_s=0.5")
        arguments = ("--clock", "real", "--rig", f"cobs:{link}", *PATIENT, *stale)
        first = demo(*arguments, seconds=6.0, out=tmp_path / "first")
        wait_for(link.exists, lambda: "it was not plugged in again")
        second = demo(*arguments, seconds=1.0, out=tmp_path / "second")
    finally:
        device = rig.end()
    assert first.returncode == 6
    assert "is gone" in json.loads(first.stdout)["sensor_fault"]
    assert second.returncode == 0, second.stderr
    assert (device["volts"], device["enabled"]) == (OFF, False)


def test_a_dry_run_reads_and_never_commands(tmp_path: Path) -> None:
    flown = fly_emulated("cobs", tmp_path / "run", seconds=1.0, arguments=("--dry-run",))
    assert flown.code == 0, flown.said
    assert flown.summary["rig"]["dry_run"]
    assert flown.summary["rig"]["samples"] > 100
    assert flown.device.get("commands", 0) == 0
    assert _last_tick(tmp_path / "run")["applied"] == OFF


def test_a_real_rig_is_refused_on_the_virtual_clock(tmp_path: Path) -> None:
    flown = demo("--rig", "cobs:/dev/ttyNOTHING", seconds=1.0, out=tmp_path / "run")
    assert flown.returncode != 0
    assert "--clock real" in flown.stderr


@pytest.mark.soak
@pytest.mark.parametrize("form", ["cobs", "ascii", "quarc"])
def test_a_minute_of_the_papers_coder_flies_like_the_simulated_one(form: str, tmp_path: Path) -> None:
    """The errors of the window after the first period of the reference."""
    rig, ends = PEERS[form]
    flown = fly_emulated(
        form, tmp_path / "real", seconds=SOAK_SECONDS, rig_arguments=rig, arguments=ends
    )
    assert flown.code == 0, flown.said
    check_flown(flown.summary, round(10 * SOAK_SECONDS))
    need_idle(flown.summary)
    expected = simulated_rms(SOAK_SECONDS, flown.summary["lead_ticks"])
    assert flown.summary["error_coded_rms_rad"] == pytest.approx(expected, rel=0.1)


@pytest.mark.soak
def test_the_rigs_watchdog_never_trips(tmp_path: Path) -> None:
    """With its own 100 ms, for as many minutes as asked for.

    Over TCP: bytes in a pseudo-terminal wait for a kernel worker, which a busy machine delays.
    """
    minutes = float(os.environ.get("MINUTES", "10"))
    flown = fly_emulated(
        "cobs",
        tmp_path / "run",
        seconds=60.0 * minutes,
        rig_arguments=("--watchdog", "0.1", "--port", "tcp:127.0.0.1:0"),
    )
    assert flown.code == 0, flown.said
    assert flown.device.get("watchdog_trips", 0) == 0
    assert flown.summary["rig"].get("lost", 0) == 0


def _last_tick(folder: Path) -> dict[str, object]:
    rows = [row for _, row in Recording(folder / "transmitter.mcap").rows("tick")]
    return rows[-1]
