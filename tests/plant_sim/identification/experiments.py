"""Simulated identification experiments that several tests run."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from plant_sim.disturbance import WhiteTorque
from plant_sim.encoder import Encoder
from plant_sim.identification.excitation import REST_S, excite, parse_excitation
from plant_sim.identification.pitch import quiescent_angle
from plant_sim.identification.record import Record
from plant_sim.pitch import PitchParameters, PitchPlant

STEP_S = 0.01
TRUE = PitchParameters()
TEN_BITS = Encoder(1024)
EXCITATION_A = "square:0.2,0,2.5"
EXCITATION_B = "square:0.25,0.1,3"


@cache
def experiment(
    excitation: str, duration_s: float = 60.0, q: float = 0.0, seed: int = 1, step_s: float = STEP_S
) -> Record:
    """Excite a plant that rests at first; its angle is seen through a ten-bit encoder."""
    torque = WhiteTorque(q, step_s, seed) if q else None
    plant = PitchPlant(TRUE, step_s, torque, initial_angle_rad=TRUE.equilibrium_rad)

    def step(_tick: int, front: float, rear: float) -> float:
        angle = TEN_BITS.angle_rad(TEN_BITS.counts(plant.angle_rad))
        plant.advance((front, rear))
        return angle

    return excite(step, parse_excitation(excitation, step_s), step_s, duration_s)


def equilibrium(record: Record, spread_rad: float = 0.02) -> float:
    quiet = quiescent_angle(record.part(0.0, REST_S), spread_rad=spread_rad)
    assert quiet is not None
    return quiet.angle_rad


def errors(estimates: Sequence[float]) -> tuple[float, float, float]:
    """Return the relative errors of a_w, a_th, k_v."""
    true = (TRUE.rate_damping_per_s, TRUE.stiffness_per_s2, TRUE.torque_gain_rad_per_v_s2)
    a, b, c = (found / wanted - 1.0 for found, wanted in zip(estimates, true, strict=False))
    return a, b, c
