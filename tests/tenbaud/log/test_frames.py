"""Parquet, NumPy, TDMS and messages of other programs."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
import orjson
import pyarrow
import pytest
from mcap.writer import Writer
from nptdms import ChannelObject, TdmsWriter
from pyarrow import parquet
from scipy.io import savemat

from tenbaud.log.frames import read_messages, read_numpy, read_parquet, read_tdms
from tenbaud.log.reader import read_table
from tenbaud.log.table import LogError, find_column

ROWS = 40
TIME = np.arange(ROWS) * 0.02
THETA = np.sin(TIME)
VOLTS = np.cos(TIME)


def test_parquet_reads_the_wanted_columns_only(tmp_path: Path) -> None:
    import pandas as pd

    path = tmp_path / "log.parquet"
    frame = {
        "when": pd.to_datetime(TIME + 1e9, unit="s"),
        "since": pd.to_timedelta(TIME, unit="s"),
        "theta": np.where(TIME > 0.3, THETA, np.nan),
        "n": pd.array([None, *range(1, ROWS)], dtype="Int64"),
        "who": ["x"] * ROWS,
    }
    pd.DataFrame(frame).to_parquet(path)
    table = read_parquet(path)
    assert table.names == ("when", "since", "theta", "n")
    assert table.units == ("s", "s", "", "")
    np.testing.assert_allclose(table.columns[0], TIME + 1e9)
    np.testing.assert_allclose(table.columns[1], TIME, atol=1e-9)
    assert np.isnan(table.columns[3][0])
    seen: list[Any] = []
    one = read_parquet(path, lambda *told: seen.append(told) or [2])
    assert one.names == ("theta",)
    assert seen[0][0] == ["when", "since", "theta", "n"]


def test_parquet_units_are_those_of_the_fields(tmp_path: Path) -> None:
    field = pyarrow.field("theta", pyarrow.float64(), metadata={"unit": "deg"})
    table = pyarrow.Table.from_arrays([pyarrow.array(THETA)], schema=pyarrow.schema([field]))
    parquet.write_table(table, tmp_path / "log.parquet")
    assert read_parquet(tmp_path / "log.parquet").units == ("deg",)


def test_numpy_archive_of_vectors_and_a_matrix(tmp_path: Path) -> None:
    np.savez(tmp_path / "log.npz", t=TIME, y=np.column_stack([THETA, VOLTS]), Ts=0.02)
    table = read_numpy(tmp_path / "log.npz")
    assert table.names == ("t", "y.1", "y.2")
    assert table.roles == {"time": "t"}
    np.testing.assert_array_equal(table.columns[2], VOLTS)


def test_numpy_matrix_and_structured_array(tmp_path: Path) -> None:
    path = tmp_path / "log.npy"
    np.save(path, np.vstack([TIME, THETA]))
    assert read_numpy(path).roles == {"time": "1"}
    fields = np.zeros(ROWS, dtype=[("t", "f8"), ("theta", "f4")])
    fields["t"], fields["theta"] = TIME, THETA
    np.save(path, fields)
    assert read_numpy(path).names == ("t", "theta")


def test_tdms_waveforms_know_clock_and_units(tmp_path: Path) -> None:
    path = tmp_path / "log.tdms"
    about = {"wf_increment": 0.02, "wf_start_offset": 5.0}
    with TdmsWriter(path) as writer:
        writer.write_segment(
            [
                ChannelObject("Log", "theta", THETA, {**about, "unit_string": "rad"}),
                ChannelObject("Log", "u", VOLTS, {**about, "unit_string": "V"}),
            ]
        )
    table = read_tdms(path)
    assert (table.names, table.units) == (("time", "theta", "u"), ("s", "rad", "V"))
    np.testing.assert_allclose(table.columns[0], TIME + 5.0)
    np.testing.assert_array_equal(table.columns[1], THETA)


def test_tdms_groups_of_two_lengths_are_chosen_by_name(tmp_path: Path) -> None:
    path = tmp_path / "log.tdms"
    with TdmsWriter(path) as writer:
        channels = (("A", "theta", THETA), ("A", "u", VOLTS), ("B", "slow", THETA[::2]))
        writer.write_segment([ChannelObject(*one) for one in channels])
    with pytest.raises(LogError, match=r"A.theta, A.u \(40 rows\); B.slow \(20 rows\)"):
        read_tdms(path)
    wanted = read_tdms(path, lambda names, *_: [find_column("", names, "A.u")])
    np.testing.assert_array_equal(wanted.columns[0], VOLTS)


def messages(path: Path, topics: list[str], encoding: str = "json") -> Path:
    with path.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("any", "jsonschema", b"{}")
        channels = [writer.register_channel(topic, encoding, schema) for topic in topics]
        for row in range(ROWS):
            message: dict[str, Any] = {
                "pose": {"theta": float(THETA[row])},
                "u": [float(VOLTS[row]), 0],
                "who": "x",
            }
            if row:
                message["late"] = row
            for place, channel in enumerate(channels):
                if row % (place + 1) == 0:
                    time_ns = 10**18 + row * 20_000_000
                    writer.add_message(channel, time_ns, orjson.dumps(message), 0)
        writer.finish()
    return path


def test_json_messages_of_another_program_are_over_their_log_time(tmp_path: Path) -> None:
    table = read_messages(messages(tmp_path / "log.mcap", ["/imu"]))
    assert table.names == ("log_time", "pose.theta", "u.1", "u.2", "late")
    assert table.roles == {"time": "log_time"}
    np.testing.assert_allclose(table.columns[0], TIME, atol=1e-9)
    np.testing.assert_array_equal(table.columns[1], THETA)
    assert np.isnan(table.columns[4][0])
    assert table.columns[4][1] == 1.0


def test_topics_are_chosen_by_name(tmp_path: Path) -> None:
    path = messages(tmp_path / "log.mcap", ["/imu", "/cmd/vel"])
    with pytest.raises(LogError, match=r"2 sets of signals.*imu.pose.theta.*cmd.vel.pose.theta"):
        read_messages(path)
    table = read_messages(path, lambda names, *_: [find_column("", names, "imu.u.1")])
    np.testing.assert_array_equal(table.columns[0], VOLTS)


def test_other_encodings_are_named(tmp_path: Path) -> None:
    path = messages(tmp_path / "log.mcap", ["/imu"], "protobuf")
    with pytest.raises(LogError, match=r"no JSON messages.*/imu \(protobuf\).*CSV"):
        read_messages(path)


@pytest.mark.parametrize("read", [read_messages, read_numpy, read_parquet])
def test_a_damaged_file_is_named(tmp_path: Path, read: Any) -> None:
    path = tmp_path / "log.bin"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(LogError, match=r"log\.bin cannot be read as"):
        read(path)


@pytest.mark.parametrize("name", ["npz", "npy", "mat", "parquet", "tdms", "mcap"])
def test_a_corrupt_file_is_read_or_refused(tmp_path: Path, name: str) -> None:
    import pandas as pd

    path = tmp_path / f"log.{name}"
    with TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment([ChannelObject("Log", "theta", THETA, {"wf_increment": 0.02})])
    np.savez_compressed(tmp_path / "log.npz", t=TIME, theta=THETA)
    np.save(tmp_path / "log.npy", np.vstack([TIME, THETA]))
    savemat(tmp_path / "log.mat", {"t": TIME, "theta": THETA}, do_compression=True)
    pd.DataFrame({"t": TIME, "theta": THETA}).to_parquet(tmp_path / "log.parquet")
    messages(tmp_path / "log.mcap", ["/imu"])
    data, draw, refused = path.read_bytes(), random.Random(3), 0
    for at in range(8, len(data), len(data) // 8):
        flipped = bytearray(data)
        flipped[draw.randrange(8, len(data))] ^= 1 << draw.randrange(8)
        for corrupt in (data[:at], flipped, data[:at] + bytes(len(data) - at)):
            path.write_bytes(corrupt)
            try:
                read_table(path)
            except LogError as error:
                refused += str(path) in str(error)
    assert refused


def test_a_column_that_is_missing_is_named_and_not_the_file_called_corrupt(tmp_path: Path) -> None:
    np.save(tmp_path / "log.npy", np.vstack([TIME, THETA]))
    with pytest.raises(LogError, match=r"column theta is missing; present: 1, 2$"):
        read_numpy(tmp_path / "log.npy", lambda names, *_: [find_column("log", names, "theta")])


@pytest.mark.parametrize(("read", "module"), [(read_parquet, "pyarrow"), (read_tdms, "nptdms")])
def test_without_the_library_the_error_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, read: Any, module: str
) -> None:
    monkeypatch.setitem(__import__("sys").modules, module, None)
    with pytest.raises(LogError, match=r"pip install 'tenbaud\[logs\]'"):
        read(tmp_path / "log")
