"""Coder constants for a record within seconds: the same every time; an error in words where none."""

from __future__ import annotations

from pathlib import Path

import pytest

from tenbaud.config.coders import DirectionCoderSection
from tenbaud.config.load import load_config, merged
from tenbaud.studies import quick
from tenbaud.studies.families import DirectionFamily
from tenbaud.studies.plain import fly_plain
from tenbaud.studies.quick import quick_coder
from tenbaud.studies.settings import StudyError
from tests.tenbaud.studies.recorded import changes_of, config_of, pushed

LINEAR = {
    "model": {
        "kind": "linear",
        "A": [[0.0, 1.0], [-3.0, -1.5]],
        "B": [[0.0, 0.0], [2.0, -2.0]],
        "C": [[1.0, 0.0]],
        "G": [[0.0], [1.0]],
        "states": ["pitch", "pitch_rate"],
        "state_units": ["rad", "rad/s"],
        "inputs": ["front", "rear"],
    }
}


@pytest.fixture(name="log")
def log_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(quick, "EVALUATIONS_MAX", 30)
    return pushed(tmp_path / "flight.csv")


def test_when_a_pitch_was_recorded_then_the_history_coder_is_fitted_to_it(log: Path) -> None:
    config = config_of(log)
    seen: list[tuple[int, float]] = []
    found = quick_coder(config, on_evaluation=lambda count, error: seen.append((count, error)))
    assert found == quick_coder(config)
    assert found.sections["coder"]["kind"] == "history"
    assert [count for count, _ in seen] == list(range(1, len(seen) + 1))
    assert seen[-1][1] < 0.7 * seen[0][1]
    # What it returns can be flown by the nodes, and errs as it says.
    flown = fly_plain(load_config("uiuc-10baud", None, merged(changes_of(log), found.sections)))
    assert flown.outcome == "ok"
    assert flown.first.error_live_rms == pytest.approx(found.rms[0], rel=0.3)
    assert flown.first.error_live_max <= found.largest[0]
    assert found.rms[0] < 0.1 * flown.first.amplitude


@pytest.mark.soak
def test_when_the_model_is_linear_then_the_direction_coder_is_designed_for_it(
    log: Path,
) -> None:
    config = config_of(log)
    own = config.model_dump(mode="json", include={"timing", "channel"})
    linear = load_config("own", None, {**own, **changes_of(log), **LINEAR})
    found = quick_coder(linear)
    assert found.sections["coder"]["kind"] == "direction"
    assert found.sections["model"]["F"]
    assert found.sections["model"]["densities"] != [1.0]
    assert "transmitter" not in found.sections
    assert 0.0 < found.rms[0] < 0.05


def test_when_only_the_beginning_may_be_looked_at_then_the_rest_changes_nothing(
    log: Path, tmp_path: Path
) -> None:
    lines = log.read_text().splitlines()
    other = tmp_path / "other.csv"
    other.write_text("\n".join([*lines[:501], *(f"{n},{9 * n},0,0" for n in range(500, 1000))]))
    assert quick_coder(config_of(log), until_s=10.0) == quick_coder(config_of(other), until_s=10.0)


def test_when_the_record_is_too_short_then_it_says_so(log: Path) -> None:
    with pytest.raises(StudyError, match=r"10 samples of 0\.1 s; 20 are needed"):
        quick_coder(config_of(log), until_s=1.0)


def test_when_the_fit_begins_within_the_record_then_the_codec_begins_there_too(
    log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(quick, "WINDOW_TICKS", 300)
    monkeypatch.setattr(quick, "liveliest", lambda _log, _ticks: 650)
    lines = [line.split(",") for line in log.read_text().splitlines()]
    far = [
        [one[0], str(int(one[1]) + 1000 * (at >= 600)), *one[2:]] for at, one in enumerate(lines[1:])
    ]
    log.write_text("\n".join(",".join(one) for one in [lines[0], *far]))
    found = quick_coder(config_of(log))
    assert found.sections["model"]["start"] == []
    assert found.largest[0] < 0.6  # the step before it is 1.5 rad


@pytest.mark.parametrize(("tick_s", "bits"), [(0.16, 1), (0.04, 1), (0.2, 2)])
def test_when_a_coder_is_designed_then_its_bits_fit_the_line(tick_s: float, bits: int) -> None:
    timing = {"tick_s": tick_s, "symbol_period_s": tick_s}
    family = DirectionFamily(load_config("own", None, {"timing": timing, **LINEAR}))
    coder = family.at(family.scan[0]).coder
    assert isinstance(coder, DirectionCoderSection)
    assert coder.bits == bits
