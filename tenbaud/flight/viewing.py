"""The live page beside a demonstration: a separate process, and the addresses to reach it."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO

from channel.errors import LinkLost
from channel.links.base import Role
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


@dataclass(frozen=True, slots=True)
class Viewing:
    """Where the page receives the telemetry of both ends, and how fast they fly."""

    endpoints: Mapping[Role, str] = field(default_factory=dict)
    """nothing: there is no page"""
    pace: float | None = None
    """virtual seconds per second at most"""

    def words(self, role: Role) -> list[str]:
        """Return the options of a process that flies one end."""
        words = ["--telemetry", self.endpoints[role], "--allow-control"] if self.endpoints else []
        if self.pace is not None and role == "transmitter":
            words += ["--pace", str(self.pace)]
        return words

    def options(self, role: Role) -> TelemetryOptions:
        """Return the same for an end in this process."""
        endpoint = self.endpoints.get(role, "off")
        return TelemetryOptions(endpoint, control=bool(self.endpoints), pace=self.pace)


ALONE = Viewing()
"""Nobody looks."""


@contextmanager
def page_beside(
    options: ViewOptions | None, should_stop: Callable[[], bool], pace: float | None = None
) -> Iterator[Viewing]:
    """Within the `with`, the page is served; yields what both ends have to know.

    Raises LinkLost when it cannot be served, and KeyboardInterrupt when it is asked to stop meanwhile.
    """
    if options is None:
        yield Viewing(pace=pace)
        return
    with TemporaryDirectory(prefix="tenbaud-view-") as folder:
        places = {role: f"{SOCKET}{Path(folder) / role}.sock" for role in ENDS}
        process = _start(places.values(), options)
        try:
            _wait_until_served(process, should_stop)
            yield Viewing(places, pace)
            if process.poll() is None:
                time.sleep(LAST_WORD_S)
            else:
                how = _how_ended(process)
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


def _how_ended(process: subprocess.Popen[str]) -> str:
    code = process.returncode
    return f"exit code {code}" if code >= 0 else f"signal {-code}"


def _pass_on(stream: IO[str], serving: threading.Event) -> None:
    for line in stream:
        sys.stderr.write(line)
        sys.stderr.flush()
        if line.startswith(SERVING):
            serving.set()
