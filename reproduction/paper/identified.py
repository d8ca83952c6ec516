"""The identification behind Figs. 3 and 4, and how far it holds under noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from plant_sim.identification.excitation import REST_S, excite, parse_excitation
from plant_sim.identification.pipeline import Options
from plant_sim.identification.record import Record
from plant_sim.identification.regression import Filters, Regression, regress
from plant_sim.identification.structures import PitchStructure
from plant_sim.pitch import PitchPlant
from tenbaud.build.rig import nominal_plant
from tenbaud.config.load import load_config
from tenbaud.identification.run import Identified, Wanted, run
from tenbaud.identification.sources import from_rig

EXCITATIONS = ("square:0.2,0,2.5", "square:0.25,0.1,3")
"""Frequency (Hz), bias (V), magnitude (V) of (a) and (b); the paper gives none of them."""

SEEDS = (1, 2, 3)
NOISE_DENSITY = 2e-3
NOISE = f"q={NOISE_DENSITY}"
MOTOR_LAG_S = 0.08
"""T_m, which the paper takes as known"""
NOISY_FILTERS = Filters(3.0, forgetting_per_s=0.002, lag_s=MOTOR_LAG_S)
PAPER_FILTERS = Filters(lag_s=MOTOR_LAG_S)
CLEAN_S = 60.0
NOISY_S = 180.0


@dataclass(frozen=True, slots=True)
class Trials:
    """Both experiments without noise, and the errors of those with it."""

    clean: list[Identified]
    clean_errors: list[float]
    """largest relative error of the three parameters after 60 s, per excitation"""
    noisy_errors: list[tuple[float, float]]
    """the same under white torque, after 60 s and after 180 s, per excitation and seed"""


def clean_trial(excitation: str) -> Identified:
    """Run one experiment without noise, on the simulated rig with a ten-bit encoder."""
    options = Options(MOTOR_LAG_S, PAPER_FILTERS.bandwidth_rad_s, PAPER_FILTERS)
    return run(excitation, record_of(excitation, CLEAN_S), Wanted(equilibrium="quiet", options=options))


def noisy_trial(excitation: str, seed: int) -> tuple[float, float]:
    """Return the largest relative error after 60 s and after 180 s, under white torque."""
    record = record_of(excitation, NOISY_S, NOISE, seed)
    # The body is never at rest here; the mean of its first 5 s has to do for theta_0.
    rest = float(record.outputs[: round(REST_S / record.step_s)].mean())
    found = regress(record, PitchStructure(rest), NOISY_FILTERS)
    early = int(np.searchsorted(found.times_s, CLEAN_S - 1.5 * record.step_s))
    return largest_error(found, early), largest_error(found)


def best_possible_damping_error(excitation: str, duration_s: float = CLEAN_S) -> float:
    """Return the least standard error of `a_w`, relative, that any unbiased method can have.

    It is the Cramer-Rao bound for angles and rates known without error and the noise torque alone:
    q times the inverse of the integral of phi phi', phi being the unfiltered regressors.
    """
    true = nominal_plant(load_config("paper-10baud"))
    step_s = 0.01
    plant = PitchPlant(true, step_s, initial_angle_rad=true.equilibrium_rad)
    rows = []

    def step(_tick: int, front: float, rear: float) -> float:
        angle, rate, front_lagged, rear_lagged = plant.state
        rows.append((rate, math.sin(angle - true.equilibrium_rad), front_lagged - rear_lagged))
        plant.advance((front, rear))
        return angle

    excite(step, parse_excitation(excitation, step_s), step_s, duration_s)
    regressors = np.array(rows)
    information = regressors.T @ regressors * step_s / NOISE_DENSITY
    deviation = math.sqrt(float(np.linalg.inv(information)[0, 0]))
    return deviation / true.rate_damping_per_s


def record_of(excitation: str, duration_s: float, disturbance: str = "", seed: int = 1) -> Record:
    """Return one experiment on the paper's plant, resting at first."""
    model = load_config("paper-10baud").model
    rest = getattr(model, "equilibrium_rad", 0.0)
    section = {"initial": rest, "disturbance": disturbance}
    config = load_config(
        "paper-10baud",
        None,
        {"seed": seed, "transmitter": {"encoders": {"counts_per_turn": 1024}, "plant": section}},
    )
    return from_rig(config, excitation, duration_s)


def largest_error(found: Regression, row: int = -1) -> float:
    """Return the largest relative error of a_w, a_th and k_v at a row of the estimates' history."""
    true = nominal_plant(load_config("paper-10baud"))
    values = found.values_at(row)
    pairs = (
        ("a_w", true.rate_damping_per_s),
        ("a_th", true.stiffness_per_s2),
        ("k_v", true.torque_gain_rad_per_v_s2),
    )
    return max(abs(values[name] / wanted - 1.0) for name, wanted in pairs)
