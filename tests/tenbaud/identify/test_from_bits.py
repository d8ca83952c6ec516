"""`tenbaud identify RUN --from-bits`: a model out of symbols and commands alone."""

from __future__ import annotations

import json
import random
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.structures import PitchStructure, parse_linear
from tenbaud import identify, load_preset
from tenbaud.cli.commands import app
from tenbaud.config.load import load_config
from tenbaud.identification.bits import read_bits, symbols_of
from tenbaud.identification.linearised import linearised, start_values
from tenbaud.identification.statements import statements_of
from tenbaud.recording.folder import TRANSMITTER_NAME
from tenbaud.replay.record import epochs_of, load_record
from tests.tenbaud.flown import flown

TRUE = {"rate_damping_per_s": 0.11, "stiffness_per_s2": 0.55, "torque_gain_rad_per_v_s2": 0.385}


def identified(*arguments: str) -> Result:
    return CliRunner().invoke(app, ["identify", *arguments, "--from-bits", "--json", "--no-fly"])


def test_when_a_flight_is_over_then_its_bits_give_the_plant_without_any_measurement(
    tmp_path: Path,
) -> None:
    run = tmp_path / "run"
    flown(run, duration_s=40.0)
    both = identify(run, from_bits=True, fly=False)
    for name, true in TRUE.items():
        assert both.estimates[name] == pytest.approx(true, rel=0.01)
    assert both.beside["true"][:3] == pytest.approx(list(TRUE.values()))
    assert both.beside["measurements"][:3] == pytest.approx(list(TRUE.values()), rel=0.01)

    (run / TRANSMITTER_NAME).unlink()
    result = identified(str(run), "--out", str(tmp_path / "bits"))
    (alone,) = json.loads(result.stdout)
    assert result.exit_code == 0
    assert alone["estimates"] == both.estimates
    assert "no measurements" in " ".join(alone["notes"])
    config = load_config(None, tmp_path / "bits" / "identified.toml")
    assert config.model.model_dump()["stiffness_per_s2"] == pytest.approx(0.55, rel=0.01)
    assert config.coder == load_preset("tuned-10baud").config.coder


def test_when_both_ends_rejoin_later_then_symbols_and_commands_stay_at_their_ticks(
    tmp_path: Path,
) -> None:
    sabotage = {"receiver__sabotage": "sample=60,field=range", "timing__lead_ticks": 40}
    flown(tmp_path / "run", **sabotage)
    record = load_record(tmp_path / "run")
    before, after = epochs_of(record)
    skipped = range(len(before.words), after.start.sample)
    assert len(skipped) > 1

    bits = read_bits(tmp_path / "run")
    assert len(bits.statements) == len(bits.states) == after.start.sample + len(after.words)
    assert all(not bits.statements[sample] for sample in skipped)
    assert bits.states[after.start.sample] == after.start.model
    known = {row.tick: row.commanded for row in record.rows["transmitter"].topics["tick"].rows}
    late = range(after.start.sample * 10, len(known))
    assert [tuple(bits.commands[tick]) for tick in late] == [known[tick] for tick in late]
    rows = bits.record().outputs
    assert len(rows) == len(bits.commands) == 10 * len(bits.states)
    assert rows[after.start.sample * 10, 0] == pytest.approx(after.start.model[0])


def test_when_a_word_makes_one_statement_then_all_its_symbols_are_counted(tmp_path: Path) -> None:
    flown(tmp_path / "run", "usual-1000baud", duration_s=2.0)
    bits = read_bits(tmp_path / "run")
    width = bits.agreement.codec.coder.alphabet.symbols_per_word
    stated = sum(len(one) for one in bits.statements)
    assert width > 1
    assert bits.arrived == symbols_of(bits, 1)[0].arrived == width * stated


def test_when_the_plant_only_rests_then_no_model_is_written_and_the_parameters_are_named(
    tmp_path: Path,
) -> None:
    rest = {"receiver__reference__amplitude": 0.0, "transmitter__plant__disturbance": "q=2e-3"}
    flown(tmp_path / "run", **rest)
    result = identified(str(tmp_path / "run"), "--out", str(tmp_path / "out"))
    assert result.exit_code == 1
    assert any("uncertain" in text for text in json.loads(result.stdout)[0]["not_supported"])
    assert not (tmp_path / "out" / "identified.toml").exists()


def test_when_settings_are_given_beside_the_bits_then_they_are_refused_by_name() -> None:
    for arguments in (["somewhere", "--preset", "paper-10baud"], []):
        result = identified(*arguments)
        assert result.exit_code != 0
        assert "--from-bits takes the folder of a run" in str(result.exception)
    assert "preset" in str(identified("somewhere", "--preset", "paper-10baud").exception)
    ignored = {"bandwidth": "2", "damping": "1", "forgetting": "0.1", "duration": "9"}
    ignored["excitation"] = "square:0.2,0,2.5"
    for name, value in ignored.items():
        assert f"--{name}" in str(identified("somewhere", f"--{name}", value).exception)


def test_when_arrays_are_given_as_bits_then_they_are_refused() -> None:
    arrays = {"angle": [0.0, 0.1], "input": [1.0, 1.0]}
    with pytest.raises(IdentificationError, match="arrays hold no symbols"):
        identify(arrays, outputs=("angle",), inputs=("input",), tick_s=0.01, from_bits=True)


@pytest.mark.parametrize(
    ("preset", "wrong"),
    [
        ("paper-10baud", 0),
        ("static-10baud", 0),
        ("usual-1000baud", 0),
        ("helicopter-20baud", 0),
        ("furuta-50baud", 0),
        # A straight line stands for the boundary of a coder that looks ahead.
        ("history-10baud", 20),
    ],
)
def test_when_a_word_is_formed_then_what_it_says_is_so(preset: str, wrong: int) -> None:
    draw, codec = random.Random(7), load_preset(preset).codec
    state, missed = codec.initial(), 0
    still = (0.0,) * codec.model.input_size
    for _ in range(200):
        reach = max(codec.coder.ranges(state.coder))
        seen = tuple([one + draw.gauss(0.0, 0.7 * reach) for one in codec.predicted(state)])
        word = codec.encode(state, seen)
        for c, low, high in statements_of(codec, state, word):
            along = sum(one * value for one, value in zip(c, seen, strict=False))  # of the first states
            missed += not low - 1e-9 <= along <= high + 1e-9
        state = codec.step(state, word, [still] * codec.ticks_per_sample)
        state = state._replace(model=codec.initial().model)
    assert missed <= wrong


def test_when_a_search_begins_then_it_is_at_the_model_that_flew() -> None:
    codec = load_preset("paper-10baud").codec
    model = linearised(codec.model, 2, 0.01, (0.0, 0.0))
    start = start_values(PitchStructure(None), model)
    damping, stiffness, gain, angle = PitchStructure(None).constants(start)
    assert (damping, stiffness, gain) == pytest.approx((0.1, 0.5, 0.35), rel=0.06)
    assert angle == pytest.approx(-0.115, abs=0.005)

    codec = load_preset("aero-20baud").codec
    names = ("pitch", "yaw"), ("front", "side")
    start = start_values(parse_linear("linear", *names), linearised(codec.model, 2, 0.01, (0.0, 0.0)))
    assert start["pitch''/pitch"] == pytest.approx(-1.74, rel=0.02)
    assert start["yaw''/yaw'"] == pytest.approx(-0.928, rel=0.02)
    assert start["yaw''/side"] == pytest.approx(0.0928, rel=0.02)
