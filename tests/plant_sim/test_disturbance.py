"""Seeded torques: their statistics, their timing and how a command line names them."""

from __future__ import annotations

import math
import re
from itertools import pairwise

import pytest

from plant_sim.disturbance import StepTorque, Sum, WhiteTorque, parse_disturbance
from plant_sim.pitch import PitchParameters, PitchPlant

STEP_S = 0.01
GOLDEN = [-0.21172433835112828, -0.1716122325756144, 2.2140161197647896]


def torques(disturbance: WhiteTorque | StepTorque | Sum, steps: int) -> list[float]:
    return [disturbance.torque(index) for index in range(steps)]


def test_equal_seeds_give_equal_torques_and_other_seeds_others() -> None:
    first = torques(WhiteTorque(2e-3, STEP_S, seed=7), 10_000)
    assert first == torques(WhiteTorque(2e-3, STEP_S, seed=7), 10_000)
    other = torques(WhiteTorque(2e-3, STEP_S, seed=8), 10_000)
    assert sum(a == b for a, b in zip(first, other, strict=True)) == 0
    assert all(type(torque) is float for torque in first)


def test_the_torques_of_a_seed_stay_the_same_from_version_to_version() -> None:
    # A new numpy may draw other normal numbers; then every seeded run changes, and this says so.
    white = WhiteTorque(1.0, 1.0, seed=2024)
    assert [white.torque(index) for index in (0, 1, 4096)] == pytest.approx(GOLDEN, abs=1e-12)


def test_blocks_differ_and_steps_may_be_asked_for_again_in_any_order() -> None:
    white = WhiteTorque(2e-3, STEP_S, seed=7)
    first = torques(white, 3 * 4096)
    assert len(set(first)) == len(first)
    order = [9000, 4095, 4096, 0, 12_287, 4095]
    assert [white.torque(index) for index in order] == [first[index] for index in order]


@pytest.mark.parametrize("step_s", [0.002, 0.01, 0.05])
def test_samples_have_the_spectral_density_asked_for(step_s: float) -> None:
    count, density = 100_000, 2e-3
    samples = torques(WhiteTorque(density, step_s, seed=1), count)
    mean = sum(samples) / count
    measured = step_s * sum((sample - mean) ** 2 for sample in samples) / (count - 1)
    # Five standard deviations of each estimate.
    assert abs(mean) < 5.0 * math.sqrt(density / step_s / count)
    assert abs(measured / density - 1.0) < 5.0 * math.sqrt(2.0 / count)
    correlation = step_s * sum(a * b for a, b in pairwise(samples)) / count
    assert abs(correlation / density) < 5.0 / math.sqrt(count)


@pytest.mark.parametrize("step_s", [0.01, 0.04])
def test_the_rate_of_a_free_plant_wanders_as_density_times_time(step_s: float) -> None:
    free = PitchParameters(rate_damping_per_s=0.0, stiffness_per_s2=0.0)
    density, seeds = 2e-3, 1500
    squares = {1.0: 0.0, 2.0: 0.0}
    for seed in range(seeds):
        plant = PitchPlant(free, step_s, WhiteTorque(density, step_s, seed))
        for time_s in squares:
            for _ in range(round(1.0 / step_s)):
                plant.advance((0.0, 0.0))
            squares[time_s] += plant.rate_rad_s**2
    for time_s, total in squares.items():
        assert abs(total / seeds / (density * time_s) - 1.0) < 5.0 * math.sqrt(2.0 / seeds)


def test_step_acts_from_its_start_until_its_end() -> None:
    push = StepTorque(start_s=0.03, torque_rad_s2=0.5, step_s=STEP_S, end_s=0.07)
    assert torques(push, 9) == [0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5, 0.0, 0.0]
    for_ever = StepTorque(start_s=0.02, torque_rad_s2=-1.0, step_s=STEP_S)
    assert torques(for_ever, 4) == [0.0, 0.0, -1.0, -1.0]
    assert for_ever.torque(10**9) == -1.0


def test_step_times_fall_on_their_step_whatever_the_division_rounds_to() -> None:
    for step in range(1, 3000):
        push = StepTorque(start_s=step * STEP_S, torque_rad_s2=1.0, step_s=STEP_S)
        assert (push.torque(step - 1), push.torque(step)) == (0.0, 1.0)


def test_sum_adds_its_parts() -> None:
    both = Sum(StepTorque(0.0, 0.25, STEP_S), StepTorque(0.01, 1.0, STEP_S))
    assert torques(both, 3) == [0.25, 1.25, 1.25]
    assert torques(Sum(), 2) == [0.0, 0.0]


def test_parser_builds_what_the_text_says() -> None:
    parsed = parse_disturbance("q=2e-3, step=0.5@10..12,step=-1@11", STEP_S, seed=3)
    white = WhiteTorque(2e-3, STEP_S, seed=3)
    expected = {999: 0.0, 1000: 0.5, 1099: 0.5, 1100: -0.5, 1199: -0.5, 1200: -1.0, 9999: -1.0}
    assert {index: parsed.torque(index) - white.torque(index) for index in expected} == pytest.approx(
        expected, abs=1e-12
    )


@pytest.mark.parametrize(
    ("text", "piece", "fault"),
    [
        ("", "''", "unknown kind ''"),
        ("q=1,", "''", "unknown kind ''"),
        ("noise=1", "'noise=1'", "unknown kind 'noise'"),
        ("q", "'q'", "q is '', not a number"),
        ("q=many", "'q=many'", "q is 'many'"),
        ("q=-1", "'q=-1'", "at least 0"),
        ("q=nan", "'q=nan'", "finite"),
        ("q=1,q=2", "'q=2'", "twice"),
        ("q=1,step=0.5", "'step=0.5'", "needs '@START'"),
        ("step=x@1", "'step=x@1'", "TORQUE is 'x'"),
        ("step=1@", "'step=1@'", "START is ''"),
        ("step=1@2..", "'step=1@2..'", "END is ''"),
        ("step=1@2..1", "'step=1@2..1'", "above start_s = 2.0"),
        ("step=1@-2", "'step=1@-2'", "at least 0"),
        ("q=1e-3:abc", "'q=1e-3:abc'", "q is 'abc', not a number"),
        ("step=1:@0", "'step=1:@0'", "TORQUE is '', not a number"),
    ],
)
def test_parser_names_the_bad_piece_and_the_grammar(text: str, piece: str, fault: str) -> None:
    with pytest.raises(ValueError, match=re.escape(f"disturbance piece {piece}: ")) as caught:
        parse_disturbance(text, STEP_S, seed=0)
    message = str(caught.value)
    assert fault in message
    assert "step=TORQUE@START[..END]" in message


def test_impossible_disturbances_are_refused() -> None:
    with pytest.raises(ValueError, match="seed is -1"):
        WhiteTorque(1.0, STEP_S, seed=-1)
    with pytest.raises(ValueError, match="step_s is 0"):
        WhiteTorque(1.0, 0.0, seed=0)
    with pytest.raises(ValueError, match="step_index is -1"):
        WhiteTorque(1.0, STEP_S, seed=0).torque(-1)
    with pytest.raises(ValueError, match="torque_rad_s2 is inf"):
        StepTorque(0.0, math.inf, STEP_S)


@pytest.mark.parametrize("steps", [0, 1, 4096, 9000])
def test_when_torques_are_asked_for_at_once_then_they_are_those_of_each_step(steps: int) -> None:
    one = parse_disturbance("step=-0.25@40,q=2e-3,step=0.5@10..12", 0.01, 7)
    assert one.torques(steps).tolist() == [one.torque(step) for step in range(steps)]
