"""Old names in configurations and recordings: read as the new ones, with a warning, same digest."""

from __future__ import annotations

from hashlib import blake2b
from pathlib import Path
from typing import Any

import pytest

from tenbaud import fly
from tenbaud.audit.audit import audit
from tenbaud.build.flight import agree
from tenbaud.config.deprecated import MOVED, RENAMED
from tenbaud.config.load import ConfigError, load_config, preset_names, toml_text
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.beside import with_file_beside
from tenbaud.log.table import LogError
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay
from tests.tenbaud.processes import run as run_command

OLD_FILE = """
[coder]
kind = "timed"

[transmitter]
sight_bandwidth_rad_s = 42.0
"""


@pytest.mark.parametrize(
    ("overrides", "read"),
    [
        ({"transmitter": {"sight_bandwidth_rad_s": 42.0}}, 42.0),
        ({"coder": {"kind": "timed"}}, "open-loop-zoom"),
        ({"coder": {"kind": "words"}}, "pcm"),
        ({"transmitter": {"encoder_counts_per_turn": 500}}, 500),
        ({"limits": {"volts_max": 3.0}}, 3.0),
        ({"transmitter": {"plant": {"initial_angle_rad": 0.25}}}, 0.25),
    ],
)
def test_when_a_setting_has_an_old_name_then_it_is_read_with_a_warning(
    overrides: dict[str, Any], read: object
) -> None:
    with pytest.warns(FutureWarning, match="is deprecated; use"):
        config = load_config("paper-10baud", None, overrides)
    transmitter = config.transmitter
    found = (transmitter.rate_observer_bandwidth_rad_s, transmitter.encoders.counts_per_turn)
    found += (transmitter.plant.initial, config.limits.command_max)
    assert read in (*found, config.coder.kind)


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize(
    ("section", "refused"),
    [
        ({"outputs": "pitch"}, "outputs"),
        ({"inputs": 3}, "inputs"),
        ({"time": ["t"]}, "time"),
        ({"columns": "t", "time": "t"}, "columns"),
        ({"columns": ["t"], "volts_columns": ["a", "b"]}, "columns"),
    ],
)
def test_when_an_old_field_of_a_log_has_another_type_then_it_is_refused_by_name(
    section: dict[str, Any], refused: str, beside: bool, tmp_path: Path
) -> None:
    log = tmp_path / "log.csv"
    if beside:
        (tmp_path / "log.csv.toml").write_text(toml_text(section))
        given = FlightLogSection(file=str(log))
        with pytest.raises(LogError, match=rf"(?s)log\.csv\.toml.*flight_log\.{refused}"):
            with_file_beside(given)
    else:
        with pytest.raises(ConfigError, match=rf"flight_log\.{refused}"):
            load_config("paper-10baud", None, {"flight_log": section})


@pytest.mark.filterwarnings("ignore::FutureWarning")
def test_when_the_section_of_a_new_name_is_no_table_then_it_is_refused_by_name() -> None:
    given = {"transmitter": {"encoder_sign": -1, "encoders": 3}}
    with pytest.raises(ConfigError, match=r"transmitter\.encoders"):
        load_config("paper-10baud", None, given)


def test_when_a_preset_has_an_old_name_then_the_new_one_is_loaded() -> None:
    with pytest.warns(FutureWarning, match="use 'open-loop-zoom-10baud'"):
        config = load_config("timed-10baud")
    assert config == load_config("open-loop-zoom-10baud")
    assert set(RENAMED["preset"].values()) <= set(preset_names())


def test_when_a_file_has_old_names_then_the_command_names_file_and_new_name(tmp_path: Path) -> None:
    file = tmp_path / "flight.toml"
    file.write_text(OLD_FILE)
    done = run_command("demo", "--config", str(file), "--duration", "1", cwd=tmp_path)
    assert done.code == 0, done.err
    assert f"{file}: coder.kind: 'timed' is deprecated; use 'open-loop-zoom'" in done.err
    assert "use 'transmitter.rate_observer_bandwidth_rad_s'" in done.err


@pytest.mark.filterwarnings("error::FutureWarning")
@pytest.mark.parametrize("preset", ["open-loop-zoom-10baud", "usual-1000baud"])
def test_when_a_run_was_recorded_under_old_names_then_it_replays_and_passes_its_audit(
    preset: str, tmp_path: Path
) -> None:
    run = fly(preset, settings={"duration_s": 2.0}, out=tmp_path / "run")
    config = run.path / "config.toml"
    text = config.read_text()
    for names in RENAMED.values():
        for old, new in names.items():
            text = text.replace(f'"{new}"', f'"{old}"').replace(f"{new} =", f"{old} =")
    for old, new in MOVED.items():
        section, field = new.rsplit(".", 1)
        if old.startswith(f"{section}.") and old.count(".") == new.count("."):
            text = text.replace(f"{field} =", f"{old.rpartition('.')[2]} =")
    assert text != config.read_text()
    assert "volts_max = 5.0" in text
    assert "amplitude_rad = " in text
    config.write_text(text)
    replayed, audited = replay(load_record(run.path)), audit(run.path)
    assert replayed.equal, replayed.differences
    assert audited.passed, audited.leaks + audited.gaps


def test_the_digest_of_a_configuration_is_that_of_its_old_names() -> None:
    assert '"kind":"timed"' in agree(load_config("open-loop-zoom-10baud"), "virtual").identity.config
    assert '"kind":"words"' in agree(load_config("usual-1000baud"), "virtual").identity.config


def test_a_pcm_recording_from_before_there_were_several_outputs_has_the_same_digest() -> None:
    shared = load_config("usual-1000baud").shared_json(3)
    assert blake2b(shared.encode(), digest_size=16).hexdigest() == "2d2b67e5eaac75e129a0140e7a4952f2"
