"""Each command on disks that are full or read-only, and in folders with odd names."""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import typer

from tenbaud.cli.app import run
from tenbaud.cli.commands import app
from tenbaud.cli.streams import prepare_streams
from tenbaud.flight.outcome import ExitCode
from tests.tenbaud.endings.commands import (
    LONG,
    READERS,
    SLOW_WRITERS,
    WRITERS,
    Arguments,
    Inputs,
    left_below,
    make_inputs,
    nothing_half_is_left,
    read_only_disk,
    small_disk,
)

ALL_WRITERS = [
    *(pytest.param(form, id=name) for name, form in WRITERS.items()),
    *(pytest.param(form, id=name, marks=pytest.mark.soak) for name, form in SLOW_WRITERS.items()),
]


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Inputs:
    return make_inputs(tmp_path_factory.mktemp("inputs"))


@pytest.fixture
def said(capfd: pytest.CaptureFixture[str]) -> Iterator[Callable[[], str]]:
    """The streams of a separate process; called, returns what was written to standard error."""
    before = sys.stdout, sys.stderr
    prepare_streams()

    def read() -> str:
        sys.stderr.flush()
        return capfd.readouterr().err

    yield read
    sys.stdout, sys.stderr = before


def test_every_command_is_walked_through() -> None:
    def names(group: typer.main.TyperGroup, path: str) -> list[str]:
        found = []
        for name, command in group.commands.items():
            below = hasattr(command, "commands")
            found += names(command, f"{path}{name} ") if below else [path + name]
        return found

    walked = {*WRITERS, *SLOW_WRITERS, *READERS, *LONG}
    for name in names(typer.main.get_command(app), ""):  # type: ignore[arg-type]
        assert any(form == name or form.startswith(f"{name} ") for form in walked), name


@pytest.mark.parametrize("form", ALL_WRITERS)
def test_on_a_full_disk_it_is_reported_and_no_half_file_is_left(
    form: Arguments, inputs: Inputs, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with small_disk(tmp_path / "disk", room_bytes=0) as disk:
        code = run(form(inputs, str(disk / "out")))
        said = capsys.readouterr().err
        assert code == ExitCode.NOT_WRITTEN, said
        assert str(disk / "out") in said
        assert os.strerror(28) in said
        assert left_below(disk) == []


@pytest.mark.parametrize("form", ALL_WRITERS)
def test_on_a_read_only_disk_it_is_reported(
    form: Arguments, inputs: Inputs, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with read_only_disk(tmp_path / "disk") as disk:
        code = run(form(inputs, str(disk / "out")))
        said = capsys.readouterr().err
        assert code == ExitCode.NOT_WRITTEN, said
        assert f"{disk / 'out'}" in said
        assert os.strerror(30) in said


def test_a_disk_that_fills_in_flight_ends_the_recording_and_not_the_flight(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with small_disk(tmp_path / "disk", room_bytes=65_536) as disk:
        flight = ["demo", "--link", "memory", "--mismatch", "0", "--duration", "60", "--json"]
        code = run([*flight, "--out", str(disk / "out")])
        shown, said = capsys.readouterr()
        assert code == ExitCode.NOT_WRITTEN
        summary = json.loads(shown)
        assert summary["exit_code"] == ExitCode.NOT_WRITTEN
        assert summary["digest_checks"] == 600, "the flight was cut short"
        assert os.strerror(28) in summary["recording_error"]
        assert "transmitter.mcap" in said
        assert os.strerror(28) in said
        nothing_half_is_left(disk)


ODD_NAMES = [
    pytest.param(b"\xff\xfe \xc3\xa9", id="no text"),
    pytest.param(b" a b ", id="spaces", marks=pytest.mark.soak),
    pytest.param(b"one\ntwo", id="a newline", marks=pytest.mark.soak),
    pytest.param(b"x" * 255, id="as long as may be", marks=pytest.mark.soak),
]


@pytest.mark.parametrize("name", ODD_NAMES)
@pytest.mark.parametrize("form", ALL_WRITERS)
def test_odd_names_are_names(
    form: Arguments, name: bytes, inputs: Inputs, tmp_path: Path, said: Callable[[], str]
) -> None:
    place = tmp_path / os.fsdecode(name) / "missing"
    code = run(form(inputs, str(place / "out")))
    text = said()
    alone = "out" in text and code == ExitCode.LINK_LOST
    assert code == 0 or alone, text
    assert left_below(tmp_path)
    nothing_half_is_left(tmp_path)


@pytest.mark.parametrize("form", ALL_WRITERS)
def test_a_name_that_is_too_long_and_a_file_in_place_of_a_folder_are_said(
    form: Arguments, inputs: Inputs, tmp_path: Path, said: Callable[[], str]
) -> None:
    (tmp_path / "file").write_text("in the way")
    for place, number in ((tmp_path / ("x" * 256) / "out", 36), (tmp_path / "file" / "out", 20)):
        code = run(form(inputs, str(place)))
        text = said()
        # Some names are refused before anything is written.
        assert code in (ExitCode.NOT_WRITTEN, ExitCode.USAGE), text
        assert place.parent.name in text
        assert os.strerror(number) in text
    assert left_below(tmp_path) == [tmp_path / "file"]


@pytest.mark.parametrize("form", READERS.values(), ids=READERS)
def test_odd_names_are_read(
    form: Arguments, inputs: Inputs, tmp_path: Path, said: Callable[[], str]
) -> None:
    moved = tmp_path / os.fsdecode(b"\xff no text")
    shutil.copytree(inputs.folder, moved)
    code = run(form(Inputs(moved), ""))
    # `doctor` speaks of this machine, and rig-check has no rig.
    assert code in (0, 1, 2), said()


@pytest.mark.parametrize("form", ["csv", "mat", "parquet", "json", "mcap"])
def test_a_run_in_a_folder_with_an_odd_name_is_converted(
    form: str, inputs: Inputs, tmp_path: Path, said: Callable[[], str]
) -> None:
    moved = tmp_path / os.fsdecode(b"\xff no text")
    shutil.copytree(inputs.run, moved)
    assert run(["convert", str(moved), "--to", form]) == 0, said()
