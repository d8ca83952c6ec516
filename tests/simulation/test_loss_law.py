"""The figures of docs/RELIABILITY.md that are bounds, on shorter flights."""

from __future__ import annotations

import pytest

from benchmarks.reliability import FAULTS, Case, Flown, fly

SECONDS = 80.0


@pytest.fixture(scope="module")
def clean() -> Flown:
    return fly(Case("paper", "", 1, SECONDS))


@pytest.mark.parametrize("loss", [0.1, 0.3])
def test_when_bits_are_lost_then_the_error_follows_the_rate_that_is_left(
    clean: Flown, loss: float
) -> None:
    flown = fly(Case("paper", f"up:loss={loss}", 1, SECONDS))
    law = (1.0 - loss) ** -1.5
    assert 0.75 * law <= flown.coded_rms / clean.coded_rms <= 1.25 * law
    assert (flown.desyncs, flown.rejoins) == (0, 0)


def test_when_half_the_bits_are_lost_then_the_loop_stays_stable(clean: Flown) -> None:
    flown = fly(Case("paper", "up:loss=0.5", 1, SECONDS))
    assert flown.ended_well
    assert flown.coded_max < 0.3
    assert flown.coded_rms < 4.0 * clean.coded_rms


def test_when_one_bit_in_twenty_is_flipped_then_nothing_diverges() -> None:
    flown = fly(Case("paper", "up:flip=0.05", 1, SECONDS))
    assert (flown.desyncs, flown.rejoins) == (0, 0)
    assert flown.coded_max < 0.2


@pytest.mark.parametrize("faults", ["", FAULTS])
def test_when_the_round_trip_has_ten_periods_then_the_flight_is_locked(faults: str) -> None:
    flown = fly(Case("paper", faults, 1, 60.0, trip_periods=10))
    assert flown.ended_well
    assert flown.desyncs == 0
    assert flown.coded_max < 1.0
    # The predicted estimate, over a second of prediction, is the worse of the two.
    assert flown.live_rms > flown.coded_rms
