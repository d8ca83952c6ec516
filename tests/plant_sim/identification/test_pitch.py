"""The pitch form (11)-(15): what it finds, how sure it is, and what it refuses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import REST_S, excite, parse_excitation
from plant_sim.identification.filters import Array
from plant_sim.identification.pipeline import OF_A_LOG, Options, identify
from plant_sim.identification.pitch import quiescent_angle
from plant_sim.identification.record import Record
from plant_sim.identification.regression import Filters, Regression, regress
from plant_sim.identification.segments import cut
from plant_sim.identification.structures import PitchStructure
from plant_sim.identification.trajectories import Candidate, simulation_residuals
from tests.plant_sim.identification.experiments import (
    EXCITATION_A,
    EXCITATION_B,
    STEP_S,
    TRUE,
    equilibrium,
    errors,
    experiment,
)

PAPER = Filters(lag_s=TRUE.motor_lag_s)
NAMES = ("a_w", "a_th", "k_v")


def values_of(found: Regression) -> list[float]:
    return [item.value for item in found.structure.parameters(found.values, found.covariance)]


@pytest.mark.parametrize("excitation", [EXCITATION_A, EXCITATION_B])
def test_when_sixty_seconds_are_excited_then_all_parameters_are_within_three_percent(
    excitation: str,
) -> None:
    record = experiment(excitation)
    found = regress(record, PitchStructure(equilibrium(record)), PAPER)
    assert max(map(abs, errors(values_of(found)))) < 0.01  # asked: 0.03; measured: 0.003
    assert found.condition > 0.01


@pytest.mark.parametrize("seed", [1, *(pytest.param(one, marks=pytest.mark.soak) for one in (2, 3))])
@pytest.mark.parametrize("excitation", [EXCITATION_A, EXCITATION_B])
def test_when_white_torque_pushes_then_all_parameters_are_within_ten_percent(
    excitation: str, seed: int
) -> None:
    """a_w is the hard one: no unbiased estimate from 60 s of these data has less than 5 to 6 %."""
    filters = replace(PAPER, bandwidth_rad_s=3.0, forgetting_per_s=0.002)
    record = experiment(excitation, 180.0, 2e-3, seed)
    found = regress(record, PitchStructure(equilibrium(record, math.inf)), filters)
    assert max(map(abs, errors(values_of(found)))) < 0.10


def test_when_noise_is_drawn_again_then_the_errors_are_what_the_uncertainty_says() -> None:
    filters = replace(PAPER, bandwidth_rad_s=3.0)
    scores = []
    true = (TRUE.rate_damping_per_s, TRUE.stiffness_per_s2, TRUE.torque_gain_rad_per_v_s2)
    for seed in range(8):
        record = experiment(EXCITATION_A, 60.0, 2e-3, seed)
        found = regress(record, PitchStructure(TRUE.equilibrium_rad), filters)
        for item, wanted in zip(
            found.structure.parameters(found.values, found.covariance), true, strict=False
        ):
            scores.append((item.value - wanted) / item.deviation)
    assert 0.5 < float(np.sqrt(np.mean(np.square(scores)))) < 2.0


def test_when_no_quiet_stretch_is_at_hand_then_the_bias_is_estimated_with_the_others() -> None:
    found = identify(
        experiment(EXCITATION_B),
        PitchStructure(),
        Options(filters=replace(OF_A_LOG, rests=True)),
    )
    values = [item.value for item in found.parameters]
    assert max(map(abs, errors(values))) < 0.03
    assert values[3] == pytest.approx(TRUE.equilibrium_rad, abs=0.01)


def test_when_the_simulation_error_is_fitted_then_it_agrees_with_the_regression() -> None:
    record = experiment(EXCITATION_A)
    found = identify(record, PitchStructure(equilibrium(record)), Options(TRUE.motor_lag_s))
    assert found.check is not None
    assert max(map(abs, errors(list(found.check.values.values())))) < 0.02  # measured: 0.004
    assert found.warnings == found.refused == ()
    assert found.check.residuals[0] < 0.01
    assert found.check.explained > 0.99


def test_when_the_motor_lag_is_not_given_then_it_is_found() -> None:
    record = experiment(EXCITATION_A)
    found = identify(record, PitchStructure(equilibrium(record)))
    assert found.lag_s == pytest.approx(TRUE.motor_lag_s, abs=max(0.01, 3.0 * found.lag_deviation_s))
    assert 0.0 < found.lag_deviation_s < 0.02


def test_when_something_else_pushes_the_body_then_it_is_never_a_silent_wrong_estimate() -> None:
    record = experiment(EXCITATION_A, 20.0, step_s=0.02)
    times = np.arange(len(record)) * record.step_s
    pushed = replace(record, outputs=record.outputs + 0.3 * np.sin(2.0 * times)[:, None])
    found = identify(pushed, PitchStructure(TRUE.equilibrium_rad))
    assert found.warnings or found.refused


def test_when_the_body_rests_then_its_angle_is_theta_0() -> None:
    record = experiment(EXCITATION_A)
    quiet = quiescent_angle(record)
    assert quiet is not None
    assert quiet.angle_rad == pytest.approx(TRUE.equilibrium_rad, abs=math.tau / 1024)
    assert quiet.start_s == 0.0
    assert quiet.end_s == pytest.approx(REST_S, abs=0.3)
    assert quiescent_angle(record.part(10.0, 60.0)) is None


def swing(
    step_s: float, volts: Array, damping: float, stiffness: float, gain: float, angle: float = 0.0
) -> Record:
    """Return what 12 bits see of (11) without a motor lag, from rest at an angle."""
    rate, rows = 0.0, []
    fine = 10
    for push in volts.tolist():
        rows.append(angle)
        for _ in range(fine):
            rate += step_s / fine * (gain * push - damping * rate - stiffness * math.sin(angle))
            angle += step_s / fine * rate
    step = math.tau / 4096
    outputs = np.round(np.array(rows)[:, None] / step) * step
    return Record(step_s, outputs, np.stack((volts, 0.0 * volts), axis=1))


def random_volts(steps: int, volts: float, every: int, seed: int = 1) -> Array:
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], steps)
    return np.asarray(volts * np.repeat(signs, every)[:steps])


def test_when_the_plant_is_faster_than_the_usual_filters_then_they_follow_it() -> None:
    record = swing(0.01, random_volts(1500, 5.0, 40), 0.1, 49.0, -1.6)
    found = identify(record, PitchStructure())
    assert found.values["a_w"] == pytest.approx(0.1, abs=0.02)
    assert [found.values["a_th cos(theta_0)"], found.values["k_v"]] == pytest.approx(
        [49.0, -1.6], rel=0.02
    )
    assert any("rad/s: filters of" in text for text in found.notes)
    assert any("exchanged" in text for text in found.warnings)


def test_when_a_record_begins_at_rest_then_its_only_step_counts() -> None:
    volts = np.concatenate((np.zeros(10), np.full(610, 6.0)))
    found = identify(swing(0.02, volts, 0.7, 1.05, 0.1), PitchStructure())
    assert found.refused == ()
    values = [item.value for item in found.parameters]
    assert values[:3] == pytest.approx([0.7, 1.05, 0.1], rel=0.05)
    assert values[3] == pytest.approx(0.0, abs=0.05)


def test_when_a_record_begins_in_motion_then_its_beginning_does_not_bend_the_estimate() -> None:
    record = swing(0.02, random_volts(2500, 4.0, 60), 0.4, 4.0, 0.2).part(9.3, 50.0)
    found = identify(record, PitchStructure())
    assert [item.value for item in found.parameters][:3] == pytest.approx([0.4, 4.0, 0.2], rel=0.03)


@pytest.mark.parametrize("seed", [0, *(pytest.param(one, marks=pytest.mark.soak) for one in (1, 2, 3))])
def test_when_there_is_no_friction_then_the_damping_is_never_below_0(seed: int) -> None:
    record = swing(0.02, random_volts(1500, 3.0, 60, seed), 0.0, 4.0, 0.2)
    noise = np.random.default_rng(seed).normal(0.0, 2e-3, record.outputs.shape)
    found = identify(replace(record, outputs=record.outputs + noise), PitchStructure())
    assert found.refused == ()
    assert 0.0 <= found.parameters[0].value < 0.01
    if not found.structure.damped:
        assert any("held at 0" in text for text in found.notes)
    assert [item.value for item in found.parameters][1:3] == pytest.approx([4.0, 0.2], rel=0.05)


def record_of(**changes: object) -> Record:
    return replace(experiment(EXCITATION_A, 20.0), **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"step_s": 0.0}, "sampling time"),
        ({"outputs": np.full((2000, 1), math.nan)}, "pitch of sample 0 is not finite"),
        ({"inputs": np.zeros((10, 2))}, "different lengths"),
    ],
)
def test_when_a_record_cannot_be_one_then_it_is_refused(changes: dict[str, object], text: str) -> None:
    with pytest.raises(IdentificationError, match=text):
        record_of(**changes)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"outputs": np.full((2000, 1), 0.1)}, "pitch never changes"),
        ({"inputs": np.zeros((2000, 2))}, "voltage difference of the motors never changes"),
    ],
)
def test_when_nothing_moves_then_no_estimate_is_made(changes: dict[str, object], text: str) -> None:
    with pytest.raises(IdentificationError, match=text):
        identify(record_of(**changes), PitchStructure(-0.115))


def test_when_a_log_holds_noise_alone_then_no_model_is_supported() -> None:
    noise = np.random.default_rng(1).normal(0.0, 2e-3, (2000, 1))
    assert identify(record_of(outputs=noise), PitchStructure(0.0)).refused


def test_when_motors_saturate_then_the_voltage_is_clamped() -> None:
    record = experiment(EXCITATION_A, 20.0)
    assert np.abs(PitchStructure(volts_max=1.0).acting(record.inputs)).max() == 2.0


def test_when_front_and_rear_are_exchanged_then_the_negative_gain_is_pointed_out() -> None:
    record = experiment(EXCITATION_A)
    found = identify(replace(record, inputs=record.inputs[:, ::-1]), PitchStructure(-0.115))
    assert any("exchanged" in text for text in found.warnings)


def test_when_initial_states_are_wrong_then_the_residuals_do_not_have_them() -> None:
    record = experiment(EXCITATION_A, 30.0)
    structure = PitchStructure(TRUE.equilibrium_rad)
    segments = cut(record, structure, 2.0)
    true = dict(zip(NAMES, (0.1, 0.5, 0.35), strict=True))
    (left,) = simulation_residuals(structure, [Candidate(true, TRUE.motor_lag_s, segments)])
    assert np.sqrt(np.mean(left**2)) < math.tau / 1024 / 2.0


@pytest.mark.parametrize(
    "text", ["sine:1,2,3", "square:1,2", "square:0,0,1", "square:1,0,0", "chirp:1,2,3,x", "prbs"]
)
def test_when_an_excitation_is_not_understood_then_the_grammar_is_shown(text: str) -> None:
    with pytest.raises(IdentificationError, match="excitation"):
        parse_excitation(text, STEP_S)


def test_when_a_sequence_is_pseudo_random_then_it_repeats_only_after_its_length() -> None:
    volts = parse_excitation(f"prbs:{STEP_S},0,1", STEP_S)
    values = [volts(tick) for tick in range(2 * 511)]
    assert values[:511] == values[511:]
    assert values[:511].count(1.0) == 256
    words = {tuple(values[index : index + 9]) for index in range(511)}
    assert len(words) == 511


def test_when_the_rig_ends_early_then_the_experiment_says_at_which_tick() -> None:
    signal = parse_excitation("square:1,0,1", STEP_S)
    with pytest.raises(IdentificationError, match="tick 7 of 600"):
        excite(lambda tick, *_: None if tick == 7 else 0.0, signal, STEP_S, 6.0)


def test_when_an_experiment_is_no_longer_than_its_rest_then_it_is_refused() -> None:
    signal = parse_excitation("square:0.2,0,2.5", STEP_S)
    with pytest.raises(IdentificationError, match="rests for 5 s first"):
        excite(lambda *_: 0.0, signal, STEP_S, 5.0)
