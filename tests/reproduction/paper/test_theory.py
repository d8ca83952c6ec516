"""What the theory pages and the animation tell, measured again."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from reproduction.paper import animation, theory
from reproduction.paper.copies import fly_copies
from tenbaud.bounds.closed import DOUBLE_INTEGRATOR
from tenbaud.cli.commands import app
from tests.rules.sources import TOP

LIMITS = (TOP / "docs/theory/limits.md").read_text(encoding="utf-8")


def test_when_bits_flip_then_only_the_echo_keeps_the_copies_equal() -> None:
    apart, together = fly_copies(echo=False), fly_copies(echo=True)
    assert len(together.flipped_s) > 20
    assert float(np.max(together.apart_rad)) == 0.0
    assert float(np.max(np.abs(together.error_rad[100:]))) < 0.3
    assert float(np.max(apart.apart_rad)) > 1.0
    before = apart.times_s < apart.flipped_s[0]
    assert float(np.max(apart.apart_rad[before])) == 0.0


@pytest.mark.parametrize("rate", [10, pytest.param(50, marks=pytest.mark.soak)])
def test_when_a_rate_of_the_table_is_flown_then_its_errors_come_out(rate: int) -> None:
    cells = r"([\d.]+) mrad \| " * 3
    row = re.search(rf"^\| {rate} bit/s \| {cells}", LIMITS, re.MULTILINE)
    assert row is not None
    floor, paper, tuned = (float(cell) for cell in row.groups())
    assert 1e3 * math.sqrt(0.890 * theory.TORQUE_DENSITY / rate**3) == pytest.approx(floor, abs=0.006)
    assert 1e3 * theory.errors_of(*theory.paper_at(rate)).coded_rad == pytest.approx(paper, rel=0.03)
    assert 1e3 * theory.errors_of(*theory.scaled_at(rate)).coded_rad == pytest.approx(tuned, rel=0.03)


def floor_of(phase: float) -> float:
    """Return P11 at 1 bit/s, q = 1, with cos(phase) of the angle and sin(phase) of the rate seen."""
    from scipy.linalg import solve_continuous_are

    plant, torque = np.array([[0.0, 1.0], [0.0, 0.0]]), np.diag([0.0, 1.0])
    low, high = 1e-2, 1e2
    for _ in range(32):
        scale = math.sqrt(low * high)
        seen = scale * np.array([[math.cos(phase), math.sin(phase)]])
        spread = solve_continuous_are(plant.T, seen.T, torque, np.eye(1))
        rate = float((seen @ spread @ seen.T)[0, 0]) / (2.0 * math.log(2.0))
        low, high = (scale, high) if rate < 1.0 else (low, scale)
    return float(spread[0, 0])


def test_when_the_floor_is_minimised_then_it_is_the_number_of_the_page() -> None:
    phases = np.linspace(0.74, 0.79, 5)
    floors = [floor_of(float(phase)) for phase in phases]
    assert min(floors) == pytest.approx(DOUBLE_INTEGRATOR, abs=1e-3)
    assert math.tan(phases[int(np.argmin(floors))]) == pytest.approx(0.96, abs=0.03)
    assert floor_of(1e-6) == pytest.approx(1.0 / (2.0 * math.log(2.0) ** 3), rel=1e-3)


def test_when_the_lead_grows_then_the_coded_error_stays_and_the_live_one_does_not() -> None:
    near, far = (
        theory.errors_of(
            "tuned-10baud",
            theory.with_torque({"duration_s": 80.0, "timing": {"lead_ticks": lead}}),
        )
        for lead in (0, 50)
    )
    assert near.live_rad == near.coded_rad
    assert far.coded_rad == pytest.approx(near.coded_rad, rel=0.1)
    assert far.live_rad > 3.0 * far.coded_rad


def test_when_the_animation_is_drawn_then_a_corrupted_codec_and_a_cut_line_are_both_repaired() -> None:
    story = animation.fly_story()
    assert [index for index, equal in enumerate(story.digests) if not equal] == [
        animation.CORRUPTED_SAMPLE
    ]
    silent = [index for index, word in enumerate(story.words) if word is None]
    assert 20 <= len(silent) <= 25
    assert set(silent) >= set(range(150, 170))
    good = [text for _, text, good in story.events if good]
    assert good == ["a common state again: epoch 1", "a common state again: epoch 2"]
    picture = animation.frame_at(story, 16.0)
    assert picture.width > 600
    red, green, blue = np.moveaxis(np.asarray(picture).astype(int), 2, 0)
    assert np.sum((red > 180) & (green < 60) & (blue < 60)) > 300, "the missing bits are drawn in red"


@pytest.mark.soak
def test_when_the_pictures_of_the_pages_are_asked_for_then_they_are_drawn(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["figures", "theory", "animation", "--docs", str(tmp_path)])
    assert result.exit_code == 0, result.output
    for name in ("coding", "observer", "lockstep", "limits"):
        assert (tmp_path / "figures" / f"theory-{name}.png").stat().st_size > 10_000
    assert 100_000 < (tmp_path / "figures" / "tenbaud.gif").stat().st_size < 1_000_000
