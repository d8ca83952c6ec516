"""Angles to counts and back."""

from __future__ import annotations

import math

import pytest

from plant_sim.encoder import QUANSER_PITCH, Encoder

TEN_BITS = Encoder(1024)


def test_presets_have_the_counts_of_their_hardware() -> None:
    assert (TEN_BITS.counts_per_turn, QUANSER_PITCH.counts_per_turn) == (1024, 4096)
    assert TEN_BITS.counts(math.pi / 2) == 256
    assert QUANSER_PITCH.counts(math.pi / 2) == 1024


@pytest.mark.parametrize(
    ("angle_counts", "expected"),
    [(0.0, 0), (0.49, 0), (0.5, 1), (0.51, 1), (1.49, 1), (-0.49, 0), (-0.51, -1), (-1.6, -2)],
)
def test_angles_round_to_the_nearest_count(angle_counts: float, expected: int) -> None:
    # Four counts a turn: a quarter turn each, so that halves survive the division by tau.
    assert Encoder(4).counts(angle_counts * math.tau / 4) == expected


def test_counts_go_on_over_several_turns() -> None:
    assert TEN_BITS.counts(3 * math.tau) == 3 * 1024
    assert TEN_BITS.counts(-2.25 * math.tau) == -2304


def test_sign_and_zero_shift_what_is_read() -> None:
    encoder = Encoder(4096, sign=-1, zero_counts=-300)
    assert encoder.counts(0.0) == -300
    assert encoder.counts(math.pi / 2) == -1324
    assert encoder.angle_rad(-1324) == pytest.approx(math.pi / 2, rel=1e-15)


@pytest.mark.parametrize("encoder", [TEN_BITS, QUANSER_PITCH, Encoder(8192, -1, 77)])
def test_every_count_comes_back_from_its_angle(encoder: Encoder) -> None:
    assert all(encoder.counts(encoder.angle_rad(n)) == n for n in range(-20_000, 20_001, 7))


def test_the_error_is_at_most_half_a_count() -> None:
    angles = [0.001 * n - 5.0 for n in range(10_000)]
    errors = [abs(TEN_BITS.angle_rad(TEN_BITS.counts(angle)) - angle) for angle in angles]
    assert 0.49 * math.tau / 1024 < max(errors) <= 0.5 * math.tau / 1024 + 1e-12


@pytest.mark.parametrize("angle_rad", [math.nan, math.inf, -math.inf])
def test_an_angle_that_is_not_finite_is_refused(angle_rad: float) -> None:
    with pytest.raises(ValueError, match="angle_rad"):
        TEN_BITS.counts(angle_rad)


def test_impossible_encoders_are_refused() -> None:
    with pytest.raises(ValueError, match="counts_per_turn is 0"):
        Encoder(0)
    with pytest.raises(ValueError, match="sign is 2"):
        Encoder(1024, sign=2)
