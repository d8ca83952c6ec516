"""Finds the processes and ports of viewers, for the tests of their end."""

from __future__ import annotations

import re
import socket
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

needs_page = pytest.mark.skipif(find_spec("nicegui") is None, reason="the extra page is not installed")
"""Looks for NiceGUI and does not import it, which takes each worker a second."""


def beside(port: int) -> list[int]:
    """Return the processes that serve, or are about to serve, a page at this port."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_text(errors="replace").split("\0")
        except OSError:
            continue
        if "view" in words and str(port) in words:
            found.append(int(path.parent.name))
    return found


def is_free(port: int) -> bool:
    """Return whether somebody else can listen at this port of loopback."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("127.0.0.1", port))
            probe.listen()
        except OSError:
            return False
    return True


def number(page: Any, element: str) -> float:
    text = page.locator(element).inner_text().replace("\u2212", "-")
    return float(re.findall(r"[-+]?\d+\.?\d*", text)[0])


def wait(page: Any, expression: str, argument: object = None, seconds: float = 240.0) -> None:
    page.wait_for_function(expression, arg=argument, timeout=seconds * 1000.0)
