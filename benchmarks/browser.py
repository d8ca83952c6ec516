"""The live page in a real browser: for the tests, the figures and the screenshots.

Debian's Chromium, driven by playwright, which never downloads a browser of its own.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from tenbaud.view.server import LOOK_ONLY, SERVING

CHROMIUM = os.environ.get("CHROMIUM") or shutil.which("chromium") or "/usr/bin/chromium"
ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
START_TIMEOUT_S = 60.0


def why_no_browser() -> str | None:
    """Return why no browser can be started here, None when one can."""
    if not Path(CHROMIUM).is_file():
        return "no Chromium: apt-get install chromium, or set CHROMIUM to its path"
    for name in ("nicegui", "playwright"):  # not imported: nicegui takes a second
        if find_spec(name) is None:
            return f"no module {name}: pip install 'tenbaud[dev]'"
    return None


@contextmanager
def browser(*arguments: str) -> Iterator[Any]:
    """Within the `with`, a headless Chromium; `arguments` go to it beside the usual ones."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        words = [*ARGUMENTS, *arguments]
        chromium = playwright.chromium.launch(executable_path=CHROMIUM, args=words)
        try:
            yield chromium
        finally:
            chromium.close()


@dataclass(slots=True)
class Served:
    """A process that serves the page."""

    process: subprocess.Popen[str]
    url: str = ""
    """with the secret that steers"""
    look_url: str = ""
    """with the secret of who may only look"""
    folder: Path = Path()
    alone: bool = False
    """whether one address is printed: of a replay, or with --view-only"""
    said: list[str] = field(default_factory=list)
    _up: threading.Event = field(default_factory=threading.Event)

    def read(self) -> None:
        """Take down what the process says, until its end."""
        assert self.process.stderr is not None
        for line in self.process.stderr:
            self.said.append(line.rstrip())
            if line.startswith(SERVING):
                self.url = line.split()[-1]
            if line.startswith(LOOK_ONLY):
                self.look_url = line.split()[-1]
            if self.url and (self.look_url or self.alone):
                self._up.set()

    @property
    def port(self) -> int:
        """The address of the page."""
        return int(urlsplit(self.url).port or 0)

    def wait_until_up(self) -> None:
        """Return when the page is served; RuntimeError with what was said if that never happens."""
        for _ in range(round(START_TIMEOUT_S / 0.1)):
            if self._up.wait(0.1):
                return
            if self.process.poll() is not None:
                break
        raise RuntimeError("no page: " + "\n".join(self.said))

    def stop(self) -> str:
        """Interrupt, wait, and return what was printed."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.communicate(timeout=30)[0]
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.communicate()[0]


@contextmanager
def served(
    folder: Path,
    *arguments: str,
    environment: dict[str, str] | None = None,
    program: tuple[str, ...] = ("-m", "tenbaud"),
) -> Iterator[Served]:
    """Within the `with`, `tenbaud` with these arguments serves a page; they name a port of 0.

    `program`: other words for the interpreter.
    """
    top = Path(__file__).parents[1]
    path = os.pathsep.join([str(top), os.environ.get("PYTHONPATH", "")])
    # NiceGUI behaves differently in a process that it takes for a test.
    own = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}
    process = subprocess.Popen(
        [sys.executable, *program, *arguments],
        cwd=folder,
        env={**own, "PYTHONPATH": path, **(environment or {})},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    alone = "--view-only" in arguments or (arguments[0] == "view" and not arguments[1].startswith("-"))
    one = Served(process, folder=folder, alone=alone)
    threading.Thread(target=one.read, daemon=True).start()
    try:
        one.wait_until_up()
        yield one
    finally:
        one.stop()


def state_is(page: Any, state: str, timeout_s: float = 20.0) -> None:
    """Wait until the page's light has this state."""
    page.wait_for_selector(f'#light[data-state="{state}"]', timeout=timeout_s * 1000.0)
