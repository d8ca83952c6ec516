"""The figures that the page promises, each with a margin, on the flights that the page flies."""

from __future__ import annotations

from pathlib import Path

import pytest

from reproduction.paper import draw, plan
from reproduction.paper.curves import read_curves
from reproduction.paper.flights import Flown, Job, fly
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.flight.ends import run_in_memory
from tenbaud.recording.folder import RunFolder

JOBS = {
    job.name: Job(job.name, job.preset, job.overrides)
    for job in plan.pitch_jobs() + plan.unit_jobs() + plan.zooming_jobs()
}
"""As planned, but all in this process: equal inputs give equal states."""
SIGNS_FLOWN = (0, 5)
"""Of the eight combinations of signs; all of them with the long tests."""


def flown(name: str) -> Flown:
    return fly(JOBS[name], Path())


@pytest.mark.parametrize(
    "index",
    [pytest.param(one, marks=() if one in SIGNS_FLOWN else pytest.mark.soak) for one in range(8)],
)
@pytest.mark.parametrize(
    ("coder", "rate", "largest", "of_reference"),
    [
        ("paper", 10, 0.05, 0.064),  # asked: 5 %; measured: 3.4 %, of the reference 4.9 %
        ("paper", 20, 0.05, 0.064),
        ("tuned", 10, 0.02, 0.02),  # asked: 2 %; measured: 1.0 %
        ("tuned", 20, 0.01, 0.01),
    ],
)
def test_when_the_plant_is_ten_percent_off_with_any_signs_then_the_claim_holds(
    coder: str, rate: int, largest: float, of_reference: float, index: int
) -> None:
    one = flown(plan.flight_name(coder, rate, 10) + (f"-{index}" if index else ""))
    assert one.summary["desyncs"] == 0
    assert one.largest <= largest
    assert one.largest_of_reference <= of_reference


@pytest.mark.parametrize(
    ("coder", "rate", "low", "high"),
    [
        ("paper", 10, 0.05, 0.15),  # the window of two locks: the claim fails here, as the page says
        ("three", 10, 0.0, 0.02),
        ("tuned", 10, 0.0, 0.02),
        ("tuned", 20, 0.0, 0.01),
    ],
)
def test_when_the_plant_is_exactly_the_model_then_the_window_decides(
    coder: str, rate: int, low: float, high: float
) -> None:
    assert low <= flown(plan.flight_name(coder, rate, 0)).largest <= high


def test_when_gains_are_read_in_volts_per_radian_then_the_reference_is_not_reached() -> None:
    assert flown("volts-per-rad-10baud").pitch_rad < 1.0


def test_when_the_controller_is_ideal_then_it_follows_the_reference() -> None:
    times, pitch, reference = draw.ideal_loop(50.0)
    late = times % 12.5 >= 11.5
    assert abs(pitch - reference)[late].mean() < 0.05
    assert 2.0 < abs(pitch).max() < 2.6


def test_when_a_shove_comes_then_time_based_zooming_is_lost_and_the_adaptive_rule_is_not() -> None:
    assert flown("zooming-open-loop-zoom-10baud-push").pitch_rad > 6.3
    assert flown("zooming-paper-10baud-push").largest < 0.25


def test_when_the_coder_has_no_memory_then_one_bit_does_not_hold_the_loop() -> None:
    assert flown("zooming-static-10baud-exact").pitch_rad > 6.3


def test_when_the_rate_is_estimated_then_ten_bits_do_better_than_a_thousand(tmp_path: Path) -> None:
    """Fig. 8: both read a ten-bit encoder, both are taken against the true rate."""
    errors = {}
    for job in plan.rate_jobs():
        config = load_config(job.preset, None, {**job.overrides, "link": {"kind": "memory"}})
        folder = RunFolder(tmp_path / job.name)
        folder.path.mkdir()
        run_in_memory(agree(config, "virtual"), folder, "none")
        curves = read_curves(folder.transmitter, folder.receiver)
        one = Flown(job.name, {}, 0.0, 0.0, 1.0, 1.0, curves)
        errors[job.name] = draw.rate_error(one)
    assert errors["rate-observer"] < 0.75 * errors["rate-usual"]  # measured: 0.50
    assert errors["rate-observer-tuned"] < 0.4 * errors["rate-usual"]  # measured: 0.24
