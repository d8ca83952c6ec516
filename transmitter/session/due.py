"""The commands of coming ticks, and which of them may move a motor."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable

from channel.codec.codec import Vector


class DueCommands:
    """Gives out each tick's command once its sample is proven: by a digest, its own or a later one."""

    def __init__(self, first: Vector, count: int) -> None:
        self.last = first
        """the last one given out"""
        self._due: deque[tuple[int, Vector]] = deque()
        self._unproven: list[tuple[int, Vector]] = []
        self.restart(0, first, count)

    def restart(self, tick: int, command: Vector, count: int) -> None:
        """Forget all; the `count` ticks from this one on have the same command."""
        self._due = deque(enumerate([command] * count, tick))
        self._unproven = []

    def add(self, tick: int, commands: Iterable[Vector], *, proven: bool) -> None:
        """Take the commands of the ticks from this one on; `proven`: and all that wait."""
        self._unproven += enumerate(commands, tick)
        if proven:
            self._due.extend(self._unproven)
            self._unproven = []

    def take(self, tick: int) -> Vector | None:
        """Return the command of this tick, None when it has not come; earlier ones are forgotten."""
        while self._due and self._due[0][0] < tick:
            self._due.popleft()
        if not self._due or self._due[0][0] != tick:
            return None
        self.last = self._due[0][1]
        return self.last
