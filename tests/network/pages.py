"""Runs the command blocks of a page, in order, each on the machine that its title names.

    ```sh title="desk"                             runs to its end, which must be a success
    <!-- test: background -->                      stays running; looked at when the page is through
    ```sh title="hub: ..., until Ctrl-C"           the same, and is interrupted then
    <!-- test: skip, REASON -->                    left out

A machine is a namespace with a home folder of its own. `scp` copies between homes, as it would between
machines; `tenbaud` is this checkout's.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from tests.docs.blocks import Block, blocks_of
from tests.network.flights import environment
from tests.network.namespaces import Machine

UNTIL_INTERRUPT = "until Ctrl-C"

_TENBAUD = '#!/bin/sh\nexec "{python}" -m tenbaud "$@"\n'
_SCP = """#!/bin/sh
# scp -pr FOLDER MACHINE:PLACE, between the homes of this test.
test "$1" = -pr || exit 2
exec cp -pr "$2" "{homes}/${{3%%:*}}/${{3#*:}}"
"""


@dataclass
class Ran:
    """What a page's blocks did."""

    said: list[str] = field(default_factory=list)
    """by each block that was, in order"""


def run_page(page: str, machines: dict[str, Machine], folder: Path, patience_s: float = 60.0) -> Ran:
    """Run a page's blocks; fails with what a block said that failed or did not end."""
    ran = Ran()
    homes = folder / "homes"
    tools = folder / "tools"
    for name in machines:
        (homes / name).mkdir(parents=True)
    tools.mkdir()
    for name, text in (
        ("tenbaud", _TENBAUD.format(python=sys.executable)),
        ("scp", _SCP.format(homes=homes)),
    ):
        (tools / name).write_text(text)
        (tools / name).chmod(0o755)
    with _terminals() as terminals:
        for block in blocks_of(page):
            if block.skip or not block.runs:
                continue
            process = _start(block, machines[block.machine], homes / block.machine, tools)
            if block.background:
                terminals.append((block, process))
            else:
                ran.said.append(_finished(block, process, patience_s))
        for block, process in terminals:
            if UNTIL_INTERRUPT in block.title:
                os.killpg(process.pid, signal.SIGINT)
            ran.said.append(_finished(block, process, patience_s))
    return ran


@contextmanager
def _terminals() -> Iterator[list[tuple[Block, subprocess.Popen[str]]]]:
    running: list[tuple[Block, subprocess.Popen[str]]] = []
    try:
        yield running
    finally:
        for _, process in running:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()


def _start(block: Block, machine: Machine, home: Path, tools: Path) -> subprocess.Popen[str]:
    surroundings = environment()
    surroundings |= {"HOME": str(home), "PATH": f"{tools}{os.pathsep}{surroundings['PATH']}"}
    return subprocess.Popen(
        [*machine.prefix, "sh", "-e", "-c", block.script],
        cwd=home,
        env=surroundings,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def _finished(block: Block, process: subprocess.Popen[str], patience_s: float) -> str:
    try:
        said, _ = process.communicate(timeout=patience_s)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        said, _ = process.communicate()
        raise AssertionError(f"{block.name} did not end; it said\n{said}") from None
    # Ctrl-C reaches the shell around the command too.
    good = (0, -signal.SIGINT) if UNTIL_INTERRUPT in block.title else (0,)
    assert process.returncode in good, f"{block.name} failed:\n{said}"
    return said
