from __future__ import annotations

import csv
import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat

from tenbaud import Run
from tenbaud.files.whole import WriteError
from tenbaud.recording.convert import FORMS, convert
from tenbaud.recording.errors import RecordingError
from tests.tenbaud.flown import flown
from tests.tenbaud.processes import run as run_command


@pytest.fixture(scope="module")
def lossy(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return flown(tmp_path_factory.mktemp("runs") / "lossy", link__impairments="loss=0.2")


def test_csv_reads_back_to_the_same_bits_with_units_in_the_names(lossy: Run, tmp_path: Path) -> None:
    files = convert(lossy, "csv", tmp_path / "csv")
    assert [file.name for file in files] == ["events.csv", "flight.csv", "samples.csv"]
    with (tmp_path / "csv" / "flight.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(lossy.time_s)
    for name, unit in (("pitch", "rad"), ("front", "volts"), ("estimate", "rad")):
        values = [float(row[f"{name}_{unit}"] or "nan") for row in rows]
        np.testing.assert_array_equal(values, getattr(lossy, name))
    symbols = [row["symbol"] for row in rows]
    assert [text == "" for text in symbols] == np.isnan(lossy.symbol).tolist()
    with (tmp_path / "csv" / "events.csv").open(newline="") as stream:
        told = [row["text"] for row in csv.DictReader(stream)]
    assert told == [event["text"] for event in lossy.events]
    with (tmp_path / "csv" / "samples.csv").open(newline="") as stream:
        digests = [row["digest"] for row in csv.DictReader(stream)]
    assert digests == [row["digest"] for row in lossy.table("transmitter", "sample").rows]


def test_mat_has_a_struct_per_signal_with_its_unit(lossy: Run, tmp_path: Path) -> None:
    (file,) = convert(lossy, "mat", tmp_path / "flight.mat")
    loaded = loadmat(file, simplify_cells=True)
    for name, signal in lossy.signals.items():
        struct = loaded[name]
        np.testing.assert_array_equal(struct["value"], signal.values)
        np.testing.assert_array_equal(struct["time"], lossy.time_s)
        # An empty text comes back as an empty array.
        assert (struct["unit"] if len(struct["unit"]) else "") == signal.unit
        assert struct["description"] == signal.description
    digests = [row["digest"] for row in lossy.table("transmitter", "sample").rows]
    assert list(loaded["samples"]["digest"]) == digests
    assert loaded["run"]["preset"] == "tuned-10baud"


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="Octave is not installed")
def test_octave_reads_the_mat_file(lossy: Run, tmp_path: Path) -> None:
    (file,) = convert(lossy, "mat", tmp_path / "flight.mat")
    code = (
        f"s = load('{file}'); printf('%s %d %.17g %s\\n', s.pitch.unit, numel(s.pitch.value), "
        "s.pitch.value(end), s.samples.digest{1});"
    )
    told = subprocess.run(
        ["octave-cli", "--norc", "--eval", code], capture_output=True, text=True, check=True
    )
    unit, count, value, digest = told.stdout.split()
    assert (unit, int(count), float(value)) == ("rad", len(lossy.pitch), lossy.pitch[-1])
    assert digest == lossy.table("transmitter", "sample").rows[0]["digest"]


def test_parquet_has_units_as_metadata_and_nulls_for_what_is_not_there(
    lossy: Run, tmp_path: Path
) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    convert(lossy, "parquet", tmp_path / "parquet")
    table = parquet.read_table(tmp_path / "parquet" / "flight.parquet")
    assert table.column("pitch_rad").to_pylist() == lossy.pitch.tolist()
    assert table.schema.field("pitch_rad").metadata[b"unit"] == b"rad"
    assert table.column("symbol").null_count == np.isnan(lossy.symbol).sum() > 0
    assert table.schema.metadata[b"preset"] == b"tuned-10baud"
    samples = parquet.read_table(tmp_path / "parquet" / "samples.parquet")
    assert samples.num_rows == len(lossy.table("transmitter", "sample"))


def test_json_names_units_and_null(lossy: Run, tmp_path: Path) -> None:
    (file,) = convert(lossy, "json", tmp_path / "flight.json")
    document = json.loads(file.read_text())
    assert document["time_s"] == lossy.time_s.tolist()
    assert document["signals"]["pitch"]["unit"] == "rad"
    assert document["signals"]["pitch"]["values"] == lossy.pitch.tolist()
    missing = [value is None for value in document["signals"]["symbol"]["values"]]
    assert missing == np.isnan(lossy.symbol).tolist()
    assert document["events"] == lossy.events


def test_mcap_is_one_topic_of_plain_numbers(lossy: Run, tmp_path: Path) -> None:
    from tenbaud.recording.reader import Recording

    files = convert(lossy, "mcap", tmp_path / "flight.mcap")
    assert [file.name for file in files] == [
        "flight.mcap",
        "flight.foxglove.json",
        "flight.plotjuggler.xml",
    ]
    rows = list(Recording(files[0]).rows("flight"))
    assert len(rows) == len(lossy.time_s)
    assert [row["pitch_rad"] for _, row in rows] == lossy.pitch.tolist()
    assert rows[100][0] == 1_000_000_000


def test_the_receivers_recording_alone_converts_too(lossy: Run, tmp_path: Path) -> None:
    for form in FORMS:
        written = convert(Run(lossy.folder.receiver), form, tmp_path / f"{form}.out")
        assert all(file.stat().st_size > 0 for file in written)


def test_nothing_is_overwritten_unless_asked_and_a_failure_leaves_no_half_file(
    lossy: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "flight.json"
    convert(lossy, "json", target)
    with pytest.raises(RecordingError, match="exists already and is not overwritten"):
        convert(lossy, "json", target)
    before = target.read_bytes()

    def broken(run: Run, path: Path) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(FORMS, "json", ("flight.json", broken))
    with pytest.raises(WriteError, match=r"flight\.json cannot be written: No space left on device"):
        convert(lossy, "json", target, overwrite=True)
    assert target.read_bytes() == before
    assert list(tmp_path.iterdir()) == [target]


def test_the_command_writes_into_the_folder_of_the_run_and_explains_itself(
    lossy: Run, tmp_path: Path
) -> None:
    shutil.copytree(lossy.path, tmp_path / "run")
    done = run_command("convert", "run", "--to", "csv", cwd=tmp_path)
    assert done.code == 0, done.err
    assert done.out.split() == ["run/csv/events.csv", "run/csv/flight.csv", "run/csv/samples.csv"]
    again = run_command("convert", "run", "--to", "csv", cwd=tmp_path)
    assert again.code == 2
    assert "--force" in again.err
    assert run_command("convert", "run", "--to", "csv", "--force", cwd=tmp_path).code == 0
    assert run_command("convert", "none", "--to", "csv", cwd=tmp_path).code == 2


def test_force_replaces_an_earlier_conversion_and_nothing_else(lossy: Run, tmp_path: Path) -> None:
    copy = Run(shutil.copytree(lossy.path, tmp_path / "run"))
    convert(copy, "csv")
    assert convert(copy, "csv", overwrite=True)
    before = {path: path.read_bytes() for path in copy.path.rglob("*") if path.is_file()}
    notes = tmp_path / "notes"
    notes.mkdir()
    (notes / "diary.txt").write_text("months of work")
    for form, target, why in (
        ("mat", notes, "it is a folder, and mat is a file"),
        ("csv", notes, "diary.txt"),
        ("csv", copy.path, "part of the run"),
        ("mcap", copy.folder.transmitter, "part of the run"),
        ("csv", copy.folder.config, "it is a file, and csv is a folder"),
    ):
        with pytest.raises(RecordingError, match=why):
            convert(copy, form, target, overwrite=True)
    assert (notes / "diary.txt").read_text() == "months of work"
    assert {path: path.read_bytes() for path in copy.path.rglob("*") if path.is_file()} == before
