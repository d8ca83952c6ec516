"""A copy of the repository whose commands are safe in a test.

The default port of a flight is exchanged for a free one, and the live page takes any free port.
"""

from __future__ import annotations

import fnmatch
import re
import shutil
import socket
from pathlib import Path

from tests.rules.sources import TOP

LEFT_OUT = (".git", ".venv", "*.egg-info", ".cache", ".*_cache", ".hypothesis")
LEFT_OUT_AT_TOP = {"runs", "site", "dist", "build"}
"""Left out of the top folder only: `tenbaud/build` is a package."""
COLLECTED = ("tests/transmitter/test_guard.py", "tests/transmitter/test_overload.py")
"""Tests of both halves of `make test`."""
LOOPBACK_PORT = re.compile(r"(?<=127\.0\.0\.1:)(\d+)\b|(?<=localhost:)(\d+)\b")
DEFAULT_PORT = "7447"
VIEW_PORT = "8710"
EVALUATIONS = ("EVALUATIONS_MAX = 400", "EVALUATIONS_MAX = 30")


class Ports(dict[str, str]):
    """The free port in the place of each port that a text names; held as `free_endpoint` holds one."""

    def __init__(self) -> None:
        super().__init__()
        self.held: list[socket.socket] = []

    def exchange(self, text: str) -> str:
        """Return a text with every loopback port exchanged."""
        return LOOPBACK_PORT.sub(lambda match: self.free(match[0]), text)

    def free(self, port: str) -> str:
        """Return the port in the place of one; 0 stays."""
        if port != "0" and port not in self:
            holder = socket.socket()
            holder.bind(("127.0.0.1", 0))
            holder.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self.held.append(holder)
            self[port] = str(holder.getsockname()[1])
        return self.get(port, port)


def copy_repository(folder: Path, ports: Ports, short: bool) -> None:
    """Copy the repository into a new folder.

    `short`: without the tests that nothing collects; the fit of a coder's constants flies few sets, as
    in the tests of that.
    """

    def left_out(place: str, names: list[str]) -> set[str]:
        found = shutil.ignore_patterns(*LEFT_OUT)(place, names)
        if Path(place) == TOP:
            found |= LEFT_OUT_AT_TOP & set(names)
        if short:
            tests = fnmatch.filter(names, "test_*.py*")
            found |= {name for name in tests if not f"{place}/{name}".endswith(COLLECTED)}
        return found

    shutil.copytree(TOP, folder, ignore=left_out, symlinks=True)
    setting = "DEFAULT_PORT = "
    endpoints = folder / "channel" / "links" / "endpoints.py"
    _exchange(endpoints, setting + DEFAULT_PORT, setting + ports.free(DEFAULT_PORT))
    endpoints.write_text(ports.exchange(endpoints.read_text()))
    for name in ("demo", "view"):
        _exchange(folder / "tenbaud" / "cli" / f"{name}.py", f" = {VIEW_PORT}", " = 0")
    if short:
        _exchange(folder / "tenbaud" / "studies" / "quick.py", *EVALUATIONS)


def _exchange(path: Path, text: str, other: str) -> None:
    whole = path.read_text()
    assert whole.count(text) == 1
    path.write_text(whole.replace(text, other))
