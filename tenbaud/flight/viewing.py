"""The live page beside a demonstration: a separate process, and the addresses to reach it."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

from channel.errors import LinkLost
from channel.links.base import Role
from channel.links.endpoints import loopback_host
from tenbaud.flight.lifeline import end_child, start_child
from tenbaud.telemetry.end import TelemetryOptions
from tenbaud.telemetry.place import SOCKET

ENDS: tuple[Role, Role] = ("transmitter", "receiver")
START_TIMEOUT_S = 30.0
LAST_WORD_S = 0.5
"""Time for the page to hear that the flight is over."""
ENDING_TIMEOUT_S = 3.0
SERVING = "tenbaud view: "


@dataclass(frozen=True, slots=True)
class ViewOptions:
    """How a demonstration is to be looked at."""

    port: int
    open_browser: bool = False

    @classmethod
    def checked(cls, port: int, open_browser: bool) -> ViewOptions:
        """Return the options of a page that can be served, on any free port for 0."""
        from tenbaud.view.server import Address, require_nicegui

        require_nicegui()
        return cls(Address(loopback_host(), port).checked().port, open_browser)


Views = Mapping[Role, TelemetryOptions]
"""The telemetry of both ends for a viewer, and how fast they fly."""


def viewed(places: Mapping[Role, str] | None = None, pace: float | None = None) -> Views:
    """Return the telemetry of a flight with a page that receives it at these places, or without one."""
    telemetry = {role: "off" if places is None else places[role] for role in ENDS}
    return {
        role: TelemetryOptions(one, control=places is not None, pace=pace)
        for role, one in telemetry.items()
    }


def words_of(role: Role, options: TelemetryOptions) -> list[str]:
    """Return the same as options of a process that flies one end."""
    words = ["--telemetry", options.endpoint, "--allow-control"] if options.control else []
    if options.pace is not None and role == "transmitter":
        words += ["--pace", str(options.pace)]
    return words


@contextmanager
def page_beside(
    options: ViewOptions | None, should_stop: Callable[[], bool], pace: float | None = None
) -> Iterator[Views]:
    """Within the `with`, the page is served; yields what both ends have to know.

    Raises LinkLost when it cannot be served, and KeyboardInterrupt when it is asked to stop meanwhile.
    """
    if options is None:
        yield viewed(pace=pace)
        return
    with TemporaryDirectory(prefix="tenbaud-view-") as folder:
        places = {role: f"{SOCKET}{Path(folder) / role}.sock" for role in ENDS}
        process = _start(places.values(), options)
        try:
            _wait_until_served(process, should_stop)
            yield viewed(places, pace)
            if process.poll() is None:
                time.sleep(LAST_WORD_S)
            else:
                code = process.returncode
                how = f"exit code {code}" if code >= 0 else f"signal {-code}"
                sys.stderr.write(f"tenbaud: the live page ended before the flight, by {how}\n")
        finally:
            end_child(process, ENDING_TIMEOUT_S)


def _start(places: Iterable[str], options: ViewOptions) -> subprocess.Popen[str]:
    words = ["view", "--port", str(options.port)]
    words += [part for place in places for part in ("--connect", place)]
    words += ["--open"] if options.open_browser else []
    return start_child(*words, stderr=subprocess.PIPE)


def _wait_until_served(process: subprocess.Popen[str], should_stop: Callable[[], bool]) -> None:
    assert process.stderr is not None
    serving = threading.Event()
    threading.Thread(target=_pass_on, args=(process.stderr, serving), daemon=True).start()
    until_s = time.monotonic() + START_TIMEOUT_S
    while not serving.wait(0.05):
        if should_stop():
            raise KeyboardInterrupt
        if process.poll() is not None or time.monotonic() > until_s:
            raise LinkLost("the live page could not be served; the lines above say why")


def _pass_on(stream: IO[str], serving: threading.Event) -> None:
    for line in stream:
        sys.stderr.write(line)
        sys.stderr.flush()
        if line.startswith(SERVING):
            serving.set()
