from __future__ import annotations

import math
import threading
from pathlib import Path

import pytest

from tenbaud.build.first_contact import require_safe
from tenbaud.build.recorded import flight_config
from tenbaud.checks.rigcheck import check_rig, show_check
from tenbaud.cli.app import run
from tenbaud.config.load import load_config
from tests.transmitter.rigs.emulated import emulated, rig_config
from transmitter.rigs.emulator.device import RigEmulator
from transmitter.rigs.formats.samples import RawSample


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


def turned_by_hand(emulator: RigEmulator, ends: tuple[int, int]) -> None:
    """Have somebody turn the pitch from one end to the other, and back."""
    sample = emulator.device.sample

    def turned(now_ns: int) -> RawSample:
        # It is held at both ends, so that a late sample sees them too.
        swing = 1.5 * math.cos(now_ns / 1e9 * math.tau / 0.8)
        share = 0.5 - 0.5 * min(max(swing, -1.0), 1.0)
        return sample(now_ns)._replace(counts=(0, round(ends[0] + (ends[1] - ends[0]) * share), 0))

    emulator.device.sample = turned  # type: ignore[method-assign]


@pytest.mark.parametrize("ends", [(-400, 500), (-5, 500)])
def test_soft_limits_follow_from_the_range_that_was_turned(
    ends: tuple[int, int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    written = tmp_path / "rig.toml"
    with emulated("cobs") as emulator:
        turned_by_hand(emulator, ends)
        rig = ("rig-check", "--rig", f"cobs:{emulator.line.address}", "--seconds", "1.5")
        patient = ("--set", "transmitter.bridge.stale_s=1.0", "--set", "limits.command_max=2.5")
        assert run([*rig, *patient, "--write", str(written)]) == 0
        assert emulator.device.counts["commands"] == 0
        # A first flight by the file needs nothing else.
        assert require_safe(flight_config(None, written))
    config = load_config(None, written)
    turned = ends[0] == -400
    assert config.transmitter.soft_limits == (0.55 if turned else 0.5)
    assert config.limits.command_max == 2.5
    assert config.limits.set_point_max == pytest.approx(0.17 if turned else 0.16)
    assert (config.transmitter.rig, config.transmitter.serial.port) == ("serial", emulator.line.address)
    assert config.transmitter.bridge.stale_s == 1.0
    said = " ".join(capsys.readouterr().out.split())
    assert ("its soft limit is a guess" in said) != turned
    assert "not seen: the motors (front, rear)" in said
    assert run([*rig, "--write", str(written)]) == 2, "a file that is there is kept"


def test_what_a_person_had_set_is_written_with_the_proposal(tmp_path: Path) -> None:
    own, written = tmp_path / "own.toml", tmp_path / "rig.toml"
    own.write_text(
        'preset = "helicopter-10baud"\n[receiver.reference]\namplitude = 0.05\n'
        "[limits]\nvolts_max = 2.0\nset_point_max = 9.0\n"
    )
    with emulated("cobs") as emulator:
        rig = ("rig-check", "--rig", f"cobs:{emulator.line.address}", "--seconds", "0.3")
        own_words = ("--config", str(own), "--set", "link.peer_timeout_s=7", "--write", str(written))
        with pytest.warns(FutureWarning, match="limits.volts_max"):
            run([*rig, *own_words, "--set", "transmitter.bridge.stale_s=1.0"])
    config = flight_config(None, written)
    assert (config.preset, config.link.peer_timeout_s) == ("helicopter-10baud", 7.0)
    assert config.receiver.reference.amplitude == 0.05
    assert config.limits.command_max == 2.0
    assert config.limits.set_point_max != 9.0, "what is proposed is the safer"
    assert require_safe(config)
