"""Several sets of parameters side by side: the numbers of each, and what is derived from them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares

from plant_sim.identification import trajectories
from plant_sim.identification.differences import Differences
from plant_sim.identification.filters import Array
from plant_sim.identification.segments import Segments, cut
from plant_sim.identification.structures import PitchStructure, Structure, names_of, parse_linear
from plant_sim.identification.trajectories import Candidate, simulation_residuals
from tests.plant_sim.identification.experiments import EXCITATION_A, experiment
from tests.plant_sim.identification.test_linear import COUPLED, record_of

PITCH = PitchStructure()
LINEAR = parse_linear(COUPLED.structure, ("output1", "output2"), ("input1", "input2"))


def segments_of(structure: Structure) -> Segments:
    record = experiment(EXCITATION_A, 20.0) if structure is PITCH else record_of(COUPLED, 1, 1000)
    return cut(record, structure, 2.0)


def several(structure: Structure) -> list[Candidate]:
    """Return candidates that differ in their parameters, lags and outputs."""
    segments, random = segments_of(structure), np.random.default_rng(3)
    names = names_of(structure)
    return [
        Candidate(
            dict(zip(names, random.normal(0.3, 0.2, len(names)).tolist(), strict=True)),
            lag_s,
            replace(segments, outputs=segments.outputs + shift),
        )
        for lag_s, shift in ((0.0, 0.0), (0.08, 0.0), (0.08, 0.3), (0.2, -0.1))
    ]


@pytest.mark.parametrize("at_once", [1, 3, 4])
@pytest.mark.parametrize("structure", [PITCH, LINEAR], ids=["pitch", "linear"])
def test_when_sets_are_simulated_side_by_side_then_each_is_as_alone(
    structure: Structure, at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    candidates = several(structure)
    alone = [simulation_residuals(structure, [one])[0] for one in candidates]
    count = candidates[0].segments.outputs.shape[1]
    size = 2 if structure is PITCH else 4
    monkeypatch.setattr(trajectories, "SIDE_BY_SIDE", at_once * count * (size + 1))
    together = simulation_residuals(structure, candidates)
    assert len(together) == len(alone)
    for one, other in zip(together, alone, strict=True):
        assert one == pytest.approx(other, rel=1e-12, abs=1e-13)
    for number in range(1, len(alone)):
        assert np.max(np.abs(alone[number] - alone[0])) > 1e-3


def test_when_derivatives_are_differences_then_they_are_scipys_own() -> None:
    times = np.linspace(0.0, 2.0, 40)
    calls = []

    def one(values: Array) -> Array:
        return np.asarray(np.exp(-values[0] * times) * values[1] - np.cos(values[2] * times))

    def residuals_of(sets: list[Array]) -> list[Array]:
        calls.append(len(sets))
        return [one(values) for values in sets]

    ours, first = Differences(residuals_of), np.array([0.0, -2.0, 3.0])
    found = least_squares(ours, first, ours.jacobian)
    wanted = least_squares(one, first)
    assert found.x.tolist() == wanted.x.tolist()
    assert found.jac.tolist() == wanted.jac.tolist()
    assert calls == [4] * found.nfev  # no set is evaluated twice for its derivatives
    assert ours.jacobian(first)[:, 2] == pytest.approx(times * np.sin(3.0 * times), abs=1e-6)
