"""Percentiles of lateness."""

from __future__ import annotations

import pytest

from channel.line.meters import LatenessMeter


def test_when_latenesses_are_added_then_percentiles_are_right_within_a_bin() -> None:
    meter = LatenessMeter()
    assert meter.percentile_ms(50.0) is None
    for microseconds in range(1000):
        meter.add(microseconds * 1000)
    assert meter.percentile_ms(50.0) == pytest.approx(0.5, abs=0.011)
    assert meter.percentile_ms(99.0) == pytest.approx(0.99, abs=0.011)
    assert meter.percentile_ms(100.0) == pytest.approx(0.999)


def test_when_ticks_are_early_or_very_late_then_they_have_a_place() -> None:
    meter = LatenessMeter()
    meter.add(-5)
    meter.add(3_000_000_000)
    assert meter.count == 2
    assert meter.percentile_ms(100.0) == 3000.0
    assert meter.percentile_ms(50.0) == pytest.approx(0.01)
