"""The part of the two-way state machine that turns down symbols into commands: its interface.

`down` is the scheme's part of the shared state, as numbers. Everything but `encode` runs at both ends.
Per sample, in this order: `take` for each command symbol, `settle` once, `command` for each tick.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from channel.codec.codec import Vector


class Scheme(Protocol):
    """What the command symbols of a flight mean. Every method is pure."""

    asks_every_tick: bool
    """whether the source of what is wanted is asked at every tick, or once a sample"""

    def initial(self) -> Vector:
        """Return the scheme's state that both ends start from."""

    def word_age(self, down: Vector) -> int:
        """Return the samples since the word that is being sent began; 0: none is."""

    def is_idle(self, down: Vector) -> bool:
        """Return whether the next command symbol says if there is news; if not, both are as likely."""

    def encode(self, down: Vector, wanted: Callable[[int], Vector], live: Vector) -> int:
        """Return the command symbol, 0 or 1, that leads to what is wanted (receiver only).

        `wanted(n)` is what was wanted n samples ago, `wanted(0)` what is now.
        """

    def take(self, down: Vector, symbol: int) -> Vector:
        """Return the state after a command symbol."""

    def guess(self, down: Vector) -> Vector:
        """Return the state after a command symbol that is not known yet, to predict with."""

    def settle(self, down: Vector) -> Vector:
        """Return the state after all symbols of a sample."""

    def command(self, down: Vector, outputs: Vector, live: Vector) -> tuple[Vector, Vector]:
        """Return (command of a tick, next state); `outputs` are those of the predicted state `live`.

        The next state differs only in what this method alone reads.
        """

    def is_state(self, down: Vector) -> bool:
        """Return whether a state that came over a line can be one of this scheme."""
