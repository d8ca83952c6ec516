from __future__ import annotations

import threading

import pytest

from tenbaud.checks.rigcheck import check_rig, show_check
from tests.transmitter.rigs.emulated import emulated, rig_config


def checked_config(address: str, stale_s: float = 0.5):  # type: ignore[no-untyped-def]
    return rig_config(
        rig="serial",
        serial={"port": address, "format": "cobs"},
        bridge={"stale_s": stale_s, "pitch": {"sign": -1}},
    )


def test_it_reads_counts_rates_and_gaps_and_sends_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with emulated("cobs") as emulator:
        result = check_rig(checked_config(emulator.line.address), 1.5, live=False)
        assert emulator.device.counts["commands"] == 0
    assert result.problems == []
    assert result.samples > 300
    assert result.longest_gap_ms > 0
    assert result.device_clock_ppm is not None
    assert abs(result.device_clock_ppm) < 200_000
    assert [axis.name for axis in result.axes] == ["travel", "pitch", "elevation"]
    assert not any(axis.moved for axis in result.axes)
    show_check(result)
    assert "pitch.zero_counts = 0" in capsys.readouterr().out


def test_an_axis_that_turns_is_seen_with_its_sign_and_rate() -> None:
    with emulated("cobs", watchdog_s=5.0) as emulator:
        # Somebody turns the body: here the emulator's own motors do.
        timer = threading.Timer(0.3, lambda: emulator.device.command(_now(), (3.0, -3.0), True))
        timer.start()
        result = check_rig(checked_config(emulator.line.address), 1.5, live=False)
    pitch = result.axes[1]
    assert pitch.moved
    assert pitch.counts_last > 50
    assert pitch.angle_rad < -0.05, "the sign is turned round"
    assert 0.1 < pitch.rate_max_rad_per_s < 20


def test_trouble_is_named() -> None:
    faults = ("drop=0.01",)
    with emulated("cobs", faults=faults, samples_per_s=100.0) as emulator:
        result = check_rig(checked_config(emulator.line.address, 0.005), 1.0, live=False)
    text = "\n".join(result.problems)
    assert "samples/s: at least two per tick" in text
    assert "without a sample" in text
    assert "missing in the sequence" in text
    assert "damaged" in text


def _now() -> int:
    import time

    return time.monotonic_ns()
