"""`tenbaud export-c`, its errors, and coders from outside."""

from __future__ import annotations

from pathlib import Path

import pytest

from tenbaud.build.flight import agree
from tenbaud.cli.app import run
from tenbaud.config.load import load_config
from tests.tenbaud.export.compiled_codec import compiler, need
from tests.tenbaud.export.test_codec import SAMPLES, compare

THIRDS = "tests.tenbaud.export.outside:Thirds"
METHODS = "tests.tenbaud.export.outside:Methods"


def test_the_files_of_the_command_compile(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    need("gcc", "gcc")
    out = tmp_path / "new" / "firmware"
    assert run(["export-c", "--preset", "pendulum-16baud", "--out", str(out)]) == 0
    assert str(out) in capsys.readouterr().out
    done = compiler(out, "-shared", "-fPIC", "-o", str(tmp_path / "codec.so"))
    assert done.returncode == 0, done.stderr
    assert str(Path.cwd()) not in (out / "codec_program.h").read_text()
    # A second time over the first.
    assert run(["export-c", "--preset", "paper-10baud", "--out", str(out)]) == 0


def test_a_coder_from_outside_has_the_bits_of_python(tmp_path: Path) -> None:
    settings = {"coder": {"kind": THIRDS}}
    config = load_config("paper-20baud", None, settings, allow_code=True)
    compare(agree(config, "real"), tmp_path, SAMPLES, seed=6)


def test_a_coder_of_methods_is_refused_by_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [
        "export-c",
        "--set",
        f"coder.kind={METHODS}",
        "--allow-code",
        "--out",
        str(tmp_path / "out"),
    ]
    assert run(given) == 2
    error = capsys.readouterr().err
    assert "Methods is no FunctionCoder" in error
    assert not (tmp_path / "out").exists()
