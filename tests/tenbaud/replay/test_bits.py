"""Equal to the last bit."""

from __future__ import annotations

import math
from typing import NamedTuple

import pytest

from tenbaud.replay.bits import is_same


@pytest.mark.parametrize(
    "value", [None, True, 3, "a text", 0.1, -0.0, (), (0.1, -0.0, None), (1, -1), (2**40, 1e-310)]
)
def test_equal_values_are_the_same(value: object) -> None:
    other = eval(repr(value))
    assert is_same(value, other)
    assert is_same(other, value)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (0.0, -0.0),
        (1, 1.0),
        (True, 1),
        (None, 0),
        ("0", "00"),
        (0.1, math.nextafter(0.1, 1.0)),
        ((0.0, 1.0), (-0.0, 1.0)),
        ((1.0,), (1,)),
        ((1, True), (1, 1)),
        ((0.1, 0.2), (0.1, math.nextafter(0.2, 1.0))),
        ((0.1,), (0.1, 0.2)),
        ((None,), (0.0,)),
        (None, ()),
    ],
)
def test_nearly_equal_values_are_not(one: object, other: object) -> None:
    assert not is_same(one, other)
    assert not is_same(other, one)


class Named(NamedTuple):
    """The state of a coder, as one from outside may write it."""

    gain: float
    signs: tuple[int, ...]


def test_named_tuples_are_compared_to_the_last_bit_too() -> None:
    state = Named(0.1, (1, -1))
    assert is_same(state, Named(0.1, (1, -1)))
    assert is_same((state, 2), (Named(0.1, (1, -1)), 2))
    assert not is_same(state, Named(math.nextafter(0.1, 1.0), (1, -1)))
    assert not is_same(Named(0.0, ()), Named(-0.0, ()))
    assert not is_same((Named(0.0, ()),), (Named(-0.0, ()),))
    assert not is_same(state, (0.1, (1, -1)))
