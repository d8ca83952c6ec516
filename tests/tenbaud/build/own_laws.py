"""Controllers as users write them: with a law that can be mirrored, with one that cannot, without."""

from __future__ import annotations

from typing import Any

Numbers = tuple[float, ...]


class Plain:
    """A controller that only the receiver can run."""

    def __init__(self, context: Any) -> None:
        self._reference = context.reference

    def command(self, tick: int, state: Numbers) -> Numbers:
        push = 1.5 * (self.references(tick)[0] - state[0])
        return push, -push

    def references(self, tick: int) -> Numbers:
        return (self._reference.value(tick),)


class KeepingLaw:
    """Keeps to the codec's arithmetic and remembers nothing."""

    def initial(self) -> Numbers:
        return ()

    def command(
        self, memory: Numbers, targets: Numbers, outputs: Numbers, state: Numbers
    ) -> tuple[Numbers, Numbers]:
        push = 1.5 * (targets[0] - outputs[0])
        return (push, -push), memory


class BreakingLaw(KeepingLaw):
    """Uses a function that is not of the codec's arithmetic."""

    def command(
        self, memory: Numbers, targets: Numbers, outputs: Numbers, state: Numbers
    ) -> tuple[Numbers, Numbers]:
        push = max(-5.0, targets[0] - outputs[0])
        return (push, -push), memory


class Keeping(Plain):
    mirrored = KeepingLaw()


class Breaking(Plain):
    mirrored = BreakingLaw()
