"""Clocks that jitter, jump and stop; angles that wrap, turn and spike."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from plant_sim.encoder import Encoder
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.angles import step_of
from tenbaud.log.read import Log, read_log
from tenbaud.log.table import Array, LogError
from tests.tenbaud import lab_files

HEADER = "time,angle,u1,u2"


def read(folder: Path, rows: Array, header: str = HEADER, **fields: object) -> Log:
    path = lab_files.write(folder / "log.csv", [header, *lab_files.lines(rows)])
    section = FlightLogSection.model_validate({"file": str(path), **fields})
    return read_log(section, PITCH_SIGNALS, (Encoder(4096),), 0.02)


def angles() -> Array:
    return lab_files.flight()[1]


def test_jitter_is_resampled_and_said(tmp_path: Path) -> None:
    rows = lab_files.table()
    random = np.random.default_rng(3)
    late = random.uniform(-0.4, 0.4, len(rows)) * lab_files.TICK_S
    late[[0, -1]] = 0.0
    rows[:, 1] = np.interp(rows[:, 0] + late, rows[:, 0], rows[:, 1])
    rows[:, 0] += late
    log = read(tmp_path, rows)
    assert log.tick_s == lab_files.TICK_S
    assert np.abs(log.measured[:, 0] - angles()).max() < 1e-3
    assert any(
        note.startswith("resampled to 0.02 s: the times of the rows jitter") for note in log.notes
    )
    # A command is held until the next row: never a value between two.
    assert set(np.unique(log.commands)) <= {0.0, 2.0, 4.0}


def test_stamps_that_are_only_rounded_are_taken_as_they_are(tmp_path: Path) -> None:
    rows = lab_files.table()
    rows[:, 0] = np.round(np.arange(len(rows)) / 30.0, 3)
    log = read(tmp_path, rows)
    assert log.tick_s == pytest.approx(1.0 / 30.0, rel=1e-4)
    assert np.abs(log.measured[:, 0] - angles()).max() < 1e-5
    assert not any("resampled" in note for note in log.notes)


def test_a_lost_row_is_filled_and_said(tmp_path: Path) -> None:
    log = read(tmp_path, np.delete(lab_files.table(), 500, axis=0))
    assert len(log) == lab_files.ROWS
    assert np.abs(log.measured[:, 0] - angles()).max() < 1e-3
    assert "1 row(s) lost, filled by interpolation" in log.notes


def test_a_gap_is_an_error_that_says_how_to_choose_a_stretch(tmp_path: Path) -> None:
    rows = np.delete(lab_files.table(), slice(500, 550), axis=0)
    told = "line 502, column time: 11 s after 9.98 s"
    with pytest.raises(LogError, match=told) as caught:
        read(tmp_path, rows)
    for start_s, end_s in re.findall(r"--from (\S+) --to (\S+)(?=,|$)", str(caught.value)):
        log = read(tmp_path, rows, start_s=float(start_s), end_s=float(end_s))
        at = round(float(start_s) / lab_files.TICK_S)
        assert len(log) in (500, 950)
        assert np.abs(log.measured[:, 0] - angles()[at : at + len(log)]).max() < 1e-5


def at_700(values: Array, others: Array) -> Array:
    return np.where(np.arange(len(values)) == 700, others, values)


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda t: at_700(t, t - 0.02), "line 702, column time: the same time"),
        (lambda t: at_700(t, t - 0.05), "line 702, column time: the time runs back"),
        (lambda t: at_700(t, t * np.nan), "line 702, column time: 'nan' is not a number"),
        (lambda t: 0.0 * t, "column time: the times do not rise"),
        (lambda t: 1000.0 * t, "the clock rises by 20 a row; say in which unit"),
        (lambda t: np.round(50.0 * t), r"rises by 1 a row; .*--units time=ms.*--columns index=time"),
    ],
)
def test_a_bad_clock_is_named_by_line_and_may_be_cut_off(
    change: object, fault: str, tmp_path: Path
) -> None:
    rows = lab_files.table()
    rows[:, 0] = change(rows[:, 0])  # type: ignore[operator]
    with pytest.raises(LogError, match=fault):
        read(tmp_path, rows)
    if "702" in fault:
        assert len(read(tmp_path, rows, end_s=13.0)) == 650


def test_from_and_to_are_on_the_clock_of_the_file(tmp_path: Path) -> None:
    rows = np.add(lab_files.table(), (100.0, 0.0, 0.0, 0.0))
    log = read(tmp_path, rows, start_s=105.0, end_s=125.0)
    assert (log.start_s, len(log)) == (105.0, 1000)
    assert np.abs(log.measured[:, 0] - angles()[250:1250]).max() < 1e-5
    with pytest.raises(
        LogError, match=r"no row from 5.0 to 25.0 s; the file's clock runs from 100 to 129.98"
    ):
        read(tmp_path, rows, start_s=5.0, end_s=25.0)


def test_from_and_to_of_a_counter_are_its_number_times_the_period(tmp_path: Path) -> None:
    rows = np.delete(lab_files.table(), slice(500, 550), axis=0)
    rows[:, 0] = 2.0 * np.round(50.0 * rows[:, 0]) + 1000.0
    with pytest.raises(LogError, match=r"21 s after 19\.98 s") as caught:
        read(tmp_path, rows, period_s=0.02, columns={"index": "time"})
    _, end = re.findall(r"--from (\S+) --to (\S+?)(?=,|$)", str(caught.value))
    log = read(
        tmp_path,
        rows,
        start_s=float(end[0]),
        end_s=float(end[1]),
        period_s=0.02,
        columns={"index": "time"},
    )
    assert (log.tick_s, log.start_s, len(log)) == (0.02, 21.0, 950)


def test_stretches_of_an_epoch_clock_have_their_digits(tmp_path: Path) -> None:
    rows = np.delete(np.add(lab_files.table(), (1.7e9, 0, 0, 0)), slice(500, 550), axis=0)
    with pytest.raises(LogError, match=r"--from 1700000011 --to 1700000029.99"):
        read(tmp_path, rows)


def test_a_clock_and_a_period_are_not_both_given(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="both a clock and a period are given"):
        read(tmp_path, lab_files.table(), columns={"time": "time"}, period_s=0.05)


@pytest.mark.parametrize("step", [0.0333, 1.0, 20.0])
def test_a_period_drops_the_clock_that_only_the_format_suggests(step: float, tmp_path: Path) -> None:
    rows = lab_files.table()
    rows[:, 0] *= step / lab_files.TICK_S
    np.save(tmp_path / "log.npy", rows)
    columns = {"angle": "2", "front": "3", "rear": "4"}
    section = FlightLogSection(file=str(tmp_path / "log.npy"), columns=columns, period_s=0.05)
    log = read_log(section, PITCH_SIGNALS)
    assert (log.tick_s, len(log)) == (0.05, lab_files.ROWS)


def test_a_clock_that_is_given_as_a_counter_of_rows_is_the_clock_and_said(tmp_path: Path) -> None:
    log = read(tmp_path, lab_files.table(), columns={"index": "time"})
    assert log.tick_s == 0.02
    assert "column time: the clock, as its values are not whole" in log.notes


def test_a_file_without_a_clock_takes_the_period_that_is_given(tmp_path: Path) -> None:
    log = read(tmp_path, lab_files.table()[:, 1:], "angle,u1,u2", period_s=0.05, start_s=1.0)
    assert (log.tick_s, log.start_s, len(log)) == (0.05, 1.0, lab_files.ROWS - 20)
    path = str(tmp_path / "log.csv")
    with pytest.raises(LogError, match="no column is a clock"):
        read_log(FlightLogSection(file=path), PITCH_SIGNALS)


@pytest.mark.parametrize(
    ("turn", "low", "unit"),
    [(360.0, 0.0, "deg"), (360.0, -180.0, "deg"), (math.tau, -math.pi, "rad"), (4096.0, 0.0, "counts")],
)
def test_a_wrapped_angle_is_unwrapped_and_said(
    turn: float, low: float, unit: str, tmp_path: Path
) -> None:
    rows = lab_files.table()
    spin = np.linspace(0.0, 20.0, len(rows))
    rows[:, 1] = ((spin / math.tau * turn) - low) % turn + low
    if unit == "counts":
        rows[:, 1] = np.floor(rows[:, 1])
    log = read(tmp_path, rows, units={"angle": unit})
    assert np.abs(log.measured[:, 0] - spin).max() < 2e-3
    assert any(note.startswith("pitch: unwrapped at 3 jump(s) of a turn, line") for note in log.notes)
    assert "pitch: turns 3.2 times" in log.notes


def test_a_spike_does_not_stop_the_unwrapping(tmp_path: Path) -> None:
    rows = lab_files.table()
    spin = np.linspace(0.0, 20.0, len(rows))
    rows[:, 1] = np.degrees(spin) % 360.0
    rows[300, 1] += 700.0
    log = read(tmp_path, rows, units={"angle": "deg"}, remove_spikes=True)
    assert np.abs(log.measured[:, 0] - spin).max() < 1e-3


def test_a_continuous_walk_has_no_step() -> None:
    random = np.random.default_rng(11)
    walks = (np.cumsum(random.normal(size=1500)) for _ in range(300))
    assert sum(step_of(one) > 0.0 for one in walks) < 3
    assert step_of(np.array([0.0, 0.5, 0.0, 1.5, 1.0])) == 0.5


def test_many_turns_are_no_seam(tmp_path: Path) -> None:
    rows = lab_files.table()
    rows[:, 1] = np.linspace(0.0, 100.0, len(rows))
    assert np.abs(read(tmp_path, rows).measured[:, 0] - rows[:, 1]).max() < 1e-5


def test_spikes_are_named_by_line_and_removed_when_asked_to(tmp_path: Path) -> None:
    rows = lab_files.table()
    rows[[300, 900], 1] += (3.0, -40.0)
    log = read(tmp_path, rows)
    assert log.measured[300, 0] == pytest.approx(rows[300, 1], abs=1e-5)
    assert "pitch: 2 spike(s), line 302, line 902; --remove-spikes removes them" in log.notes
    log = read(tmp_path, rows, remove_spikes=True)
    assert np.abs(log.measured[:, 0] - angles()).max() < 1e-2
    assert "pitch: 2 spike(s), line 302, line 902: removed" in log.notes


def test_a_step_and_its_noise_are_no_spikes(tmp_path: Path) -> None:
    rows = lab_files.table()
    rows[:, 1] = np.where(np.arange(len(rows)) < 700, 0.0, 0.5) + 1e-3 * np.sin(np.arange(len(rows)))
    assert not any("spike" in note for note in read(tmp_path, rows).notes)


def test_angles_without_an_encoder_count_in_the_steps_of_the_file(tmp_path: Path) -> None:
    log = read(tmp_path, lab_files.table())
    assert log.counts[:, 0].tolist() == np.round(angles() * 1e5).astype(int).tolist()
    assert log.steps[0] == pytest.approx(1e-5)
