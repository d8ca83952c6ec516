"""The pitch form (11)-(15): what it finds, how sure it is, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

from plant_sim.identification.crosscheck import fit
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import REST_S, PseudoRandom, excite, parse_excitation
from plant_sim.identification.pitch import PitchIdentifier, PitchSettings
from plant_sim.identification.record import PitchRecord, identify, quiescent_angle
from tests.plant_sim.identification.experiments import (
    EXCITATION_A,
    EXCITATION_B,
    STEP_S,
    TRUE,
    equilibrium,
    errors,
    experiment,
)


@pytest.mark.parametrize("excitation", [EXCITATION_A, EXCITATION_B])
def test_when_sixty_seconds_are_excited_then_all_parameters_are_within_three_percent(
    excitation: str,
) -> None:
    record = experiment(excitation)
    found = identify(record, equilibrium(record))
    assert max(map(abs, errors(found.estimates))) < 0.01  # asked: 0.03; measured: 0.003
    assert found.warnings == ()
    assert found.condition > 0.01


@pytest.mark.parametrize("excitation", [EXCITATION_A, EXCITATION_B])
def test_when_white_torque_pushes_then_all_parameters_are_within_ten_percent(excitation: str) -> None:
    """a_w is the hard one: no unbiased estimate from 60 s of these data has less than 5 to 6 %."""
    settings = PitchSettings(filter_bandwidth_rad_s=3.0, forgetting_per_s=0.002)
    for seed in (1, 2, 3):
        record = experiment(excitation, 180.0, 2e-3, seed)
        found = identify(record, equilibrium(record, math.inf), settings)
        assert max(map(abs, errors(found.estimates))) < 0.10


def test_when_noise_is_drawn_again_then_the_errors_are_what_the_uncertainty_says() -> None:
    settings = PitchSettings(filter_bandwidth_rad_s=3.0)
    scores = []
    for seed in range(8):
        record = experiment(EXCITATION_A, 60.0, 2e-3, seed)
        found = identify(record, TRUE.equilibrium_rad, settings)
        true = (TRUE.rate_damping_per_s, TRUE.stiffness_per_s2, TRUE.torque_gain_rad_per_v_s2)
        pairs = zip(found.estimates, true, found.deviations, strict=False)
        scores += [(value - wanted) / spread for value, wanted, spread in pairs]
    assert 0.5 < float(np.sqrt(np.mean(np.square(scores)))) < 2.0


def test_when_no_quiet_stretch_is_at_hand_then_the_bias_is_estimated_with_the_others() -> None:
    record = experiment(EXCITATION_B)
    found = identify(record, None)
    assert max(map(abs, errors(found.estimates))) < 0.03
    assert found.estimates.equilibrium_rad == pytest.approx(TRUE.equilibrium_rad, abs=0.01)


def test_when_the_simulation_error_is_fitted_then_it_agrees_with_the_regression() -> None:
    record = experiment(EXCITATION_A)
    found = identify(record, equilibrium(record))
    check = fit(record, found.estimates, estimate_equilibrium=False)
    assert max(map(abs, errors(check.estimates))) < 0.08
    assert check.disagreements(found.estimates, found.deviations) == []
    assert check.residual_rad < 0.01


def test_when_the_log_says_the_wrong_lag_then_the_two_methods_or_their_spread_tell() -> None:
    """The torque acts on something else than the model believes: never a silent wrong estimate."""
    record = experiment(EXCITATION_A)
    pushed = PitchRecord(
        record.step_s,
        record.angle_rad + 0.3 * np.sin(2.0 * np.arange(len(record)) * record.step_s),
        record.front_volts,
        record.rear_volts,
    )
    found = identify(pushed, TRUE.equilibrium_rad)
    check = fit(pushed, found.estimates, estimate_equilibrium=False)
    assert found.warnings or check.disagreements(found.estimates, found.deviations)


def test_when_the_body_rests_then_its_angle_is_theta_0() -> None:
    record = experiment(EXCITATION_A)
    quiet = quiescent_angle(record)
    assert quiet is not None
    assert quiet.angle_rad == pytest.approx(TRUE.equilibrium_rad, abs=math.tau / 1024)
    assert quiet.start_s == 0.0
    assert quiet.end_s == pytest.approx(REST_S, abs=0.3)
    assert quiescent_angle(record.part(10.0, 60.0)) is None


def test_when_samples_come_one_by_one_then_the_result_is_that_of_the_record() -> None:
    record = experiment(EXCITATION_A, 20.0)
    whole = identify(record, -0.115)
    online = PitchIdentifier(STEP_S, -0.115)
    for index in range(len(record)):
        now = online.take(
            float(record.front_volts[index]),
            float(record.rear_volts[index]),
            float(record.angle_rad[index]),
        )
        assert tuple(now) == tuple(whole.history[index])


def record_of(**changes: object) -> PitchRecord:
    good = experiment(EXCITATION_A, 20.0)
    values = {
        "step_s": good.step_s,
        "angle_rad": good.angle_rad,
        "front_volts": good.front_volts,
        "rear_volts": good.rear_volts,
    }
    return PitchRecord(**{**values, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"step_s": 0.0}, "sampling time"),
        ({"angle_rad": np.full(2000, math.nan)}, "angle of sample 0 is not finite"),
        ({"angle_rad": np.linspace(0.0, 40.0, 2000)}, "degrees"),
        ({"front_volts": np.full(2000, 900.0)}, "millivolts"),
        ({"front_volts": np.zeros(10)}, "different lengths"),
    ],
)
def test_when_a_record_cannot_be_one_then_it_is_refused(changes: dict[str, object], text: str) -> None:
    with pytest.raises(IdentificationError, match=text):
        record_of(**changes)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"angle_rad": np.full(2000, 0.1)}, "angle never changes"),
        ({"front_volts": np.zeros(2000), "rear_volts": np.zeros(2000)}, "never changes"),
    ],
)
def test_when_nothing_moves_then_no_estimate_is_made(changes: dict[str, object], text: str) -> None:
    with pytest.raises(IdentificationError, match=text):
        identify(record_of(**changes), -0.115)


def test_when_the_log_is_in_degrees_of_small_motion_then_a_warning_names_the_doubt() -> None:
    """A log without real motion: noise of the encoder alone."""
    noise = np.random.default_rng(1).normal(0.0, 2e-3, 2000)
    found = identify(record_of(angle_rad=noise), 0.0)
    assert found.warnings


def test_when_motors_saturate_then_the_voltage_is_clamped_and_it_is_reported() -> None:
    record = experiment(EXCITATION_A, 20.0)
    found = identify(record, -0.115, PitchSettings(volts_max=1.0))
    assert any("commanded beyond" in text for text in found.warnings)


def test_when_front_and_rear_are_exchanged_then_the_negative_gain_is_pointed_out() -> None:
    record = experiment(EXCITATION_A)
    swapped = PitchRecord(STEP_S, record.angle_rad, record.rear_volts, record.front_volts)
    found = identify(swapped, -0.115)
    assert any("exchanged" in text for text in found.warnings)


@pytest.mark.parametrize(
    "text", ["sine:1,2,3", "square:1,2", "square:0,0,1", "square:1,0,0", "chirp:1,2,3,x", "prbs"]
)
def test_when_an_excitation_is_not_understood_then_the_grammar_is_shown(text: str) -> None:
    with pytest.raises(IdentificationError, match="excitation"):
        parse_excitation(text, STEP_S)


def test_when_a_sequence_is_pseudo_random_then_it_repeats_only_after_its_length() -> None:
    for length in (7, 9, 11):
        signal = PseudoRandom(STEP_S, STEP_S, 0.0, 1.0, length)
        bits = signal.bits
        assert len(bits) == 2**length - 1
        assert sum(bits) == 2 ** (length - 1)
        words = {bits[index : index + length] for index in range(len(bits) - length)}
        assert len(words) == len(bits) - length


def test_when_the_rig_ends_early_then_the_experiment_says_at_which_tick() -> None:
    signal = parse_excitation("square:1,0,1", STEP_S)
    with pytest.raises(IdentificationError, match="tick 7 of 600"):
        excite(lambda tick, *_: None if tick == 7 else 0.0, signal, STEP_S, 6.0)


def test_when_an_experiment_is_no_longer_than_its_rest_then_it_is_refused() -> None:
    signal = parse_excitation("square:0.2,0,2.5", STEP_S)
    with pytest.raises(IdentificationError, match="rests for 5 s first"):
        excite(lambda *_: 0.0, signal, STEP_S, 5.0)
