"""What a flight that turns motors needs, and who is exempt from it."""

from __future__ import annotations

import itertools
import shlex
import subprocess
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from channel.codec.signals import Signals
from channel.protocol.frames import Hello, Welcome, Why
from channel.protocol.wire import DATAGRAM
from receiver.controllers.references import Constant, LimitedReference, Square, SteeredReference
from tenbaud import fly
from tenbaud.build.codec import build_model
from tenbaud.build.ends import build_receiver
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
from transmitter.rigs.formats.doubles import DoublesLayout
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
    assert require_safe(configured("hil", *without, "limits.command_max=5", path=written)), "typed now"
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


@pytest.mark.parametrize(("form", "samples_per_s"), [("cobs", None), ("ascii", None), ("ascii", 50.0)])
def test_the_emulator_says_that_it_is_one_and_nothing_is_sent_to_it(
    form: Any, samples_per_s: float | None
) -> None:
    with emulated(form, samples_per_s=samples_per_s) as emulator:
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
    layout = DoublesLayout(("flags", "c0"))
    status = [layout.decode(layout.struct.pack(one, 0.0)).flags for one in (163.0, 163.4, 419.0)]
    assert [DeviceFlag.EMULATED in one for one in status] == [True, False, False]
    assert all(one & 0x0F == 3 for one in status)


def test_one_sample_that_looks_like_the_emulators_is_not_enough() -> None:
    with emulated("cobs") as emulator:
        sample = emulator.device.sample
        count = itertools.count(1)
        emulator.device.sample = lambda now_ns: (  # type: ignore[method-assign]
            _undeclared(sample(now_ns)) if next(count) % 20 == 0 else sample(now_ns)
        )
        assert "stay off" in refusal(configured(f"cobs:{emulator.line.address}"))


def test_an_emulator_at_the_encoders_says_nothing_of_motors_at_another_port() -> None:
    with emulated("cobs") as emulator:
        motors = "transmitter.serial.motor_port='/dev/null'"
        assert "stay off" in refusal(configured(f"cobs:{emulator.line.address}", motors))


def test_a_real_device_is_refused_over_its_port_before_anything_is_sent() -> None:
    with emulated("cobs") as emulator:
        sample = emulator.device.sample
        emulator.device.sample = lambda now_ns: _undeclared(sample(now_ns))  # type: ignore[method-assign]
        text = refusal(configured(f"cobs:{emulator.line.address}"))
        assert text.startswith(f"the motors of rig at {emulator.line.address}, cobs stay off")
        assert emulator.device.counts["commands"] == 0


def _undeclared(sample: Any) -> Any:
    return sample._replace(flags=sample.flags & DeviceFlag(0x0F))


def test_a_controller_from_outside_is_refused_by_its_name_too() -> None:
    text = refusal(configured("hil", *SETTINGS, "receiver.controller='tests.nowhere:Law'"))
    assert "receiver.controller: it may follow set-points of its own" in text


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


def test_an_end_with_a_folder_of_its_own_is_checked_too(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["transmit", "--clock", "real", "--rig", "hil", "--run-folder", str(tmp_path)]
    assert run(words) == ExitCode.USAGE
    assert "the motors of Quanser q8_usb 0 stay off" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_an_identification_excites_no_real_rig(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rig.toml").write_text('[transmitter]\nrig = "hil"\n')
    out = tmp_path / "out"
    assert run(["identify", "--config", str(tmp_path / "rig.toml"), "--out", str(out)]) != ExitCode.OK
    said = capsys.readouterr().err
    assert "the motors of Quanser q8_usb 0 stay off" in said
    assert "`tenbaud identify run`" in said
    assert not out.exists()


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


def test_a_receiver_that_starts_late_moves_the_set_point_from_its_estimate() -> None:
    limits = ("limits.set_point_max=0.16", "limits.set_point_slew_per_s=0.1")
    agreement = agree(configured("simulated", *limits, "model.start=[0.1,0,0,0]"), "virtual")
    session = build_receiver(agreement, None, DATAGRAM).session
    identity, sample = agreement.identity, 36_000
    greeting = Hello(5, identity.version, identity.config_digest, identity.numerics_probe)
    late = replace(greeting, session=99, epoch=3, request=1, why=Why.UNKNOWN, sample=sample)
    (welcome,) = session.on_frame(late, 0)
    assert isinstance(welcome, Welcome)
    first = welcome.first_sample * agreement.terms.ticks_per_sample
    controller = session._commander._asker._controller
    values = [controller.references(tick)[0] for tick in range(first, first + 100)]
    steps = [abs(after - before) for before, after in pairwise([0.1, *values])]
    assert first >= sample * 10
    assert max(steps) < 0.00101


def test_what_came_before_a_late_start_is_not_gone_through() -> None:
    asked: list[int] = []

    class Asked(Constant):
        def value(self, tick: int) -> float:
            asked.append(tick)
            return self.level

    steered = SteeredReference(LimitedReference(Asked(1.0, 0.01), 0.0, 0.5, 0.01))
    steered.begin(10**9, 0.3)
    assert steered.value(10**9 + 4) == pytest.approx(0.35)
    assert len(asked) == 5


def test_the_set_points_of_all_samples_that_are_not_recorded_yet_are_known() -> None:
    words = ("timing.tick_s=0.001", "timing.symbol_period_s=1.0", "limits.set_point_slew_per_s=0.001")
    config = configured("simulated", *words, "timing.lead_ticks=0")
    (reference,) = build_references(config, configured_signals(config), build_model(config))
    assert reference is not None
    values = [reference.value(tick) for tick in range(34_000)]
    assert reference.value(2_000) == values[2_000] != values[2_001]


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
