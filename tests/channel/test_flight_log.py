"""Reading recorded flights, good and broken."""

from __future__ import annotations

from pathlib import Path

import pytest

from channel.flight_log import FlightColumns, FlightLog, FlightLogError

HEADER = "step,travel_counts,pitch_counts,elevation_counts,right_volts,left_volts\n"
REAL_FLIGHT = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "uiuc_closed_loop.csv"


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "flight.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_rows_come_back_in_order_front_volts_first(tmp_path: Path) -> None:
    path = write(tmp_path, HEADER + "5,1,-20,-300,0.25,1e-1\n6,2,+21,-299,-4.0,3\n")
    log = FlightLog.read(path)
    assert len(log) == 2
    assert log.counts == ((-20,), (21,))
    assert log.volts == ((0.25, 0.1), (-4.0, 3.0))


def test_columns_may_be_chosen_and_volts_left_out(tmp_path: Path) -> None:
    path = write(tmp_path, "n,x\n0,7.0\n1,8\n")
    log = FlightLog.read(path, FlightColumns("n", ("x",), ()))
    assert (log.counts, log.volts) == (((7,), (8,)), ((), ()))
    wide = write(tmp_path, HEADER + "0,1,2,3,4,5\n1,6,7,8,9,10\n")
    both = FlightColumns(counts_columns=("elevation_counts", "pitch_counts"), volts_columns=())
    assert FlightLog.read(wide, both).counts == ((3, 2), (8, 7))


def test_byte_order_mark_spaces_and_empty_lines_are_harmless(tmp_path: Path) -> None:
    text = "\ufeff step, pitch_counts\r\n0, 1\r\n\r\n1, 2\r\n\r\n"
    log = FlightLog.read(write(tmp_path, text), FlightColumns(volts_columns=()))
    assert log.counts == ((1,), (2,))


@pytest.mark.parametrize(
    ("rows", "fault"),
    [
        ("0,1,x,3,4,5\n", ", line 2, column pitch_counts: 'x' is not a number"),
        ("0,1,2,3,4,\n", ", line 2, column left_volts: empty cell"),
        ("0,1,2,3,4,5\n1,1,2,3,nan,5\n", ", line 3, column right_volts: 'nan' is not finite"),
        ("0,1,2,3,1e999,5\n", ", line 2, column right_volts: '1e999' is not finite"),
        ("0,1,inf,3,4,5\n", ", line 2, column pitch_counts: 'inf' is not finite"),
        ("0,1,2.5,3,4,5\n", ", line 2, column pitch_counts: '2.5' is not a whole number"),
        ("0,1,1e17,3,4,5\n", ", line 2, column pitch_counts: '1e17' is not a whole number"),
        ("0,1,1_000,3,4,5\n", ", line 2, column pitch_counts: '1_000' is not a number"),
        ("0,1,2,3,4,5\n2,1,2,3,4,5\n", ", line 3, column step: 2 found, 1 expected"),
        ("4,1,2,3,4,5\n4,1,2,3,4,5\n", ", line 3, column step: 4 found, 5 expected"),
        ("0,1,2,3,4\n", ", line 2: 5 cells found, 6 expected"),
        ("0,1,2,3,4,5\n", ", line 2: the file ends after 1 rows"),
        ("", ", line 1: the file ends after 0 rows"),
    ],
)
def test_broken_rows_are_named_by_line_and_column(tmp_path: Path, rows: str, fault: str) -> None:
    path = write(tmp_path, HEADER + rows)
    with pytest.raises(FlightLogError) as caught:
        FlightLog.read(path)
    assert f"{path}{fault}" in str(caught.value)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"step,pitch\n0,1\n", "line 1: column pitch_counts is missing; present: step, pitch"),
        (b"", "line 1: column step is missing; present: none"),
        (b"step,step,pitch_counts\n", "line 1: column step is there 2 times"),
        (b"step,pitch_counts\n0,\xff\n", "not UTF-8 text"),
        (b'step,pitch_counts\n0,"' + b"1" * 200_000 + b'"\n', "not a CSV file"),
    ],
)
def test_files_that_are_no_flight_are_refused(tmp_path: Path, content: bytes, fault: str) -> None:
    path = write(tmp_path, content)
    with pytest.raises(FlightLogError) as caught:
        FlightLog.read(path, FlightColumns(volts_columns=()))
    assert str(path) in str(caught.value)
    assert fault in str(caught.value)


def test_a_file_that_is_not_there_is_a_flight_log_error(tmp_path: Path) -> None:
    with pytest.raises(FlightLogError, match=r"absent\.csv: cannot be read: No such file"):
        FlightLog.read(tmp_path / "absent.csv")


def test_columns_that_measure_nothing_are_refused() -> None:
    with pytest.raises(ValueError, match="counts_columns"):
        FlightColumns(counts_columns=())


@pytest.mark.skipif(
    not REAL_FLIGHT.is_file(), reason="the recorded flight is kept outside the repository"
)
def test_the_recorded_flight_reads_whole() -> None:
    log = FlightLog.read(REAL_FLIGHT)
    assert len(log) == len(log.volts) == 6000
    assert (log.counts[0], log.volts[0]) == ((0,), (0.0, 0.0))
    assert (log.counts[-1], log.volts[-1]) == ((-30,), (0.390818, 0.020298))
    assert (min(log.counts), max(log.counts)) == ((-705,), (987,))
    assert all(0.0 <= volts <= 4.0 for row in log.volts for volts in row)
