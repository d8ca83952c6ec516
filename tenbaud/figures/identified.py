"""The identification behind Figs. 3 and 4, and how far it holds under noise."""

from __future__ import annotations

from dataclasses import dataclass

from plant_sim.identification.pitch import PitchSettings
from plant_sim.identification.record import PitchRecord, identify
from tenbaud.build_ends import nominal_plant
from tenbaud.config.load import load_config
from tenbaud.identify.run import Identified, run
from tenbaud.identify.sources import from_rig

EXCITATIONS = ("square:0.2,0,2.5", "square:0.25,0.1,3")
"""Frequency (Hz), bias (V), magnitude (V) of (a) and (b); the paper gives none of them."""

SEEDS = (1, 2, 3)
NOISE = "q=2e-3"
NOISY_SETTINGS = PitchSettings(filter_bandwidth_rad_s=3.0, forgetting_per_s=0.002)
NOISY_S = 180.0


@dataclass(frozen=True, slots=True)
class Trials:
    """Both experiments without noise, and the errors of those with it."""

    clean: list[Identified]
    clean_errors: list[float]
    """largest relative error of the three parameters after 60 s, per excitation"""
    noisy_errors: dict[str, list[float]]
    """the same under white torque, one per seed: "60 s" and "180 s", both excitations together"""


def identification_trials(*, noisy: bool) -> Trials:
    """Run the experiments on the simulated rig with a ten-bit encoder."""
    clean = [
        run(excitation, record_of(excitation, 60.0), "quiet", PitchSettings())
        for excitation in EXCITATIONS
    ]
    errors: dict[str, list[float]] = {}
    if noisy:
        for seconds in (60.0, NOISY_S):
            key = f"{seconds:.0f} s"
            errors[key] = []
            for excitation in EXCITATIONS:
                for seed in SEEDS:
                    record = record_of(excitation, NOISY_S, NOISE, seed).part(0.0, seconds)
                    rest = float(record.angle_rad[:500].mean())
                    found = identify(record, rest, NOISY_SETTINGS)
                    errors[key].append(largest_error(found.estimates))
    return Trials(clean, [largest_error(one.result.estimates) for one in clean], errors)


def record_of(excitation: str, duration_s: float, disturbance: str = "", seed: int = 1) -> PitchRecord:
    """Return one experiment on the paper's plant, resting at first."""
    model = load_config("paper-10baud").model
    rest = getattr(model, "equilibrium_rad", 0.0)
    section = {"initial_angle_rad": rest, "disturbance": disturbance}
    config = load_config(
        "paper-10baud",
        None,
        {"seed": seed, "transmitter": {"encoder_counts_per_turn": 1024, "plant": section}},
    )
    return from_rig(config, excitation, duration_s)


def largest_error(estimates: tuple[float, ...]) -> float:
    """Return the largest relative error of a_w, a_th and k_v."""
    true = nominal_plant(load_config("paper-10baud"))
    values = (true.rate_damping_per_s, true.stiffness_per_s2, true.torque_gain_rad_per_v_s2)
    pairs = zip(estimates, values, strict=False)
    return max(abs(found / wanted - 1.0) for found, wanted in pairs)
