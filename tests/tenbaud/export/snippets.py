"""Functions in the language of the export: each a construct that C reads otherwise than Python."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from channel.codec.numerics import cos, exp, sin

LIMIT = 3


class Table(NamedTuple):
    rows: tuple[tuple[float, ...], ...] = ((0.5, -1.5, 3.0), (1e-3, 7.0, -0.25))
    weights: tuple[float, ...] = (0.1, 0.2, 0.3)
    order: tuple[int, ...] = (2, 0, 1)
    scale: float = 1.0 / 3.0
    is_mean: bool = True


TABLE = Table()


def swapped(x: Any, y: Any, result: Any) -> None:
    """Lists and numbers change places, twice."""
    left = [0.0] * 2
    right = [1.0] * 2
    a, b = x, y
    for turn in range(3):
        left[0] = a
        right[1] = b + turn
        left, right = right, left
        a, b = b, a
    result[0], result[1] = left[0] - right[0], a
    result[2] = left[1] * right[1]


def whole_numbers(x: Any, y: Any, result: Any) -> None:
    """Division and remainder round down; bits; precedence."""
    n = math.floor(x * 7.0)
    m = int(y * 7.0)
    quotient = n // 3  # integers
    rest = n % 5  # integers
    result[0] = 1.0 * (2 * n + 1 & 7) + (n >> 1) - (m << 2) + (m ^ n | 3)
    result[1] = 0.5 * quotient + rest
    result[2] = (n - m) / 4 + (-n if n > m else m)


def chains(x: Any, y: Any, result: Any) -> None:
    """Chained comparisons, conditions, loops that end early."""
    inside = -1.0 < x <= y < 2.0
    outside = not inside and (x > 5.0 or y < -5.0)
    steps = 0
    total = x
    while -10.0 < total < 10.0:
        steps += 1
        if steps > 40:
            break
        if steps & 1:
            total = total + 1.25
            continue
        total *= -1.5
    result[0] = 1.0 if inside else 2.0 if outside else 3
    result[1] = total
    result[2] = 1.0 * steps


def tables(x: Any, y: Any, result: Any, table: Table = TABLE) -> None:
    """Constants at known and computed places, rows, sizes."""
    total = 0.0
    for row in range(len(table.rows)):
        entries = table.rows[row]
        for place in range(len(entries) - 1, -1, -1):
            total += entries[table.order[place]] * (x if place != 1 else y)
    for weight in table.weights:
        total -= weight * x
    result[0] = total * table.scale
    result[1] = table.rows[-1][-1] + table.weights[0]
    result[2] = y if table.is_mean and LIMIT == 3 else x


def helper(values: Any, scale: float) -> tuple[int, Any, float]:
    return 2, (values[0] * scale, values[1], -values[0]), scale


def doubled(values: Any) -> Any:
    return values[1:] + (values[0],)  # noqa: RUF005 (the sum of sequences is what is tested)


def parts(x: Any, y: Any, result: Any) -> None:
    """Several values at once, parts of sequences, values that are kept while names change."""
    count, first, scale = helper((x, y), 0.1)
    second = doubled(first)
    kept = second
    for _ in range(count):
        second = doubled(second)
    result[0] = second[0] * scale + kept[1]
    result[1] = second[1] - kept[2]
    result[2] = second[-1]


def depth(x: float, left: int) -> float:
    """A function that calls itself."""
    if left == 0 or x > 100.0:
        return x
    return depth(x * 1.5 + 0.1, left - 1) - depth(x * 0.5, left - 2 if left > 1 else 0)


def calls_itself(x: Any, y: Any, result: Any) -> None:
    result[0] = depth(x, 4)
    result[1] = depth(y, LIMIT)
    result[2] = 0.0


def functions(x: Any, y: Any, result: Any) -> None:
    """Functions of the codec, and those of Python that round once."""
    result[0] = sin(x) + cos(y)
    result[1] = exp(y * 0.125)
    result[2] = math.sqrt(x * x + y * y) if math.isfinite(x * y) else 0.0


def double_and_single(x: Any, y: Any, result: Any) -> None:
    """Names that C keeps for itself, and a name of two lives in loops."""
    double, int_, short = x, y, 0.25
    for index in range(2):
        result[index] = double * short + index
    for index in range(2, 3):
        result[index] = int_ - short


SNIPPETS = (
    swapped,
    whole_numbers,
    chains,
    tables,
    parts,
    calls_itself,
    functions,
    double_and_single,
)


# What Python answers with an exception.


def divided(x: Any, y: Any, result: Any) -> None:
    result[0] = x / y


def rooted(x: Any, y: Any, result: Any) -> None:
    result[0] = math.sqrt(x)


def placed(x: Any, y: Any, result: Any) -> None:
    result[0] = TABLE.weights[math.floor(x)]


def turned(x: Any, y: Any, result: Any) -> None:
    result[0] = sin(x)


FAULTS = (
    (divided, 1.0, 0.0),
    (rooted, -1.0, 0.0),
    (placed, 3.0, 0.0),
    (placed, math.nan, 0.0),
    (turned, 2e5, 0.0),
    (turned, math.inf, 0.0),
)


# What is refused.


def power(x: Any, y: Any, result: Any) -> None:
    result[0] = x**2


def smallest(x: Any, y: Any, result: Any) -> None:
    result[0] = min(x, y)


def cosine(x: Any, y: Any, result: Any) -> None:
    if x > 0.0:
        result[0] = math.cos(x)


def listed(x: Any, y: Any, result: Any) -> None:
    values = [2.0 * one for one in (x, y)]
    result[0] = values[0]


def sized(x: Any, y: Any, result: Any) -> None:
    values = [0.0] * math.floor(x)
    result[0] = values[0]


def retyped(x: Any, y: Any, result: Any) -> None:
    total = 0
    for index in range(3):
        total += index * x
    result[0] = total


def fractions(x: Any, y: Any, result: Any) -> None:
    result[0] = x % 2.0


def texts(x: Any, y: Any, result: Any) -> None:
    result[0] = len(f"{x}")


def constant(x: Any, y: Any, result: Any) -> None:
    TABLE.weights[0] = x  # type: ignore[index]


def unfinished(x: Any) -> Any:
    if x > 0.0:
        return x


def ends_without(x: Any, y: Any, result: Any) -> None:
    result[0] = unfinished(x)


REFUSED = (
    (power, "result[0] = x**2", "multiply"),
    (smallest, "min(x, y)", "write the comparison out"),
    (cosine, "math.cos(x)", "only sqrt, floor and isfinite"),
    (listed, "[2.0 * one", "ListComp"),
    (sized, "[0.0] * math", "a size that is known beforehand"),
    (retyped, "total += index * x", "one type of value"),
    (fractions, "x % 2.0", "for whole numbers"),
    (texts, 'f"{x}"', "JoinedStr"),
    (constant, "TABLE.weights[0] = x", "only a list"),
    (unfinished, "def unfinished", "may end without a value"),
)
