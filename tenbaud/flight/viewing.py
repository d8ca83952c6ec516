"""The live page beside a demonstration: a process of its own, and where the two ends meet it."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

from channel.errors import LinkLost
from tenbaud.telemetry.place import SOCKET

START_TIMEOUT_S = 30.0
LAST_WORD_S = 0.5
"""Time for the page to hear that the flight is over."""
SERVING = "tenbaud view: "


@dataclass(frozen=True, slots=True)
class ViewWish:
    """How a demonstration is to be looked at."""

    port: int
    open_browser: bool = False


@dataclass(slots=True)
class Viewing:
    """What the two ends have to be told, so that the page hears them."""

    transmitter: list[str] = field(default_factory=list)
    receiver: list[str] = field(default_factory=list)


@contextmanager
def page_beside(wish: ViewWish | None) -> Iterator[Viewing]:
    """Within the `with`, the page is served; yields options for both ends. Raises LinkLost."""
    if wish is None:
        yield Viewing()
        return
    with TemporaryDirectory(prefix="tenbaud-view-") as folder:
        places = [f"{SOCKET}{Path(folder) / name}.sock" for name in ("transmitter", "receiver")]
        process = _start(places, wish)
        try:
            yield Viewing(
                ["--telemetry", places[0], "--allow-control"],
                ["--telemetry", places[1], "--allow-control"],
            )
            time.sleep(LAST_WORD_S)
        finally:
            process.terminate()
            try:
                process.wait(5.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _start(places: list[str], wish: ViewWish) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tenbaud", "view", "--port", str(wish.port)]
    command += [part for place in places for part in ("--connect", place)]
    command += ["--open"] if wish.open_browser else []
    # Its own group: a Ctrl-C ends the flight first, and the page afterwards.
    process = subprocess.Popen(
        command, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    assert process.stderr is not None
    serving = threading.Event()
    threading.Thread(target=_pass_on, args=(process.stderr, serving), daemon=True).start()
    until_s = time.monotonic() + START_TIMEOUT_S
    while not serving.wait(0.05):
        if process.poll() is not None or time.monotonic() > until_s:
            process.kill()
            process.wait()
            raise LinkLost("the live page could not be served; the lines above say why")
    return process


def _pass_on(stream: IO[str], serving: threading.Event) -> None:
    for line in stream:
        sys.stderr.write(line)
        sys.stderr.flush()
        if line.startswith(SERVING):
            serving.set()
