"""What a name or an expression of an exported function stands for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

DOUBLE, WHOLE, TRUTH = "double", "int32_t", "bool"
KINDS = {float: DOUBLE, int: WHOLE, bool: TRUTH}
"""types of C for those of Python"""
ORDER = (TRUTH, WHOLE, DOUBLE)
WHOLE_MAX = 2**31 - 1


@dataclass(frozen=True, slots=True)
class Static:
    """A value that is known when the program is written."""

    value: Any
    name: str = ""
    """for the table that it may need"""


@dataclass(frozen=True, slots=True)
class Scalar:
    """A number that the program computes."""

    kind: str
    text: str
    low: int | None = None
    high: int | None = None
    """limits of a whole number, where they are known"""


@dataclass(frozen=True, slots=True)
class Array:
    """Numbers in memory, one after another; `text` is a pointer to the first."""

    kind: str
    text: str
    shape: tuple[int, ...]
    root: str = ""
    """the argument, or `TABLE`, that the memory belongs to"""
    is_list: bool = False
    """Python writes to it, and two names may stand for it"""
    is_stable: bool = False
    """nothing is put in its place later"""

    @property
    def size(self) -> int:
        return math.prod(self.shape)


@dataclass(frozen=True, slots=True)
class Pack:
    """Several values at once."""

    items: tuple[Value, ...]


Value: TypeAlias = Static | Scalar | Array | Pack

TABLE = "(table)"
"""Root of a table of constants."""


class Shape(NamedTuple):
    """The type of what a function returns."""

    kind: str
    """of C; "" for nothing, "struct" for `items`"""
    shape: tuple[int, ...] = ()
    items: tuple[Shape, ...] = ()

    @property
    def tag(self) -> str:
        """Return a name of this type for use in a longer one."""
        own = {DOUBLE: "d", WHOLE: "i", TRUTH: "b", "struct": "s"}[self.kind]
        return own + "x".join(map(str, self.shape)) + "".join([one.tag for one in self.items])


class Rows(NamedTuple):
    """A model's tick written as a function of one state."""

    row_function: Any


def shape_of(value: Value) -> Shape:
    """Return the type of a value; TypeError where C has none."""
    match value:
        case Scalar():
            return Shape(value.kind)
        case Array():
            return Shape(value.kind, value.shape)
        case Static(value=None):
            return Shape("")
        case Static(value=bool() | int() | float() as number):
            return Shape(KINDS[type(number)])
        case Static(value=tuple() as numbers):
            kind, shape, _ = table_of(numbers)
            return Shape(kind, shape)
        case Pack():
            items = tuple([shape_of(one) for one in value.items])
            if items and all(one == Shape(DOUBLE) for one in items):
                return Shape(DOUBLE, (len(items),))
            return Shape("struct", (), items)
    raise TypeError(f"{value.value!r} has no type in C")


def table_of(values: Sequence[Any]) -> tuple[str, tuple[int, ...], list[Any]]:
    """Return kind, shape and numbers of a table; TypeError where it is none."""
    if not values:
        return DOUBLE, (0,), []
    if all(isinstance(one, tuple) for one in values):
        inner = [table_of(one) for one in values]
        if len({one[:2] for one in inner}) != 1:
            raise TypeError("rows of unequal length or type make no table")
        return inner[0][0], (len(values), *inner[0][1]), [number for one in inner for number in one[2]]
    kinds = {KINDS.get(type(one), "") for one in values}
    if "" in kinds:
        raise TypeError("only numbers make a table")
    return max(kinds, key=ORDER.index), (len(values),), list(values)


def literal(value: bool | int | float) -> str:
    """Return a number as C has it, to the last bit; ValueError where it has none."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        if abs(value) > WHOLE_MAX:
            raise ValueError(f"{value} has more than 32 bits")
        return str(value) if value >= 0 else f"({value})"
    if math.isnan(value):
        raise ValueError("a constant is not a number")
    if math.isinf(value):
        return "(double)INFINITY" if value > 0.0 else "(-(double)INFINITY)"
    mantissa, _, exponent = value.hex().partition("p")
    text = f"{mantissa.rstrip('0').rstrip('.')}p{exponent}"
    return text if math.copysign(1.0, value) > 0.0 else f"({text})"
