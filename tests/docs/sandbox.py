"""A place to type a page's commands into: a copy of the repository, with its commands on the path.

The commands stand in the pages as people type them. What makes them safe to run in a test is here:
every loopback port is exchanged for a free one, the environment that `make` would build is there
already, and so is what it has downloaded; the home folder is an empty one; what was compiled for
studies is shared. pytest only collects in it, and two files of tests alone: the tests that type in
`make test` must not run themselves.
"""

from __future__ import annotations

import os
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from tests import warm
from tests.docs import prepared
from tests.docs.blocks import Block
from tests.docs.repository import COLLECTED, Ports, copy_repository
from tests.rules.sources import TOP

COMMANDS = {"tenbaud": "-m tenbaud", "python": "", "python3": "", "pytest": "-m pytest"}
COMMANDS |= {name: f"-m {name}" for name in ("ruff", "mypy", "mkdocs")}
BLOCK_TIMEOUT_S = 150.0
STARTED_WITHIN_S = 60.0
ENDED_WITHIN_S = 60.0
SETTLED_WITHIN_S = 4.0
LEFT_ALONE_S = 1.5
"""How long a block in the background may take to end by itself before Ctrl-C is pressed."""


class BlockFailed(AssertionError):
    """A block did not do what its page says."""


@dataclass
class Sandbox:
    """One page's place; use it in a `with`."""

    folder: Path
    timeout_s: float = BLOCK_TIMEOUT_S
    copies: bool = False
    """whether commands may begin with everything imported (`tests/docs/prepared.py`)"""
    ports: Ports = field(default_factory=Ports)
    _path: str = ""
    _settled: bool = True
    _prepared: socket.socket | None = None
    _background: list[tuple[Block, subprocess.Popen[str], Path]] = field(default_factory=list)

    def __enter__(self) -> Sandbox:
        self.top = self.folder / "tenbaud"
        (self.folder / "home").mkdir()
        starts_copies = self.copies and warm.CLONE is not None
        if starts_copies:
            self.ports.update(prepared.copy_imported(self.top))
        else:
            copy_repository(self.top, self.ports, self.copies)
        programs = self.top / ".venv" / "bin"
        programs.mkdir(parents=True)
        for name, how in COMMANDS.items():
            program = programs / name
            program.write_text(f'#!/bin/sh\nexec "{sys.executable}" {how} "$@"\n')
            program.chmod(0o755)
        self._path = str(programs)
        if starts_copies:
            typed = self.folder / "typed"  # `make` starts the ordinary ones
            typed.mkdir()
            self._prepared = prepared.serve_page(self.top, self._environment(), typed)
            self._path = f"{typed}{os.pathsep}{programs}"
        (programs / "activate").write_text(f'PATH="{self._path}:$PATH"\n')
        for stamp in (".installed", ".installed-dev"):  # in this order: the second needs the first
            (self.top / ".venv" / stamp).touch()
        self._show_downloads()
        return self

    def __exit__(self, *problem: object) -> None:
        for _, process, _ in self._background:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        if self._prepared is not None:
            self._prepared.close()

    def run(self, block: Block) -> str:
        """Type a block in; return what it says. BlockFailed if it is not what the page says."""
        script = self.ports.exchange(block.script)
        if block.language == "python":
            script = f"exec python -c {shlex.quote(script)}"
        if block.background:
            self._start(block, script)
            return ""
        self._settled = False
        process = self._popen(script, subprocess.PIPE)
        try:
            said, _ = process.communicate(timeout=self.timeout_s)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            said, _ = process.communicate()
            raise BlockFailed(f"{block.name} took longer than {self.timeout_s:g} s\n{said}") from None
        self._check(block, process.returncode, said)
        return said

    def end(self) -> None:
        """Wait for what runs in the background, then press Ctrl-C; BlockFailed if that went wrong."""
        for block, process, output in self._background:
            interrupted = not _ends(process, LEFT_ALONE_S)
            if interrupted:
                os.killpg(process.pid, signal.SIGINT)
            if not _ends(process, ENDED_WITHIN_S):
                raise BlockFailed(f"{block.name} does not end at Ctrl-C\n{output.read_text()}")
            code = process.returncode
            if not (interrupted and code in (130, -signal.SIGINT, -signal.SIGTERM)):
                self._check(block, code, output.read_text())

    def _start(self, block: Block, script: str) -> None:
        if not self._settled:  # what the last command brought to its end may still hold a port
            until = time.monotonic() + SETTLED_WITHIN_S
            for _, earlier, _ in self._background:
                _ends(earlier, max(0.0, until - time.monotonic()))
            self._settled = True
        output = self.folder / f"background-{len(self._background)}.txt"
        with output.open("w") as stream:
            process = self._popen(script, stream)
        self._background.append((block, process, output))
        until = time.monotonic() + STARTED_WITHIN_S
        while not output.read_text() and process.poll() is None and time.monotonic() < until:
            time.sleep(0.05)

    def _environment(self) -> dict[str, str]:
        import matplotlib

        return {
            **{name: value for name, value in os.environ.items() if not name.startswith("PYTEST")},
            "PATH": os.pathsep.join([self._path, os.environ.get("PATH", "")]),
            "PYTHONPATH": str(self.top),
            "HOME": str(self.folder / "home"),
            "MPLCONFIGDIR": matplotlib.get_configdir(),
            "XDG_CACHE_HOME": os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache")),
            **prepared.AS_TYPED,
            "PYTEST_ADDOPTS": " ".join(["--collect-only", *COLLECTED]),
        }

    def _popen(self, script: str, output: object) -> subprocess.Popen[str]:
        return subprocess.Popen(
            ["bash", "-euo", "pipefail", "-c", script],
            cwd=self.top,
            env=self._environment(),
            stdin=subprocess.DEVNULL,
            stdout=output,  # type: ignore[call-overload]
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def _check(self, block: Block, code: int, said: str) -> None:
        code = code if code >= 0 else 128 - code  # as a shell tells a signal
        if code != block.exit_code:
            raise BlockFailed(
                f"{block.name} ended with {code}, expected {block.exit_code}:\n{block.script}\n\n{said}"
            )
        rest = _squeezed(said)
        for line in block.promised:
            _before, found, rest = rest.partition(_squeezed(line))
            if not found:
                raise BlockFailed(f"{block.name} does not say, or not there: {line.strip()}\n\n{said}")

    def _show_downloads(self) -> None:
        """Let `make` find here what it has downloaded beside the tests, if it has."""
        kept, here = TOP / ".cache", self.top / ".cache"
        here.mkdir()
        if (kept / "aarch64").is_dir():
            (here / "aarch64").symlink_to(kept / "aarch64")
        pyodide, lock = kept / "pyodide", TOP / "docs" / "browser" / "package-lock.json"
        stamp = pyodide / ".installed"
        if stamp.is_file() and stamp.read_bytes() == lock.read_bytes():
            (here / "pyodide").mkdir()
            shutil.copy(stamp, here / "pyodide")
            (here / "pyodide" / "node_modules").symlink_to(pyodide / "node_modules")


def _ends(process: subprocess.Popen[str], within_s: float) -> bool:
    try:
        process.wait(within_s)
    except subprocess.TimeoutExpired:
        return False
    return True


def _squeezed(text: str) -> str:
    """Return the text with every stretch of space and table lines as one space."""
    return " ".join(text.translate(dict.fromkeys(map(ord, "│┃|"), " ")).split())
