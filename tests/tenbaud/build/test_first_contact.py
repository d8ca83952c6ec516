"""What a flight that turns motors needs, and who is exempt from it."""

from __future__ import annotations

import shlex
import subprocess
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from channel.codec.signals import Signals
from receiver.controllers.references import Constant, LimitedReference, Square, SteeredReference
from tenbaud import fly
from tenbaud.build.codec import build_model
from tenbaud.build.first_contact import drives_motors, require_safe
from tenbaud.build.flight import agree
from tenbaud.build.recorded import flight_config
from tenbaud.build.references import build_references
from tenbaud.build.signals import configured_signals
from tenbaud.cli import options
from tenbaud.cli.app import run
from tenbaud.config.load import ConfigError, dump_config, load_config
from tenbaud.flight.outcome import ExitCode
from tenbaud.studies.arrays import targets_of
from tests.transmitter.rigs.emulated import emulated
from transmitter.rigs.formats.samples import DeviceFlag, flags_of

FIELDS = (
    "transmitter.soft_limits",
    "limits.command_max",
    "limits.set_point_max",
    "limits.set_point_slew_per_s",
)
SAFE = ("soft_limits=0.5", "command_max=1", "set_point_max=0.16", "set_point_slew_per_s=0.16")
SETTINGS = [f"{'transmitter' if one.startswith('soft') else 'limits'}.{one}" for one in SAFE]


def configured(rig: str, *settings: str, preset: str | None = None, path: Path | None = None) -> Any:
    return flight_config(preset, path, options.overrides(rig=rig, settings=list(settings)))


def refusal(config: Any) -> str:
    with pytest.raises(ConfigError) as raised:
        require_safe(config)
    return str(raised.value)


def pasted(text: str) -> list[str]:
    """Return the settings of the line to paste in a refusal."""
    (line,) = [one for one in text.splitlines() if one.lstrip().startswith("--set")]
    words = shlex.split(line)
    assert words[::2] == ["--set"] * (len(words) // 2)
    return words[1::2]


@pytest.mark.parametrize("rig", ["hil", "quarc:127.0.0.1:1"])
@pytest.mark.parametrize("preset", ["tuned-10baud", "helicopter-10baud", "uiuc-10baud"])
def test_everything_that_is_missing_is_named_and_the_line_supplies_it(rig: str, preset: str) -> None:
    text = refusal(configured(rig, preset=preset))
    assert all(f"\n  {field}: " in text for field in FIELDS), text
    assert require_safe(configured(rig, *pasted(text), preset=preset))


@pytest.mark.parametrize("left_out", range(len(FIELDS)))
def test_one_that_is_missing_is_enough(left_out: int) -> None:
    rest = [one for place, one in enumerate(SETTINGS) if place != left_out]
    text = refusal(configured("hil", *rest))
    named = [field for field in FIELDS if f"\n  {field}: " in text]
    assert named == [FIELDS[left_out]]
    assert require_safe(configured("hil", *SETTINGS))


@pytest.mark.parametrize(
    "setting",
    [
        "transmitter.soft_limits={pitch=0.5}",
        "limits.set_point_max=0.18",
        "limits.set_point_slew_per_s=0.18",
    ],
)
def test_each_output_counts_and_the_first_set_points_are_gentle(setting: str) -> None:
    field = setting.partition("=")[0]
    preset = "helicopter-10baud" if "soft" in setting else None
    text = refusal(configured("hil", *SETTINGS, setting, preset=preset))
    assert f"\n  {field}: " in text


def test_the_risk_is_accepted_by_hand_only(tmp_path: Path) -> None:
    assert require_safe(configured("hil"), accept_risk=True)
    for section in ("", "[transmitter]\n"):
        (tmp_path / "rig.toml").write_text(f"{section}accept_risk = true\n")
        with pytest.raises(ConfigError, match="accept_risk: unknown field"):
            load_config(None, tmp_path / "rig.toml")


def test_a_limit_in_a_file_that_a_flight_wrote_is_still_the_presets(tmp_path: Path) -> None:
    written = tmp_path / "config.toml"
    written.write_text(dump_config(load_config("tuned-10baud")))
    without = [one for one in SETTINGS if "command_max" not in one]
    assert "limits.command_max" in refusal(configured("hil", *without, path=written))
    mine = tmp_path / "mine.toml"
    mine.write_text("[limits]\ncommand_max = 5.0\n")
    assert require_safe(configured("hil", *without, path=mine))


def test_what_turns_no_motor_needs_nothing() -> None:
    exempt = [
        configured("simulated"),
        configured("hil:fake"),
        configured("hil", "transmitter.dry_run=true"),
    ]
    assert not any(drives_motors(one) or require_safe(one) for one in exempt)


@pytest.mark.parametrize("form", ["cobs", "ascii"])
def test_the_emulator_says_that_it_is_one_and_nothing_is_sent_to_it(form: Any) -> None:
    with emulated(form) as emulator:
        assert not require_safe(configured(f"{form}:{emulator.line.address}"))
        assert emulator.device.counts["commands"] == 0


@pytest.mark.parametrize("flags", [False, True])
def test_raw_doubles_can_say_it_in_their_flags_only(flags: bool) -> None:
    fields = ["transmitter.quarc.fields=['flags','travel','pitch','elevation']"] if flags else []
    config = configured("quarc:127.0.0.1:1", *fields)
    with emulated("quarc", "tcp:127.0.0.1:0", config) as emulator:
        config = configured(f"quarc:{emulator.line.address}", *fields)
        if flags:
            assert not require_safe(config)
        else:
            assert "stay off" in refusal(config)


def test_a_firmware_with_bits_of_its_own_is_no_emulator() -> None:
    declared = [byte for byte in range(256) if DeviceFlag.EMULATED in flags_of(byte)]
    assert declared == list(range(0xA0, 0xB0))


def test_a_real_device_is_refused_over_its_port_before_anything_is_sent() -> None:
    with emulated("cobs") as emulator:
        sample = emulator.device.sample
        emulator.device.sample = lambda now_ns: _undeclared(sample(now_ns))  # type: ignore[method-assign]
        text = refusal(configured(f"cobs:{emulator.line.address}"))
        assert text.startswith(f"the motors of rig at {emulator.line.address}, cobs stay off")
        assert emulator.device.counts["commands"] == 0


def _undeclared(sample: Any) -> Any:
    return sample._replace(flags=sample.flags & DeviceFlag(0x0F))


@pytest.mark.parametrize("command", ["demo", "transmit"])
def test_commands_refuse_before_anything_starts(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(subprocess, "Popen", None)
    words = [command, "--clock", "real", "--rig", "hil", "--out", str(tmp_path / "run")]
    assert run(words) == ExitCode.USAGE
    said = capsys.readouterr().err
    assert said.startswith("tenbaud: the motors of Quanser q8_usb 0 stay off; before they turn")
    assert not (tmp_path / "run").exists()


def test_a_program_is_refused_alike(tmp_path: Path) -> None:
    settings = {"transmitter.rig": "hil"}
    with pytest.raises(ConfigError, match=r"limits\.set_point_max: none for pitch"):
        fly("tuned-10baud", settings=settings, link="zenoh", clock="real", out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_set_point_limits_are_shared_and_absent_ones_change_no_digest() -> None:
    plain = configured("simulated")
    limited = configured("simulated", "limits.set_point_max=0.1")
    assert "set_point" not in plain.shared_json(0)
    assert '"set_point_max":0.1' in limited.shared_json(0)


def test_a_set_point_moves_from_the_start_within_its_limits() -> None:
    config = configured(
        "simulated",
        "limits.set_point_max=0.1",
        "limits.set_point_slew_per_s=0.2",
        "model.start=[0.3,0,0,0]",
    )
    signals: Signals = configured_signals(config)
    (reference,) = build_references(config, signals, build_model(config))
    assert reference is not None
    values = [reference.value(tick) for tick in range(2000)]
    assert values[0] == pytest.approx(0.3 - 0.002)
    assert values[99:1250] == pytest.approx([0.1] * 1151)
    assert values[1250] == pytest.approx(0.098), "the square wave turns round, slowly"
    assert values[1349:] == pytest.approx([-0.1] * 651)
    steps = [abs(after - before) for before, after in pairwise(values)]
    assert max(steps) < 0.00201
    assert reference.value(1300) == values[1300], "an earlier tick is still known"


def test_a_set_point_by_hand_keeps_to_the_limits() -> None:
    limited = LimitedReference(Square(1.0, 10.0, 0.01), 0.0, 0.1, 0.01)
    steered = SteeredReference(limited, (-1.0, 0.05))
    assert steered.stops == (-0.1, 0.05)
    steered.steer(-5.0)
    assert [steered.value(tick) for tick in (4, 20)] == pytest.approx([-0.05, -0.1])
    steered.steer(None)
    assert steered.value(40) == pytest.approx(0.1)
    free = SteeredReference(Constant(2.0, 0.01))
    free.steer(7.0)
    assert free.value(0) == 7.0


def test_a_receiver_with_other_set_point_limits_is_refused_in_the_handshake() -> None:
    own = agree(configured("simulated", *SETTINGS), "virtual").identity
    assert agree(configured("simulated", *SETTINGS), "virtual").identity == own
    other = agree(configured("simulated", *SETTINGS, "limits.set_point_max=0.3"), "virtual").identity
    assert other.config_digest != own.config_digest


def test_a_study_follows_the_same_limited_set_points() -> None:
    agreement = agree(configured("simulated", *SETTINGS), "virtual")
    model = agreement.codec.model
    (reference,) = build_references(agreement.config, agreement.signals, model)
    assert reference is not None
    values = [reference.value(tick) for tick in range(3000)]
    assert targets_of(agreement, 3000, False)[:, 0].tolist() == values
    assert max(values) == 0.16
