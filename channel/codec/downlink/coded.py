"""Coded commands: what any controller wants goes down as measurements go up, one bit on the deviation.

A command is `base + sum_j direction_j w_j`, and `w_j = v_j - K_j x` with the shared, predicted state
x; with K zero the command is held between symbols. A symbol says on which side of v_j what is wanted
lies:

    v_j <- v_j + s M_j,    M_j <- g M_j  within  M_min ... M_max,

g being `again` where the last three signs of v_j agree, `grow` where two do, else `shrink`. The v_j
take their turns in the order of `turns`. v_j may exceed what the limits let through, so that a
controller which saturates keeps its input saturated. Clamp and slew limits come after this, at both
ends alike.

State: the turn, then for each direction v, M and the last two signs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from channel.codec.codec import STATE_MAX, Vector

VALUE, RANGE, SIGN, SIGN_BEFORE = range(4)
SIZE = 4


class CodedDirection(NamedTuple):
    """One number of the command that is coded."""

    direction: Vector
    """what it adds to each input"""
    read: Vector
    """what of each input, beyond `base`, it is: the row that gives w back from a command"""
    feedback: Vector = ()
    """K, for each state of the model; empty: zero"""
    initial_range: float = 1.5
    minimum_range: float = 1.5
    """M_min"""
    maximum_range: float = 8.0
    """M_max"""
    largest: float = 20.0
    """v_max: v is held within this, either way"""
    again: float = 2.5
    grow: float = 1.5
    shrink: float = 0.4


def held_inputs(command_max: Vector) -> tuple[CodedDirection, ...]:
    """Return a direction for each input on its own, held between symbols."""
    count = len(command_max)
    found = []
    for at in range(count):
        row = tuple([1.0 if place == at else 0.0 for place in range(count)])
        reach, largest = 0.15 * command_max[at], 2.0 * command_max[at]
        found.append(CodedDirection(row, row, (), reach, reach, 0.8 * command_max[at], largest))
    return tuple(found)


class CodedCommands:
    """A `Scheme`; see the module's text. `turns`: the direction that each command symbol is about.

    ValueError for directions that do not fit the inputs.
    """

    asks_every_tick = True

    def __init__(
        self, base: Vector, directions: Sequence[CodedDirection], turns: Sequence[int] = ()
    ) -> None:
        self.base = base
        self.directions = tuple(directions)
        self.turns = tuple(turns) or tuple(range(len(self.directions)))
        missing = set(range(len(self.directions))) ^ set(self.turns)
        if not self.directions or missing:
            raise ValueError(
                f"turns {self.turns} must name each of the {len(self.directions)} directions, no other"
            )
        for place, one in enumerate(self.directions):
            if not len(one.direction) == len(one.read) == len(base):
                raise ValueError(
                    f"direction {place} is for {len(one.direction)} input(s) and reads "
                    f"{len(one.read)}; the plant has {len(base)}"
                )
            rises = 0.0 < one.minimum_range <= one.initial_range <= one.maximum_range <= one.largest
            if not rises or one.largest >= STATE_MAX:
                raise ValueError(
                    f"direction {place} has the smallest range {one.minimum_range:g}, begins with "
                    f"{one.initial_range:g}, and has the largest {one.maximum_range:g} and the limit "
                    f"{one.largest:g}; they must be above 0 and rise"
                )
            if not 0.0 < one.shrink < 1.0 <= one.grow <= one.again < STATE_MAX:
                raise ValueError(
                    f"direction {place} multiplies its range by {one.shrink:g}, {one.grow:g} and "
                    f"{one.again:g}; the first must be below 1, the others at least 1 and rising"
                )

    def initial(self) -> Vector:
        after = [0.0]
        for one in self.directions:
            after += [0.0, one.initial_range, 0.0, 0.0]
        return tuple(after)

    def word_age(self, down: Vector) -> int:
        return 0

    def is_idle(self, down: Vector) -> bool:
        return False

    def _next(self, down: Vector) -> tuple[int, int]:
        """Return the direction whose turn it is, and where its numbers begin."""
        place = self.turns[int(down[0])]
        return place, 1 + SIZE * place

    def encode(self, down: Vector, wanted: Callable[[int], Vector], live: Vector) -> int:
        """Return the bit for the command that is wanted now."""
        place, at = self._next(down)
        one = self.directions[place]
        value = _fed_back(one, live)
        command = wanted(0)
        for index in range(len(self.base)):
            value += one.read[index] * (command[index] - self.base[index])
        return 1 if value >= down[at + VALUE] else 0

    def take(self, down: Vector, symbol: int) -> Vector:
        place, at = self._next(down)
        one = self.directions[place]
        after = list(down)
        sign = 1.0 if symbol else -1.0
        reach = down[at + RANGE]
        value = down[at + VALUE] + sign * reach
        value = one.largest if value > one.largest else value
        after[at + VALUE] = -one.largest if value < -one.largest else value
        factor = one.shrink
        if sign == down[at + SIGN]:  # signs are whole numbers
            factor = one.again if sign == down[at + SIGN_BEFORE] else one.grow
        reach = factor * reach
        reach = one.minimum_range if reach < one.minimum_range else reach
        after[at + RANGE] = one.maximum_range if reach > one.maximum_range else reach
        after[at + SIGN] = sign
        after[at + SIGN_BEFORE] = down[at + SIGN]
        return self._turned(after)

    def guess(self, down: Vector) -> Vector:
        """Return the state with the value as it is: both bits are as likely."""
        return self._turned(list(down))

    def _turned(self, after: list[float]) -> Vector:
        turn = after[0] + 1.0
        after[0] = turn if turn < len(self.turns) else 0.0
        return tuple(after)

    def settle(self, down: Vector) -> Vector:
        return down

    def command(self, down: Vector, outputs: Vector, live: Vector) -> tuple[Vector, Vector]:
        after = list(self.base)
        for place in range(len(self.directions)):
            one = self.directions[place]
            value = down[1 + SIZE * place + VALUE] - _fed_back(one, live)
            for index in range(len(after)):
                after[index] += one.direction[index] * value
        return tuple(after), down

    def is_state(self, down: Vector) -> bool:
        if len(down) != 1 + SIZE * len(self.directions) or not 0.0 <= down[0] < len(self.turns):
            return False
        well = down[0] == int(down[0])
        for place in range(len(self.directions)):
            value, reach, sign, before = down[1 + SIZE * place : 1 + SIZE * (place + 1)]
            largest = self.directions[place].largest
            well = well and -largest <= value <= largest and 0.0 < reach <= largest
            well = well and sign in (-1.0, 0.0, 1.0) and before in (-1.0, 0.0, 1.0)
        return well


def _fed_back(one: CodedDirection, live: Vector) -> float:
    total = 0.0
    for index in range(len(one.feedback)):
        total += one.feedback[index] * live[index]
    return total
