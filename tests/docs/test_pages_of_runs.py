"""The blocks of the pages about runs and about own parts, run as they stand, one after the other."""

from __future__ import annotations

import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from tenbaud.recording.signals import SIGNALS
from tests.tenbaud.processes import REPOSITORY

BLOCK = re.compile(r"^```(sh|python)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def environment(folder: Path) -> dict[str, str]:
    """Put a `tenbaud` on the path that is this one."""
    binaries = folder / "bin"
    binaries.mkdir()
    command = binaries / "tenbaud"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m tenbaud "$@"\n')
    command.chmod(command.stat().st_mode | stat.S_IXUSR)
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PATH": f"{binaries}:{os.environ['PATH']}", "PYTHONPATH": path}


@pytest.mark.parametrize("page", ["recordings.md", "extend.md"])
def test_every_block_of_a_page_runs(tmp_path: Path, page: str) -> None:
    pytest.importorskip("pyarrow")
    variables = environment(tmp_path)
    work = tmp_path / "work"
    work.mkdir()
    blocks = BLOCK.findall((REPOSITORY / "docs" / page).read_text())
    assert len(blocks) >= 2
    for language, text in blocks:
        command = ["sh", "-eu", "-c", text] if language == "sh" else [sys.executable, "-c", text]
        done = subprocess.run(
            command, cwd=work, env=variables, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, f"{text}\n{done.stdout}\n{done.stderr}"


def test_the_table_of_signals_is_complete() -> None:
    text = (REPOSITORY / "docs" / "recordings.md").read_text()
    for name, _, _, _ in SIGNALS:
        assert f"`{name}`" in text, name
