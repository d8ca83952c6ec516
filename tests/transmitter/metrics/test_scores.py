"""Errors of a flight as running figures."""

from __future__ import annotations

import math
import random

import pytest

from tests.channel.codec.parts import pitch_codec
from transmitter.metrics.scores import ErrorMeter, Scores

MODEL = pitch_codec().model
SEED = 20240618


def state(angle: float) -> tuple[float, ...]:
    return (angle, 9.0, 9.0, 9.0)


def scores(start: int = 0, span: int = 100) -> Scores:
    return Scores(MODEL, start, span, lambda tick: (0.5 if tick >= 2 else None,))


def test_when_errors_are_added_then_largest_and_rms_are_those_of_the_list() -> None:
    chooser = random.Random(SEED)
    errors = [chooser.gauss(0.0, 2.0) for _ in range(1000)]
    meter = ErrorMeter()
    assert meter.rms is None
    for error in errors:
        meter.add(error)
    assert meter.count == 1000
    assert meter.largest == max(abs(error) for error in errors)
    assert meter.rms == pytest.approx(math.sqrt(math.fsum(e * e for e in errors) / 1000))


def test_when_estimates_come_then_each_is_compared_with_its_own_tick() -> None:
    one = scores()
    for tick in range(10):
        one.on_outputs(tick, (0.1 * tick,))
    for tick in range(10):
        one.on_estimate(tick, state(0.1 * tick - 0.01), state(0.1 * tick + 0.03))
    assert one.first.coded.largest == pytest.approx(0.01)
    assert one.first.live.rms == pytest.approx(0.03)
    assert one.first.coded.count == one.first.live.count == 10
    assert one.first.largest == pytest.approx(0.9)
    assert one.first.last_coded_error == pytest.approx(0.01)
    assert one.first.last == pytest.approx(0.9)


def test_when_a_tick_has_no_live_estimate_then_only_the_coded_one_counts() -> None:
    one = scores()
    one.on_outputs(0, (1.0,))
    one.on_estimate(0, state(0.5), None)
    assert (one.first.coded.count, one.first.live.count) == (1, 0)


def test_when_the_window_has_not_begun_then_nothing_is_scored() -> None:
    one = scores(start=5)
    for tick in range(10):
        one.on_outputs(tick, (10.0 - tick,))
        one.on_estimate(tick, state(0.0), state(0.0))
    assert one.first.coded.count == one.first.live.count == one.first.tracking.count == 5
    assert one.first.largest == one.first.coded.largest == 5.0


def test_when_a_reference_is_there_then_tracking_is_measured_against_it() -> None:
    one = scores()
    for tick in range(6):
        one.on_outputs(tick, (0.2,))
    assert one.first.tracking.count == 4
    assert one.first.tracking.rms == pytest.approx(0.3)
    assert one.first.reference_largest == 0.5


def test_when_ticks_were_missed_then_estimates_without_an_angle_are_passed_over() -> None:
    one = scores()
    for tick in (0, 1, 5, 6):
        one.on_outputs(tick, (1.0,))
    for tick in range(7):
        one.on_estimate(tick, state(0.0), None)
    assert one.first.coded.count == 4


def test_when_estimates_lag_beyond_the_span_then_the_oldest_angles_are_forgotten() -> None:
    one = scores(span=3)
    for tick in range(10):
        one.on_outputs(tick, (1.0,))
    for tick in range(10):
        one.on_estimate(tick, state(0.0), None)
    assert one.first.coded.count == 3
