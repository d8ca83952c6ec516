"""What is done once a sample for several flights: lane by lane, with the coder's own functions."""

from __future__ import annotations

import math
from typing import Any

from channel.codec import add_correction, is_estimate
from tenbaud.studies.flight_data import Numbers
from tenbaud.studies.parts import decode, encode
from tenbaud.studies.sensor_side import angle_at, count_at, is_stuck


def send(
    plant: Any, coders: Any, models: Any, words: Any, well: Any, numbers: Numbers, constants: Any
) -> None:
    """Measure, and form the word of a sample; mark the lanes whose plant has left all bounds."""
    for lane in range(well.shape[0]):
        if math.isfinite(plant[0, lane]):
            angle = angle_at(count_at(plant[0, lane], numbers), numbers)
            encode(constants, coders[lane], models[lane], (angle,), words[lane])
        else:
            well[lane] = False


def take(
    words: Any,
    coders: Any,
    after: Any,
    models: Any,
    state: Any,
    held: Any,
    correction: Any,
    numbers: Numbers,
    constants: Any,
) -> None:
    """Consume a sample's word: coder states `after`, model `state` and `held` for its ticks."""
    for lane in range(models.shape[0]):
        decode(constants, coders[lane], models[lane], words[lane], False, correction, after[lane])
        for index in range(models.shape[1]):
            state[index, lane] = models[lane, index]
        if numbers.impulse:
            add_correction(state[:, lane], correction)
        else:
            for index in range(correction.shape[0]):
                held[index, lane] = correction[index]


def close(state: Any, integral: Any, models: Any, well: Any) -> None:
    """Keep the state after a sample, and mark the lanes where it is no estimate."""
    for lane in range(models.shape[0]):
        for index in range(models.shape[1]):
            models[lane, index] = state[index, lane]
        if not (is_estimate(models[lane]) and math.isfinite(integral[lane])):
            well[lane] = False


def watch_closely(
    start: int,
    at: int,
    still: Any,
    models: Any,
    applied: Any,
    nothing: Any,
    well: Any,
    numbers: Numbers,
    constants: Any,
) -> None:
    """Mark the lanes whose encoder would be taken for stuck; see `sensor_side.act`.

    `models` are those confirmed at the tick `start`, `applied` the voltages of all ticks.
    """
    for lane in range(well.shape[0]):
        if still[lane] > 0 and still[lane] % numbers.watch == 0:
            given = applied[1:, :, lane]
            if is_stuck(start, at, models[lane], given, constants, nothing[:, lane]):
                well[lane] = False


def copy(source: Any, target: Any) -> None:
    """Copy a row for every lane."""
    for index in range(source.shape[0]):
        for place in range(source.shape[1]):
            target[index, place] = source[index, place]
