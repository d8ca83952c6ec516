"""Echoes back in the order of their samples.

Every command frame repeats the echoes of earlier samples, so a lost frame is made good by the next
ones. On a line that delays frames unevenly a later frame may overtake an earlier one by more than it
repeats: its echoes wait here until the earlier frame has come, or can no longer come.
"""

from __future__ import annotations

from collections.abc import Sequence

from channel.frames import Echo


class EchoOrder:
    """Holds what came early.

    `reach_samples`: how far ahead of the expected sample an echo may be while the expected one can
    still come: as many samples as each frame repeats, and as many as frames may overtake each other by.
    """

    def __init__(self, reach_samples: int) -> None:
        self._reach_samples = reach_samples
        self._early: dict[int, Echo] = {}

    def add(self, echoes: Sequence[Echo], expected: int) -> bool:
        """Take the echoes of a frame; return whether that of the expected sample may still come."""
        for echo in echoes:
            if echo.sample >= expected:
                self._early[echo.sample] = echo
        ahead = echoes[-1].sample - expected
        return expected in self._early or ahead <= self._reach_samples

    def take(self, expected: int) -> Echo | None:
        """Return the echo of this sample, which is then held no longer."""
        return self._early.pop(expected, None)

    def clear(self) -> None:
        """Forget everything: a new epoch begins."""
        self._early.clear()
