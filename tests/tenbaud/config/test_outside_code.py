"""Opening somebody else's recording imports nothing of theirs and follows no link of theirs."""

from __future__ import annotations

import os
import shutil
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from tenbaud import Run
from tenbaud.audit.audit import audit
from tenbaud.build.ends import check_parts
from tenbaud.build.flight import agree
from tenbaud.config.load import ConfigError, load_config, nested
from tenbaud.config.outside_code import CodeNotAllowed, find_origin
from tenbaud.recording.convert import convert
from tenbaud.recording.diff import compare_runs
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.inspect import describe_text
from tenbaud.replay.pack import Packed
from tenbaud.replay.record import load_record
from tenbaud.replay.replay import replay
from tenbaud.replay.symbols import unpack
from tests.tenbaud.processes import run as run_command
from tests.tenbaud.replay.test_old_recordings import TWO_EPOCHS

MARKER = "the code ran"
HOSTILE = f"import pathlib\npathlib.Path({MARKER!r}).touch()\nclass Law:\n    pass\n"
NAMED: dict[str, dict[str, Any]] = {
    "receiver.controller": {},
    "transmitter.plant.kind": {},
    "model.kind": {},
    "coder.kind": {},
}


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with modules in it that leave a mark when they are imported."""
    (tmp_path / "hostile.py").write_text(HOSTILE)
    (tmp_path / "nest").mkdir()
    (tmp_path / "nest" / "__init__.py").write_text(HOSTILE)
    (tmp_path / "nest" / "inner.py").write_text(HOSTILE)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    for name in ("hostile", "nest", "nest.inner"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    return tmp_path


def theirs(here: Path, field: str, name: str = "hostile:Law") -> Path:
    """Return a run folder whose configuration names a class from outside."""
    folder = here / "theirs"
    shutil.copytree(TWO_EPOCHS, folder)
    values = tomllib.loads((folder / "config.toml").read_text())
    section, _, last = field.rpartition(".")
    place = values
    for part in section.split("."):
        place = place[part]
    if section in ("model", "coder"):
        place.clear()
    place[last] = name
    (folder / "config.toml").write_text(tomli_w.dumps(values))
    return folder


@pytest.mark.parametrize("field", NAMED)
@pytest.mark.parametrize("name", ["hostile:Law", "nest.inner:Law"])
def test_nothing_that_opens_a_recording_imports_what_it_names(
    here: Path, field: str, name: str
) -> None:
    run = theirs(here, field, name)
    openers: list[Callable[[], object]] = [
        lambda: audit(run),
        lambda: replay(load_record(run)),
        lambda: compare_runs(run),
        lambda: describe_text(run),
        lambda: convert(Run(run), "csv"),
        lambda: Run(run).plot(),
        lambda: agree(Run(run).config, "virtual"),
        lambda: check_parts(Run(run).config),
    ]
    refusals = []
    for opener in openers:
        try:
            opener()
        except CodeNotAllowed as error:
            refusals.append(str(error))
        assert not (here / MARKER).exists()
    # Audit and replay refuse whatever is named, the last two what they build.
    assert len(refusals) >= 3
    module = name.partition(":")[0]
    file = here / f"{module.replace('.', '/')}.py"
    for text in refusals:
        assert f"{field} = '{name}': would import {module} from {file} and call Law" in text
        assert "--allow-code" in text
    assert not {"hostile", "nest", "nest.inner"} & set(sys.modules)


def test_with_permission_the_code_does_run(here: Path) -> None:
    """What shows that the test above could have failed."""
    run = theirs(here, "receiver.controller")
    with pytest.raises(ConfigError, match=r"Law\(context\) failed"):
        check_parts(Run(run).config.allowing_code())
    assert (here / MARKER).exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("audit", "theirs"),
        ("replay", "theirs"),
        ("identify", "--config", "theirs/config.toml", "--duration", "5"),
        ("tune", "--config", "theirs/config.toml", "--out", "tuned.toml", "--evaluations", "1"),
        ("sweep", "study.toml"),
        ("rig", "--config", "theirs/config.toml", "--duration", "1"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_the_commands_refuse_and_say_what_would_run(here: Path, arguments: tuple[str, ...]) -> None:
    theirs(here, "transmitter.plant.kind")
    study = {"name": "s", "config": "theirs/config.toml", "grid": {"coder.decay": [0.8, 0.9]}}
    (here / "study.toml").write_text(tomli_w.dumps(study))
    done = run_command(*arguments, cwd=here)
    assert done.code == 2, done.err
    assert "Traceback" not in done.err
    assert f"would import hostile from {here / 'hostile.py'} and call Law" in done.err
    assert not (here / MARKER).exists()
    allowed = run_command(*arguments, "--allow-code", cwd=here)
    assert "would import" not in allowed.err
    if arguments[0] not in ("audit", "replay"):  # these need no plant
        assert (here / MARKER).exists()


def test_doctor_and_symbols_files_are_no_way_around_it(here: Path) -> None:
    run = theirs(here, "model.kind")
    done = run_command("doctor", "--config", "theirs/config.toml", cwd=here)
    assert "would import hostile" in done.err
    packed = replay(load_record(TWO_EPOCHS)).packed
    import json
    import zlib

    head = json.loads(zlib.decompress(packed.head))
    head["config"] = Run(run).config.model_dump(mode="json")
    file = here / "theirs.symbols"
    whole = Packed(zlib.compress(json.dumps(head).encode()), packed.symbols, packed.erasures, b"", 0)
    file.write_bytes(whole.data)
    with pytest.raises(CodeNotAllowed, match="would import hostile"):
        unpack(file)
    assert not (here / MARKER).exists()


def test_ones_own_flight_runs_ones_own_code(here: Path) -> None:
    config = load_config(overrides=nested({"receiver.controller": "hostile:Law"}), allow_code=True)
    with pytest.raises(ConfigError, match=r"Law\(context\) failed"):
        check_parts(config)
    (here / MARKER).unlink()
    done = run_command("demo", "--set", "receiver.controller=hostile:Law", cwd=here)
    assert "failed" in done.err
    assert (here / MARKER).exists()


def test_a_copy_of_a_configuration_allows_no_more_than_the_original() -> None:
    config = load_config()
    assert not config.code_allowed
    allowed = config.allowing_code()
    assert allowed.code_allowed
    assert allowed.model_copy(update={"seed": 2}).code_allowed
    assert not config.model_copy(update={"seed": 2}).code_allowed
    assert not type(config).model_validate(allowed.model_dump()).code_allowed
    assert allowed == config


def test_the_search_finds_what_python_would_import(here: Path) -> None:
    assert find_origin("json.decoder") == sys.modules["json.decoder"].__file__
    assert find_origin("sys") == "Python itself"
    assert find_origin("hostile") == str(here / "hostile.py")
    assert find_origin("nest.inner") == str(here / "nest" / "inner.py")
    assert find_origin("nest.nothing") is None
    assert not (here / MARKER).exists()


def test_a_reference_that_is_no_regular_file_is_not_opened(here: Path) -> None:
    run = here / "theirs"
    shutil.copytree(TWO_EPOCHS, run)
    os.mkfifo(here / "pipe")
    text = (run / "config.toml").read_text()
    (run / "config.toml").write_text(
        text.replace('kind = "square"', 'kind = "csv"').replace(
            'start_s = 1.0\nfile = ""', 'start_s = 1.0\nfile = "pipe"'
        )
    )
    with pytest.raises(ConfigError, match="not a regular file"):
        audit(run)


@pytest.mark.parametrize("name", ["transmitter.mcap", "receiver.mcap", "config.toml", "summary.json"])
@pytest.mark.parametrize("dangling", [False, True])
def test_links_within_a_run_folder_are_not_followed(here: Path, name: str, dangling: bool) -> None:
    run = here / "theirs"
    shutil.copytree(TWO_EPOCHS, run)
    elsewhere = here / "elsewhere"
    (run / name).rename(elsewhere)
    if dangling:
        elsewhere.unlink()
    (run / name).symlink_to(elsewhere)
    with pytest.raises(RecordingError, match=rf"{name} is a symbolic link"):
        audit(run)
    if name.endswith(".mcap"):
        for opener in (compare_runs, describe_text, lambda path: convert(Run(path), "csv")):
            with pytest.raises(RecordingError, match=rf"{name} is a symbolic link"):
                opener(run)


def test_a_folder_or_a_file_that_is_named_may_be_a_link(here: Path) -> None:
    (here / "latest").symlink_to(TWO_EPOCHS)
    assert audit(here / "latest").passed
    (here / "one.mcap").symlink_to(TWO_EPOCHS / "transmitter.mcap")
    assert "tick: 400 rows" in describe_text(here / "one.mcap")


def test_a_conversion_does_not_write_through_a_link(here: Path) -> None:
    run = here / "theirs"
    shutil.copytree(TWO_EPOCHS, run)
    target = here / "precious"
    for name in ("flight.mcap", "flight.foxglove.json"):
        (run / name).symlink_to(target)
        with pytest.raises(RecordingError, match="exists already"):
            convert(Run(run), "mcap")
        convert(Run(run), "mcap", overwrite=True)
        assert not target.exists()
        shutil.rmtree(run)
        shutil.copytree(TWO_EPOCHS, run)
