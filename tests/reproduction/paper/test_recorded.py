"""The recorded flights: second half, after tuning on the first."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from reproduction.paper import real
from reproduction.paper.flights import Flown, fly
from tests.reproduction.paper.recorded_data import FOLDER, needs_data


@pytest.fixture(scope="module")
def first() -> real.FirstHalf:
    return real.identify_first_half(FOLDER)


@pytest.fixture(scope="module")
def flown(first: real.FirstHalf) -> Callable[[str], Flown]:
    jobs = {job.name: job for job in real.uiuc_jobs(FOLDER, first.model)}
    return lambda name: fly(replace(jobs[name], processes=False, keep_series=False), Path())


@needs_data
@pytest.mark.parametrize(
    ("rate", "rms"),
    [
        (10, 0.08),  # asked: 8 %; measured: 6.3 %
        pytest.param(16, 0.04, marks=pytest.mark.soak),
        (25, 0.02),  # asked: 3 %, the stretch 2 %; measured: 1.7 %
        (50, 0.012),
    ],
)
def test_when_tuned_on_the_first_half_then_the_second_half_is_estimated_this_well(
    flown: Callable[[str], Flown], rate: int, rms: float
) -> None:
    tuned = flown(f"uiuc-tuned-{rate}")
    assert tuned.summary["desyncs"] == 0
    assert tuned.summary["samples"] * tuned.summary["lead_ticks"] == 0
    assert tuned.rms <= rms
    assert tuned.rms < 0.5 * flown(f"uiuc-pcm-{rate}").rms
    assert tuned.rms < 0.5 * flown(f"uiuc-paper-{rate}").rms


@needs_data
def test_when_the_first_half_is_identified_then_the_regression_warns_and_the_fit_has_the_sign(
    first: real.FirstHalf,
) -> None:
    assert first.warnings
    assert 0.5 < first.model["torque_gain_rad_per_v_s2"] < 3.0


@needs_data
@pytest.mark.parametrize("name", real.NTNU_FILES)
def test_when_a_log_has_no_voltages_then_it_is_flown_without_torque(name: str, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    seconds = real.convert_ntnu(FOLDER / name, log)
    lines = log.read_text().splitlines()
    assert len(lines) - 1 == round(seconds * 100)
    assert all(line.endswith(",0,0") for line in lines[1:])
    jobs = [job for job in real.ntnu_jobs(FOLDER, tmp_path) if job.name.startswith(Path(name).stem)]
    errors = {job.preset: fly(job, tmp_path).rms for job in jobs}
    assert errors["tuned-10baud"] < 0.03  # measured: 1.9 and 1.8 %
    assert errors["tuned-20baud"] < errors["tuned-10baud"] < errors["paper-10baud"]
