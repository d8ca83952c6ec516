"""The parts of a flight that depend on the kinds of model and coder, as placeholders.

`compiled` puts the functions of the model and the coder in their place. They are here so that the
flight can be read, and checked, as ordinary source.
"""

from __future__ import annotations

from collections.abc import MutableSequence, Sequence
from typing import Any

State = tuple[float, ...]


def tick(state: State, command: State, held: State, constants: State) -> State:
    """Stand for `tick_function` of a model."""
    raise AssertionError("a flight is compiled before it is flown")


def encode(
    constants: Any,
    coder: Sequence[float],
    predicted: Sequence[float],
    measurement: Sequence[float],
    symbols: MutableSequence[int],
) -> None:
    """Stand for the `encode` of a coder's functions."""
    raise AssertionError("a flight is compiled before it is flown")


def decode(
    constants: Any,
    coder: Sequence[float],
    model: Sequence[float],
    symbols: Sequence[int],
    erased: bool,
    correction: MutableSequence[float],
    after: MutableSequence[float],
) -> None:
    """Stand for the `decode` of a coder's functions."""
    raise AssertionError("a flight is compiled before it is flown")


def state_of(values: Sequence[float]) -> State:
    """Stand for what reads a model state out of an array."""
    raise AssertionError("a flight is compiled before it is flown")


def held_of(values: Sequence[float]) -> State:
    """Stand for what reads a correction out of an array."""
    raise AssertionError("a flight is compiled before it is flown")


def sine(x: float) -> float:
    """Stand for the plant's sine, that of `channel.codec.numerics`."""
    raise AssertionError("a flight is compiled before it is flown")
