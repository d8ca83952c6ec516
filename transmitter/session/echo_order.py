"""Echoes back in the order of their samples.

Every command frame repeats the echoes of earlier samples, so a lost frame is made good by the next
ones. On a line that delays frames unevenly a later frame may overtake an earlier one by more than it
repeats: its echoes wait here until the earlier frame has come, or can no longer come.
"""

from __future__ import annotations

from collections.abc import Sequence

from channel.protocol.frames import Echo


class EchoOrder:
    """Holds what came early; times are ticks.

    `overtaking_ticks`: how long after a frame one may come that was sent before it. `ahead_samples`:
    an echo that is further ahead of the expected one is not kept.
    """

    def __init__(self, overtaking_ticks: int, ahead_samples: int) -> None:
        self._overtaking_ticks = overtaking_ticks
        self._ahead_samples = ahead_samples
        self._early: dict[int, Echo] = {}
        self._missing: int | None = None
        """sample whose echo a later frame has shown to be lost or overtaken"""
        self._until_tick = 0
        """when it can no longer come"""

    def add(self, echoes: Sequence[Echo], expected: int, tick: int, sample: int) -> None:
        """Take the echoes of a frame; `expected` is the sample whose echo is next.

        `sample` is the one that the clock stands in: no later one waits here for its turn, or a forged
        echo would lie in wait for long.
        """
        latest = expected + self._ahead_samples
        if echoes[0].sample > expected:
            latest = min(latest, sample)
        for echo in echoes:
            if expected <= echo.sample <= latest:
                self._early[echo.sample] = echo
        if echoes[0].sample > expected and self._missing != expected:
            self._missing, self._until_tick = expected, tick + self._overtaking_ticks

    def take(self, expected: int) -> Echo | None:
        """Return the echo of this sample, which is then held no longer."""
        return self._early.pop(expected, None)

    def is_lost(self, expected: int, tick: int) -> bool:
        """Return whether the echo of this sample can no longer come."""
        return self._missing == expected and tick >= self._until_tick

    def clear(self) -> None:
        """Forget everything: a new epoch begins."""
        self._early.clear()
        self._missing = None
