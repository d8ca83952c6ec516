"""The status of a running flight, told from a thread that only looks.

On a terminal one line is rewritten in place; elsewhere nothing is shown but the end. With `lines` each
status is a line of JSON on standard error, for the command that started this process.
"""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Callable
from typing import Any, Literal, Self

StatusMode = Literal["auto", "lines", "none"]
Status = dict[str, Any]

PERIOD_S = 0.2


class StatusReporter:
    """Within a `with`, shows what `look` returns, five times a second."""

    def __init__(self, look: Callable[[], Status], mode: StatusMode) -> None:
        terminal = sys.stderr.isatty()
        self._look = look
        self._lines = mode == "lines"
        self._shown = self._lines or (mode == "auto" and terminal)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="status", daemon=True)

    def __enter__(self) -> Self:
        if self._shown:
            self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        if self._shown:
            self._thread.join()
            if not self._lines:
                sys.stderr.write("\r\033[K")
                sys.stderr.flush()

    def _run(self) -> None:
        while not self._stop.wait(PERIOD_S):
            status = self._look()
            if self._lines:
                sys.stderr.write(json.dumps(status) + "\n")
            else:
                sys.stderr.write(f"\r\033[K{status_line(status)}")
            sys.stderr.flush()


def status_line(status: Status) -> str:
    """Return a status as one line for a terminal."""
    words = [f"{status['role']}: {status['phase']}"]
    if status.get("time_s") is not None:
        words.append(f"{status['time_s']:7.1f} s")
    for name, label, form in (
        ("pitch_rad", "pitch", "{:+.3f} rad"),
        ("error_rad", "error", "{:+.4f} rad"),
        ("range_rad", "M", "{:.3f}"),
        ("rms_over_floor", "floor x", "{:.1f}"),
        ("erasures", "erased", "{}"),
        ("guard", "guard", "{}"),
    ):
        if status.get(name) is not None:
            words.append(f"{label} {form.format(status[name])}")
    return "  ".join(words)
