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
    """A sample as the receiver may have flown it, on top of those before it."""

    __slots__ = (
        "children",
        "commands",
        "doubted",
        "flown",
        "on_path",
        "parent",
        "sample",
        "state",
        "symbols",
        "word",
    )

    def __init__(
        self,
        parent: Node | None,
        sample: int,
        word: Word,
        symbols: Symbols,
        state: TwoWayState,
        flown: TwoWaySample | None,
    ) -> None:
        self.parent = parent
        self.sample = sample
        self.word = word
        self.symbols = symbols
        """its command symbols"""
        self.state = state
        """after it"""
        self.flown = flown
        self.commands: list[Vector] = [] if flown is None else flown.commands
        self.on_path = False
        self.doubted = 0.0
        """share of the histories that came to the state of one through here, with other inputs"""
        self.children: dict[tuple[Word, Symbols], Node | None] = {}
        """samples flown on top of it; None: cannot be flown"""

    def child(self, machine: TwoWay, word: Word, symbols: Symbols) -> Node | None:
        """Return the next sample with these inputs, flown once however often it is asked for."""
        key = (word, symbols)
        if key not in self.children:
            try:
                flown = machine.step(self.state, word, symbols)
            except CANNOT_FLY:
                self.children[key] = None
            else:
                self.children[key] = Node(self, self.sample + 1, word, symbols, flown.state, flown)
        return self.children[key]

    def changed(self, change: Callable[[TwoWayState], TwoWayState]) -> Node:
        """Change the state after this sample; return the node."""
        self.state = change(self.state)
        self.children = {}
        return self

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
