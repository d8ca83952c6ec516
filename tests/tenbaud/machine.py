"""Measures how busy the machine is while something runs on it that has times to keep.

A flight's times say nothing on a machine that is too busy. A process that has nothing to do with the
flight tells the two apart: it works a little every 10 ms and counts the periods that it missed.
"""

from __future__ import annotations

import subprocess
import sys
from typing import Self

import pytest

PERIOD_S = 0.01
MISSED_MAX = 5
"""Periods that an idle machine may cost."""

_PACER = f"""
import select, sys, time
missed, start, now = 0, time.monotonic(), 0.0
tick = 0
print("ready", flush=True)
while True:
    tick += 1
    rest_s = start + tick * {PERIOD_S} - time.monotonic()
    if select.select([sys.stdin], [], [], max(0.0, rest_s))[0]:
        break
    late = int(-(start + tick * {PERIOD_S} - time.monotonic()) / {PERIOD_S})
    missed += max(0, late)
    tick += max(0, late)
    until = time.monotonic() + {PERIOD_S / 8}
    while time.monotonic() < until:
        pass
print(missed)
"""


class Pacer:
    """Within a `with`, counts; afterwards `missed` has the periods of 10 ms that were missed."""

    def __enter__(self) -> Self:
        self.missed = 0
        self._process = subprocess.Popen(
            [sys.executable, "-c", _PACER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert self._process.stdout is not None
        self._process.stdout.readline()
        return self

    def __exit__(self, *_: object) -> None:
        out, _ = self._process.communicate("\n", timeout=240.0)
        self.missed = int(out)

    def need_idle(self) -> None:
        """Skip the rest of a test, which is about times, where the machine had none to spare."""
        if self.missed > MISSED_MAX:
            lost_s = self.missed * PERIOD_S
            pytest.skip(f"the machine was too busy: a process beside the flight lost {lost_s:.2f} s")
