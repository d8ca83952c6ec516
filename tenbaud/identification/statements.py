"""The meaning of a word's symbols for the plant, by coder: an interval of a combination of its states.

The thresholds are the coder's own, at the recorded state of the codec. They hold as the transmitter
formed the word from that state: on a line without faults always, and after a fault as soon as its echo
has come.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from channel.codec.codec import Codec, CodecState, Vector
from channel.codec.coders.direction import DirectionCoder, aim, learn
from channel.codec.coders.history import HistoryCoder
from channel.codec.coders.learning import LearningCoder
from channel.codec.coders.learning_steps import ask, take
from channel.codec.coders.pcm import PcmCoder, turn_of
from channel.codec.coders.signs import SignCoder
from channel.codec.coders.static import StaticCoder, number_of
from plant_sim.identification.errors import IdentificationError

Statement = tuple[Sequence[float], float, float]
"""(c, low, high): c' z lies in between, z being the outputs, or all corrected states"""
HALVINGS = 30
REACHES = 8.0
"""ranges from the prediction within which the boundary of a coder that looks ahead is sought"""


def statements_of(codec: Codec, state: CodecState, word: Sequence[int]) -> Iterator[Statement]:
    """Yield the statement of each symbol of a word, `state` being the codec's before it."""
    coder, predicted = codec.coder, codec.predicted(state)
    if isinstance(coder, SignCoder):
        for axis, sign in enumerate(word):
            yield _side(_unit(axis, len(predicted)), predicted[axis], sign)
    elif isinstance(coder, DirectionCoder):
        yield from _directions(coder.constants, aim, learn, state.coder, predicted, word)
    elif isinstance(coder, LearningCoder):
        yield from _directions(coder.constants, ask, _take, state.coder, predicted, word)
    elif isinstance(coder, HistoryCoder):
        yield _boundary(coder, state.coder, predicted, word[0])
    elif isinstance(coder, StaticCoder):
        width = coder.constants.width
        yield _cell(_unit(0, len(predicted)), -coder.constants.range, width, word)
    elif isinstance(coder, PcmCoder):
        step, place = coder.constants.step, turn_of(coder.constants, state.coder)
        lowest = -(coder.constants.half + 0.5) * step
        yield _cell(_unit(place, len(predicted)), lowest, step, word)
    else:
        raise IdentificationError(
            f"what a word of {type(coder).__name__} says about the plant is not known; identify from "
            "the recorded measurements, without --from-bits"
        )


def _unit(place: int, size: int) -> list[float]:
    return [1.0 if place == one else 0.0 for one in range(size)]


def _side(c: Sequence[float], edge: float, sign: int) -> Statement:
    return (c, edge, math.inf) if sign > 0 else (c, -math.inf, edge)


def _cell(c: Sequence[float], lowest: float, width: float, word: Sequence[int]) -> Statement:
    """Return the cell with the number that a word is; the outermost ones have no end."""
    number = number_of(word)
    low = lowest + number * width
    high = low + width if number < (1 << len(word)) - 1 else math.inf
    return c, low if number > 0 else -math.inf, high


def _take(
    constants: Any, known: list[float], c: list[float], _v: object, sign: int, moved: list[float]
) -> None:
    take(constants, known, c, sign, moved)


def _directions(
    constants: Any,
    point: Callable[..., bool],
    update: Callable[..., None],
    before: Vector,
    predicted: Vector,
    word: Sequence[int],
) -> Iterator[Statement]:
    """Yield the statements about the first states, as many as the coder asks about."""
    known, size = list(before), len(constants.largest)
    c, v, correction = [0.0] * size, [0.0] * size, [0.0] * len(predicted)
    for sign in word:
        if point(constants, known, c, v):
            edge = sum(c[i] * (predicted[i] + correction[i]) for i in range(size))
            yield _side(list(c), edge, sign)
            update(constants, known, c, v, sign, correction)


def _boundary(coder: HistoryCoder, before: Vector, predicted: Vector, sign: int) -> Statement:
    """Return a side of the line between both signs, straight through half a range of either rate.

    A coder that looks ahead has no formula for it.
    """
    angle, rate = predicted
    period_s = coder.parameters.period_s
    edges = []
    for off in (-0.5, 0.5):
        faster = rate + off * before[0] / period_s
        low, high = angle - REACHES * before[0], angle + REACHES * before[0]
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if coder.encode(before, predicted, (middle, faster))[0] > 0:
                high = middle
            else:
                low = middle
        edges.append(0.5 * (low + high))
    slope = (edges[1] - edges[0]) * period_s / before[0]
    return _side([1.0, -slope], 0.5 * (edges[0] + edges[1]) - slope * rate, sign)
