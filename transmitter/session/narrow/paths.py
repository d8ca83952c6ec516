"""What the receiver may have flown: a tree of samples, and the likeliest path through it."""

from __future__ import annotations

from collections.abc import Callable

from channel.codec.codec import Vector, Word
from channel.codec.downlink.machine import TwoWay, TwoWaySample, TwoWayState
from channel.errors import CodecDiverged

CANNOT_FLY = (CodecDiverged, ArithmeticError, LookupError, ValueError)
"""The exceptions of a copy in a state that it cannot continue from."""

Symbols = tuple[int | None, ...]


class Node:
    """A sample as the receiver may have flown it, on top of those before it.

    It is flown when somebody needs the state after it: most are dropped before, by what comes down.
    """

    __slots__ = (
        "_cannot_fly",
        "_digest",
        "_state",
        "children",
        "commands",
        "doubted",
        "flown",
        "on_path",
        "parent",
        "sample",
        "symbols",
        "word",
    )

    def __init__(
        self,
        parent: Node | None,
        sample: int,
        word: Word,
        symbols: Symbols,
        state: TwoWayState | None = None,
    ) -> None:
        self.parent = parent
        self.sample = sample
        self.word = word
        self.symbols = symbols
        """its command symbols"""
        self._state = state
        self._digest: int | None = None
        self._cannot_fly = False
        self.flown: TwoWaySample | None = None
        self.commands: list[Vector] = []
        self.on_path = False
        self.doubted = 0.0
        """share of the histories that came to the state of one through here, with other inputs"""
        self.children: dict[tuple[Word, Symbols], Node] = {}

    @property
    def is_flown(self) -> bool:
        return self._state is not None

    @property
    def state(self) -> TwoWayState:
        """Return the state after it; it must have been flown."""
        assert self._state is not None
        return self._state

    def fly(self, machine: TwoWay) -> bool:
        """Fly it, once however often it is asked for; return whether it can be flown."""
        if self._state is None and not self._cannot_fly:
            assert self.parent is not None  # only the root has none, and has a state
            try:
                before, digest = self.parent.state, self.parent.digest(machine)
                self.flown = machine.step(before, self.word, self.symbols, digest)
            except CANNOT_FLY:
                self._cannot_fly = True
            else:
                self._state, self.commands = self.flown.state, self.flown.commands
        return self._state is not None

    def outlook(self, machine: TwoWay) -> TwoWayState:
        """Return the state after it, or, where it was not flown, what is known of that without."""
        if self._state is not None:
            return self._state
        assert self.parent is not None
        return machine.outlook(self.parent.state, self.parent.digest(machine), self.word, self.symbols)

    def digest(self, machine: TwoWay) -> int:
        """Return the digest of the state after it; it must have been flown."""
        if self._digest is None:
            self._digest = machine.digest(self.state)
        return self._digest

    def child(self, word: Word, symbols: Symbols) -> Node:
        """Return the next sample with these inputs, the same one however often it is asked for."""
        key = (word, symbols)
        if key not in self.children:
            self.children[key] = Node(self, self.sample + 1, word, symbols)
        return self.children[key]

    def change(self, machine: TwoWay, change: Callable[[TwoWayState], TwoWayState]) -> None:
        """Change the state after this sample."""
        if self.fly(machine):
            self._state, self._digest, self.children = change(self.state), None, {}

    def forget(self) -> None:
        """Let go of the samples before it."""
        self.parent = None

    def doubt(self, other: Node, share: float) -> None:
        """Note a history of this share that differs from this node's own, and has come to its state."""
        one: Node | None = self
        two: Node | None = other
        while one is not None and two is not None and one is not two:
            if (one.word, one.symbols) != (two.word, two.symbols) or one.state != two.state:
                one.doubted += share
            one, two = one.parent, two.parent


class Paths:
    """The likeliest path from the last confirmed sample on, and the rest beside it.

    `rest[i]`: weight of what is no longer followed and leaves the path at sample `first + i`;
    `old_rest`: of what left it before. Weights are in units of the list's.
    """

    def __init__(self, root: Node) -> None:
        self.root = root
        self.path: list[Node] = []
        self.rest: list[float] = []
        self.old_rest = 0.0
        root.on_path = True

    @property
    def first(self) -> int:
        """Return the first sample that is not confirmed."""
        return self.root.sample + 1

    @property
    def tip(self) -> Node:
        return self.path[-1] if self.path else self.root

    @property
    def total_rest(self) -> float:
        total = self.old_rest
        for weight in self.rest:
            total += weight
        return total

    def leaves_at(self, node: Node) -> int | None:
        """Return the first sample of a node's history that is not on the path; None: it is on it."""
        sample = None
        one: Node | None = node
        while one is not None and not one.on_path:
            sample = one.sample
            one = one.parent
        return sample

    def scale_rest(self, factor: float) -> None:
        self.old_rest *= factor
        self.rest = [factor * weight for weight in self.rest]

    def follow(self, best: Node) -> None:
        """Make the way to a node the path. What had left the old one later leaves where it does."""
        added = []
        one: Node | None = best
        while one is not None and not one.on_path:
            added.append(one)
            one = one.parent
        kept = 0 if one is None else one.sample - self.root.sample
        for node in self.path[kept:]:
            node.on_path = False
        for node in added:
            node.on_path = True
        moved = 0.0
        for weight in self.rest[kept + 1 :]:
            moved += weight
        self.path = self.path[:kept] + added[::-1]
        stays = self.rest[: kept + 1]
        self.rest = stays + [0.0] * (len(self.path) - len(stays))
        if kept < len(self.rest):
            self.rest[kept] += moved

    def book(self, weight: float, sample: int | None) -> None:
        """Count a weight that is dropped, and leaves the path at a sample; None: at the last one."""
        at = len(self.rest) - 1 if sample is None else sample - self.first
        if at < 0:
            self.old_rest += weight
        else:
            self.rest[at] += weight

    def confirm(self, count: int) -> list[Node]:
        """Make the first `count` samples of the path certain; return them."""
        done = self.path[:count]
        self.root = done[-1]
        self.root.forget()
        self.path = self.path[count:]
        for weight in self.rest[:count]:
            self.old_rest += weight
        self.rest = self.rest[count:]
        return done
