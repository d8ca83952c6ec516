"""Reading recorded flights into the columns of a model, good and broken."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from channel.codec.models.pitch import PITCH_SIGNALS as SIGNALS
from channel.flight_log import FlightLog
from plant_sim.encoder import Encoder
from tenbaud.config.load import nested
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.read import read_log
from tenbaud.log.table import LogError

HEADER = "step,travel_counts,pitch_counts,elevation_counts,right_volts,left_volts\n"
REAL_FLIGHT = Path(__file__).resolve().parents[3].parent / "shared" / "data" / "uiuc_closed_loop.csv"
ENCODERS = (Encoder(4096),)


def read(folder: Path, text: str | bytes, **fields: Any) -> FlightLog:
    path = folder / "flight.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    section = FlightLogSection.model_validate({"file": str(path), **nested(fields)})
    return read_log(section, SIGNALS, ENCODERS, tick_s=0.02)


def test_rows_come_back_in_order_front_volts_first(tmp_path: Path) -> None:
    log = read(tmp_path, HEADER + "5,1,-20,-300,0.25,1e-1\n6,2,+21,-299,-4.0,3\n")
    assert len(log) == 2
    assert log.counts.tolist() == [[-20], [21]]
    assert log.measured[1, 0] == ENCODERS[0].angle_rad(21)
    assert log.commands.tolist() == [[0.25, 0.1], [-4.0, 3.0]]
    assert log.tick_s == 0.02
    assert "pitch: column pitch_counts, by its name" in log.notes


def test_columns_may_be_chosen_and_inputs_left_out(tmp_path: Path) -> None:
    log = read(tmp_path, "n,x\n0,7.0\n1,8\n", columns={"angle": "x", "index": "n"})
    assert (log.counts.tolist(), log.commands.shape) == ([[7], [8]], (2, 0))
    assert "pitch: in counts, as all its values are whole numbers" in log.notes


@pytest.mark.parametrize("unit", ["dgr", "V"])
@pytest.mark.parametrize("signals", [SIGNALS, None])
def test_an_unknown_given_unit_is_refused(tmp_path: Path, unit: str, signals: Any) -> None:
    (tmp_path / "log.csv").write_text("time,angle,u\n0,1.5,0\n0.5,2,1\n")
    section = FlightLogSection(file=str(tmp_path / "log.csv"), units={"angle": unit})
    if (unit, signals) == ("V", None):
        assert read_log(section, signals).signals.outputs[0].unit == "V"
        return
    with pytest.raises(LogError, match=rf"{unit}' is no unit of \w+; known are .*rad, mrad, deg"):
        read_log(section, signals)


def test_whole_numbers_of_a_speed_are_no_counts(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,speed,u\n0,1500,0\n0.5,1520,1\n")
    section = FlightLogSection(file=str(tmp_path / "log.csv"))
    with pytest.raises(LogError, match="column speed: whole numbers of an unknown unit"):
        read_log(section, None)
    log = read_log(section.model_copy(update={"units": {"speed": "rpm"}}), None)
    assert log.measured[:, 0].tolist() == [1500.0, 1520.0]


def test_two_motors_by_letter_are_two_inputs_without_a_unit(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,angle,motor_A,motor_B\n0,1.5,0,2\n0.5,2.5,1,3\n")
    log = read_log(FlightLogSection(file=str(tmp_path / "log.csv")), None)
    assert [(one.name, one.unit) for one in log.signals.inputs] == [("motor_a", ""), ("motor_b", "")]
    assert log.commands.tolist() == [[0.0, 2.0], [1.0, 3.0]]


def test_byte_order_mark_spaces_and_empty_lines_are_harmless(tmp_path: Path) -> None:
    log = read(tmp_path, "\ufeff step, pitch_counts\r\n0, 1\r\n\r\n1, 2\r\n\r\n")
    assert log.counts.tolist() == [[1], [2]]


@pytest.mark.parametrize(
    ("rows", "fault"),
    [
        ("0,1,x,3,4,5\n1,1,2,3,4,5\n", ", line 2, column pitch_counts: 'x' is not a number"),
        ("0,1,2,3,4,\n1,1,2,3,4,5\n", ", line 2, column left_volts: empty cell"),
        ("0,1,2,3,4,5\n1,1,2,3,nan,5\n", ", line 3, column right_volts: 'nan' is not a number"),
        ("0,1,2,3,1e999,5\n1,1,2,3,4,5\n", ", line 2, column right_volts: 'inf' is not a finite"),
        ("0,1,inf,3,4,5\n1,1,2,3,4,5\n", ", line 2, column pitch_counts: 'inf' is not a finite"),
        ("0,1,2.5,3,4,5\n1,1,2,3,4,5\n", ", line 2, column pitch_counts: '2.5' is not a whole number"),
        ("0,1,1e17,3,4,5\n1,1,2,3,4,5\n", ", line 2, column pitch_counts: '1e+17' is not a whole"),
        ("0,1,1_000,3,4,5\n1,1,2,3,4,5\n", ", line 2, column pitch_counts: '1_000' is not a number"),
        (
            "0,1,2,3,4,5\n3,1,2,3,4,5\n4,1,2,3,4,5\n5,1,2,3,4,5\n",
            ", line 3, column step: 0.06 s after 0 s, where the usual step is 0.02 s",
        ),
        ("4,1,2,3,4,5\n4,1,2,3,4,5\n", ", column step: the times do not rise"),
        ("0,1,2,3,4,5\n1,1,2,3,4\n", ", line 3, column left_volts: empty cell"),
        ("0,1,2,3,4,5\n1,1,2,3,4,5,6\n", ", line 3: 7 cells found, 6 expected"),
        ("0,1,2,3,4,5\n", ": 1 row(s) of numbers; a log needs at least 2"),
        ("", ": 0 row(s) of numbers; a log needs at least 2"),
    ],
)
def test_broken_rows_are_named_by_line_and_column(tmp_path: Path, rows: str, fault: str) -> None:
    with pytest.raises(LogError, match=re.escape(fault)) as caught:
        read(tmp_path, HEADER + rows)
    assert str(tmp_path / "flight.csv") in str(caught.value)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (
            b"step,pitch\n0,1\n1,2\n",
            "column pich is missing (did you mean pitch?); present: 1 step,",
        ),
        (b"step,height\n0,1\n1,2\n", "which column is the pitch? Give --columns angle=NAME"),
        (b"", "line 1: the file is empty"),
        (b"step,pitch,pitch\n0,1,2\n1,2,3\n", "column pitch is there 2 times; give its number, 2 or 3"),
        (b"PK\x03\x04\x00\x00", "an Excel or zip file; save the sheet as CSV"),
        (b"\x89HDF\r\n\x1a\n\0\0", "not text"),
    ],
)
def test_files_that_are_no_flight_are_refused(tmp_path: Path, content: bytes, fault: str) -> None:
    columns = {"angle": "pich"} if b"pitch\n0,1\n1" in content else {"angle": "pitch"}
    with pytest.raises(LogError, match=re.escape(fault)):
        read(tmp_path, content, columns={} if b"height" in content else columns)


def test_a_file_that_is_not_there_is_a_log_error(tmp_path: Path) -> None:
    section = FlightLogSection(file=str(tmp_path / "absent.csv"))
    with pytest.raises(LogError, match=r"absent\.csv: cannot be read: No such file"):
        read_log(section, SIGNALS)


def test_old_names_of_the_columns_are_read_still(tmp_path: Path) -> None:
    from tenbaud.config.deprecated import with_current_names

    old = {"index_column": "n", "counts_column": "x", "volts_columns": ["b", "a"]}
    with pytest.warns(FutureWarning, match="flight_log.counts_column"):
        fields = with_current_names({"flight_log": old}, "test")["flight_log"]
    log = read(tmp_path, "n,a,b,x\n0,1,2,3\n1,4,5,6\n", **fields)
    assert (log.counts.tolist(), log.commands.tolist()) == ([[3], [6]], [[2, 1], [5, 4]])


def test_the_file_beside_a_log_says_what_the_configuration_leaves_open(tmp_path: Path) -> None:
    beside = tmp_path / "flight.csv.toml"
    beside.write_text(
        'columns = { angle = "b", time = "t" }\nunits = { angles = "deg" }\nsigns = { pitch = -1 }\n'
    )
    text = "t,a,b,u1,u2\n" + "".join(f"{k / 50},{k},{k + 0.5},0,0\n" for k in range(9))
    log = read(tmp_path, text)
    assert log.measured[:, 0] == pytest.approx([-math.radians(k + 0.5) for k in range(9)])
    chosen = read(tmp_path, text, columns={"angle": "a"}, signs={"pitch": 1})
    assert chosen.measured[:, 0] == pytest.approx([math.radians(k) for k in range(9)])
    beside.write_text("sings = 1\n")
    with pytest.raises(LogError, match="sings: unknown field; did you mean signs"):
        read(tmp_path, text)


def test_dates_have_no_unit(tmp_path: Path) -> None:
    text = "time,pitch,u1,u2\n" + "".join(f"2024-05-06 10:00:0{k},{k},0,0\n" for k in range(9))
    with pytest.raises(LogError, match=r"column time: the times are dates.*leave out --units time=ms"):
        read(tmp_path, text, units={"time": "ms"})


def test_rows_of_separators_below_the_table_are_left_out(tmp_path: Path) -> None:
    log = read(tmp_path, HEADER + "0,1,2,3,4,5\n1,1,2,3,4,5\n,,,,,\n,,,,,\n")
    assert len(log) == 2
    assert "pitch: constant" in log.notes


def test_a_clock_that_nobody_named_is_asked_for(tmp_path: Path) -> None:
    text = "".join(f"{0.02 * row:.2f},{row % 7 / 8},0,0\n" for row in range(99))
    chosen = {"angle": "2", "front": "3", "rear": "4"}
    with pytest.raises(LogError, match=r"column 1 rises by 0.02 a row; if it is the clock, give --col"):
        read(tmp_path, text, columns=chosen)
    assert read(tmp_path, text, columns=chosen | {"time": "1"}).tick_s == 0.02
    assert read(tmp_path, text, columns=chosen, period_s=0.5).tick_s == 0.5


def test_a_comment_far_down_does_not_shift_the_line_that_is_named(tmp_path: Path) -> None:
    rows = [f"{row},{row % 50},0,0" for row in range(20_000)]
    rows[9_000] = "# pause"
    with pytest.raises(LogError, match=r"line 9002, column step: '# pause' is not a number"):
        read(tmp_path, "\n".join(["step,pitch_counts,u1,u2", *rows]))
    rows[9_000], rows[12_000] = "9000,1,0,0", "12000,x,0,0"
    with pytest.raises(LogError, match=r"line 12003, column pitch_counts: 'x' is not a number"):
        read(tmp_path, "\n".join(["# by the rig", "step,pitch_counts,u1,u2", *rows]))


def test_a_folder_that_is_no_run_is_refused(tmp_path: Path) -> None:
    section = FlightLogSection(file=str(tmp_path))
    with pytest.raises(LogError, match=r"holds neither transmitter\.mcap"):
        read_log(section, SIGNALS)


@pytest.mark.skipif(
    not REAL_FLIGHT.is_file(), reason="the recorded flight is kept outside the repository"
)
def test_the_recorded_flight_reads_whole() -> None:
    log = read_log(FlightLogSection(file=str(REAL_FLIGHT)), SIGNALS, ENCODERS, 0.02)
    assert len(log) == len(log.commands) == 6000
    assert (log.counts[0].tolist(), log.commands[0].tolist()) == ([0], [0.0, 0.0])
    assert (log.counts[-1].tolist(), log.commands[-1].tolist()) == ([-30], [0.390818, 0.020298])
    assert (log.counts.min(), log.counts.max()) == (-705, 987)
    assert np.all((log.commands >= 0.0) & (log.commands <= 4.0))
