"""A replay takes from its recording what nobody has set."""

from __future__ import annotations

import csv
import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from channel.protocol.frames import Hello
from channel.protocol.identity import differing_fields
from receiver.session.rejoin import difference
from tenbaud.build.emulator import build_emulator
from tenbaud.build.ends import guard_settings
from tenbaud.build.flight import Agreement, agree
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.recorded import flight_config, nearest_tick_s, replay_notes
from tenbaud.config.load import ConfigError, dump_config, merged, nested
from tenbaud.config.schema import FlightConfig
from tenbaud.files.whole import write_whole
from tenbaud.flight.fly import fly
from tenbaud.log.angles import step_of
from tenbaud.recording.convert import convert
from tenbaud.studies.flights import CompiledPoint
from tenbaud.studies.plain import fly_plain

Rows = Callable[[float], Sequence[float]]
"""The values of a row at a time."""


def written(path: Path, names: str, row: Rows, period_s: float = 0.02, duration_s: float = 6.0) -> Path:
    """Write a log with a clock."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["time", *names.split()])
        for at in range(round(duration_s / period_s)):
            time_s = 40.0 + at * period_s
            writer.writerow([f"{time_s:.4f}", *[f"{value:.6f}" for value in row(at * period_s)]])
    return path


def pitch_log(folder: Path, period_s: float = 0.02, start_rad: float = 0.5) -> Path:
    """Write a log in rad and V, in motion from its first row on and beyond the preset's limits."""

    def row(time_s: float) -> Sequence[float]:
        volts = 11.3 if time_s % 2.0 < 1.0 else -2.0
        return start_rad + 0.4 * math.sin(1.3 * time_s), volts, 0.0

    return written(folder / "rad.csv", "angle u1 u2", row, period_s)


def replay(file: Path, **settings: Any) -> dict[str, Any]:
    """Return the overrides of `--rig replay:FILE`; `a__b` stands for `a.b`."""
    rig = nested(
        {
            "transmitter.rig": "replay",
            "receiver.controller": "recorded",
            "flight_log.file": str(file),
            "link.kind": "memory",
        }
    )
    return merged(rig, nested({name.replace("__", "."): value for name, value in settings.items()}))


def agreed(config: FlightConfig) -> Agreement:
    return agree(config, "virtual")


def test_a_log_flies_on_its_own_tick_limits_duration_and_start(tmp_path: Path) -> None:
    config = flight_config("tuned-10baud", None, replay(pitch_log(tmp_path)))
    assert (config.timing.tick_s, config.timing.symbol_period_s) == (0.02, 0.1)
    assert config.duration_s == 6.0
    assert config.limits.command_max == (12.0, 5.0)
    assert config.limits.initial_command == (11.3, 0.0)
    assert agreed(config).codec.initial().model == (0.5, 0.0, 0.0, 0.0)
    notes = "\n".join(replay_notes(config))
    for said in (
        "300 rows, 6 s; tick 0.02 s",
        "front up to 11.3 V (limit 12)",
        "starts at pitch = 0.5",
    ):
        assert said in notes


def test_the_flight_applies_each_recorded_value_as_it_is_and_begins_without_an_error(
    tmp_path: Path,
) -> None:
    file = pitch_log(tmp_path)
    run = fly(settings=flat(replay(file)), out=tmp_path / "run")
    log = read_flight_log(run.config)
    assert run.summary["flight_log_notes"] == list(replay_notes(run.config))
    assert len(run.pitch) == len(log) == 300
    assert np.array_equal(run.pitch, log.measured[:, 0])
    assert np.array_equal(run.front_command, np.round(log.commands[:, 0], 3))
    assert abs(run.error_coded[0]) < 0.1 < 0.5
    assert run.metadata["flight_log_notes"].startswith("300 rows")


def test_both_ends_come_to_the_same_configuration_and_so_does_the_one_that_was_written_down(
    tmp_path: Path,
) -> None:
    file = pitch_log(tmp_path, 0.021)
    rig = flight_config("tuned-10baud", None, replay(file, duration_s=3.0, seed=7))
    desk = flight_config("tuned-10baud", None, replay(file))
    assert agreed(rig).identity == agreed(desk).identity
    (tmp_path / "flown.toml").write_text(dump_config(rig))
    again = flight_config(None, tmp_path / "flown.toml", {})
    assert again == rig
    (tmp_path / "tuned.toml").write_text("[model]\nstart = []\n")
    assert flight_config("tuned-10baud", tmp_path / "tuned.toml", replay(file)).model == rig.model
    assert np.array_equal(read_flight_log(again).measured, read_flight_log(rig).measured)


def test_rows_that_are_no_whole_part_of_a_symbol_period_are_resampled(tmp_path: Path) -> None:
    config = flight_config("uiuc-10baud", None, replay(pitch_log(tmp_path, 0.03)))
    log = read_flight_log(config)
    assert config.timing.tick_s == 0.025 == log.tick_s
    assert len(log) == 240
    times = np.arange(239) * 0.025
    assert log.measured[:239, 0] == pytest.approx(0.5 + 0.4 * np.sin(1.3 * times), abs=3e-4)
    assert set(log.commands[:, 0]) == {11.3, -2.0}
    assert "resampled: rows 0.03 s apart, ticks 0.025 s" in replay_notes(config)


@pytest.mark.parametrize(
    ("period_s", "tick_s"),
    [(0.02, 0.02), (0.002, 0.002), (0.0201, 0.02), (0.0667, 0.05), (0.9, 0.1), (0.015, 0.0125)],
)
def test_the_tick_divides_the_symbol_period(period_s: float, tick_s: float) -> None:
    assert nearest_tick_s(period_s, 0.1) == pytest.approx(tick_s, rel=1e-12)


@pytest.mark.parametrize(
    ("setting", "value", "said"),
    [
        ("limits__command_max", 5.0, "rad.csv: the input front reaches 11.3 V, and .*command_max = 5"),
        ("limits__command_slew_per_s", 10.0, "front changes by up to 665 V/s, and .* = 10 would slow"),
        (
            "flight_log__scales",
            {"front": 10.0},
            "front reaches 113 V, and a command carries at most 32.767",
        ),
    ],
)
def test_a_setting_that_contradicts_the_recording_is_refused(
    tmp_path: Path, setting: str, value: Any, said: str
) -> None:
    with pytest.raises(ConfigError, match=said):
        flight_config("uiuc-10baud", None, replay(pitch_log(tmp_path), **{setting: value}))


def test_what_is_given_stays_and_a_start_that_is_off_is_named(tmp_path: Path) -> None:
    given = {
        "timing__tick_s": 0.01,
        "limits__command_max": 20.0,
        "duration_s": 4.0,
        "model__start": [0.1, 0.0, 0.0, 0.0],
    }
    config = flight_config("uiuc-10baud", None, replay(pitch_log(tmp_path), **given))
    assert (config.timing.tick_s, config.limits.command_max, config.duration_s) == (0.01, 20.0, 4.0)
    notes = replay_notes(config)
    assert "the codec starts at pitch = 0.1 rad, and the recording at 0.5: set model.start" in notes


def test_a_recording_of_three_axes_takes_its_model_along_to_another_tick(tmp_path: Path) -> None:
    def row(time_s: float) -> Sequence[float]:
        return 0.1 * math.sin(time_s), 0.2, -0.1, 2.7, 2.6

    file = written(tmp_path / "axes.csv", "travel elevation pitch front rear", row)
    config = flight_config("helicopter-10baud", None, replay(file))
    agreement = agreed(config)
    codec = agreement.codec
    assert config.timing.tick_s == 0.02
    assert codec.model.measured(codec.initial().model) == (0.0, 0.2, -0.1)
    assert agreement.terms.initial_command == (2.7, 2.6)
    run = fly("helicopter-10baud", settings=flat(replay(file)), out=tmp_path / "run")
    assert np.max(np.abs(run.error_coded_elevation[:5])) < 0.01


def test_small_commands_travel_in_finer_steps(tmp_path: Path) -> None:
    file = written(tmp_path / "small.csv", "arm pendulum voltage", lambda time_s: (0.0, 0.0, 0.02))
    config = flight_config("furuta-50baud", None, replay(file))
    assert agreed(config).terms.signals.steps_per_unit == (1e6,)
    assert agreed(config).terms.limits.command_max == (0.02,)


def test_without_commands_zero_is_commanded_and_said(tmp_path: Path) -> None:
    file = written(tmp_path / "angle.csv", "angle", lambda time_s: (0.1 * math.sin(time_s),))
    config = flight_config(None, None, replay(file))
    assert config.preset == "uiuc-10baud"
    assert "the file has no commands: zero is commanded" in replay_notes(config)
    figures, _ = CompiledPoint(config).fly(1)
    assert repr(figures._replace(engine="")) == repr(fly_plain(config)._replace(engine=""))


def test_nothing_is_protected_on_a_recording(tmp_path: Path) -> None:
    """An angle that stands under full voltage, beyond a soft limit, is a recording like any other."""
    file = written(tmp_path / "bench.csv", "angle u1 u2", lambda time_s: (2.0, 6.0, -6.0))
    config = flight_config(None, None, replay(file, transmitter__soft_limits=1.0))
    settings = guard_settings(agreed(config))
    assert settings.soft_limits == ()
    assert settings.timeout_ticks == round(config.link.peer_timeout_s / 0.02)
    figures, _ = CompiledPoint(config).fly(1)
    plain = fly_plain(config)
    assert (plain.outcome, plain.samples) == ("ok", 60)
    assert repr(figures._replace(engine="")) == repr(plain._replace(engine=""))


def test_the_emulator_turns_its_encoder_as_a_log_in_rad_says(tmp_path: Path) -> None:
    config = flight_config(None, None, replay(pitch_log(tmp_path)))
    emulator = build_emulator(config, "cobs", "pty")
    emulator.device.command(0, (0.0, 0.0), True)
    assert emulator.device.sample(1).counts[1] == round(0.5 / math.tau * 4096)


def test_an_export_of_a_flight_is_replayed(tmp_path: Path) -> None:
    first = fly("paper-10baud", settings={"duration_s": 3.0}, out=tmp_path / "first")
    convert(first, "csv", tmp_path / "csv")
    again = fly(settings=flat(replay(tmp_path / "csv" / "flight.csv")), out=tmp_path / "again")
    assert np.array_equal(again.measured, first.measured)
    assert np.array_equal(again.front_command, first.front_command)


@pytest.mark.parametrize("step", [math.tau / 4096.0, 0.1, 1e-4])
def test_the_step_of_a_quantised_signal_is_found(step: float) -> None:
    smooth = np.sin(np.arange(5000) * 0.013)
    assert step_of(np.round(smooth / step) * step) == pytest.approx(step, rel=1e-6)
    assert step_of(np.round(np.round(smooth / step) * step, 6)) == pytest.approx(step, rel=1e-3)
    assert step_of(smooth * math.pi) == 0.0
    assert step_of(np.ones(9)) == 0.0


def flat(values: dict[str, Any]) -> dict[str, Any]:
    """Return nested settings by their full names, without the link."""
    from tenbaud.config.load import flattened

    return {name: value for name, value in flattened(values) if name != "link.kind"}


@pytest.mark.parametrize("text", ["transmitter = 5", "timing = 3", "flight_log = []"])
def test_a_value_in_place_of_a_section_is_an_error_in_words(tmp_path: Path, text: str) -> None:
    (tmp_path / "wrong.toml").write_text(text)
    name = text.split()[0]
    over = {"transmitter": {"rig": "replay"}} if name == "timing" else {}
    with pytest.raises(ConfigError, match=f"wrong.toml.*\n  {name}"):
        flight_config(None, tmp_path / "wrong.toml", over)


def test_ends_that_read_other_commands_refuse_each_other(tmp_path: Path) -> None:
    file = pitch_log(tmp_path)
    rig, desk = (
        agreed(flight_config("tuned-10baud", None, replay(file, **changes))).identity
        for changes in ({}, {"flight_log__signs": {"front": -1}})
    )
    assert differing_fields(desk.config, rig.config)[0].startswith("flight_log.digest: here ")
    hello = Hello(1, rig.version, rig.config_digest, rig.numerics_probe)
    assert "the shared configuration differs" in str(difference(hello, desk))


def test_a_run_folder_whose_file_changed_is_read_again(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    for start_rad in (0.5, 0.25):
        pitch_log(tmp_path, start_rad=start_rad).replace(folder / "flight.csv")
        config = flight_config("tuned-10baud", None, replay(folder))
        assert read_flight_log(config).measured[0, 0] == start_rad


def test_a_duration_beyond_the_recording_has_a_note(tmp_path: Path) -> None:
    config = flight_config("tuned-10baud", None, replay(pitch_log(tmp_path), duration_s=60.0))
    assert config.duration_s == 6.0
    assert "60 s were asked for" in replay_notes(config)[1]


def test_a_log_in_a_folder_whose_name_is_no_utf_8_is_read_written_and_read_again(
    tmp_path: Path,
) -> None:
    folder = tmp_path / os.fsdecode(b"caf\xe9")
    folder.mkdir()
    config = flight_config(None, None, replay(pitch_log(folder)))
    assert len(read_flight_log(config)) == 300
    write_whole(tmp_path / "config.toml", dump_config(config))
    assert (
        flight_config(None, tmp_path / "config.toml")
        == config
        == FlightConfig.of_text(config.as_text())
    )
