"""The helicopter with its damping, weights and thrusts to be learned, and a force on each axis."""

from __future__ import annotations

from typing import NamedTuple

from channel.codec.codec import Vector
from channel.codec.models.base import FunctionModel
from channel.codec.models.helicopter import (
    HelicopterConstants,
    HelicopterModel,
    HelicopterParameters,
    force_of,
    helicopter_tick,
)
from channel.codec.models.learned import LearnedModel
from channel.codec.numerics import cos, sin

TERMS = {
    **dict.fromkeys(("travel_damping", "travel_thrust", "travel_force"), 3),
    **dict.fromkeys(("elevation_weight", "elevation_damping"), 4),
    **dict.fromkeys(("elevation_thrust", "elevation_force"), 4),
    **dict.fromkeys(("pitch_weight", "pitch_damping", "pitch_thrust", "pitch_force"), 5),
}
"""of which state's rate each is; the weight of the elevation includes what turns with the pitch"""


class LearnedHelicopterConstants(NamedTuple):
    """Constants of `learned_helicopter_tick`."""

    plant: HelicopterConstants
    freshness: float
    """of a term's mean value, by which it moves to the present one in a tick"""


def helicopter_terms(state: Vector, p: HelicopterParameters) -> Vector:
    """Return the value of each term, an acceleration; that of a force is 1."""
    front = force_of(state[6], p.force_up, p.force_down)
    rear = force_of(state[7], p.force_up, p.force_down)
    lift = front + rear
    sin_e, cos_e = sin(state[1]), cos(state[1])
    sin_p, cos_p = sin(state[2]), cos(state[2])
    return (
        -p.travel_damping_per_s * state[3],
        -p.travel_thrust_rad_per_s2 * cos_e * sin_p * lift,
        1.0,
        -sin_e * (p.elevation_weight_rad_per_s2 + p.elevation_tilt_rad_per_s2 * cos_p),
        -p.elevation_damping_per_s * state[4],
        p.elevation_thrust_rad_per_s2 * cos_p * lift,
        1.0,
        -p.pitch_weight_rad_per_s2 * cos_e * sin_p,
        -p.pitch_damping_per_s * state[5],
        p.pitch_thrust_rad_per_s2 * (front - rear),
        1.0,
    )


def moved_mean(state: Vector, values: Vector, freshness: float, term: int) -> float:
    """Return the mean value of a term one tick later."""
    return state[19 + term] + freshness * (values[term] - state[19 + term])


def learned_helicopter_tick(
    state: Vector, command: Vector, held: Vector, constants: LearnedHelicopterConstants
) -> Vector:
    """Advance the helicopter by a tick, with its terms as they were at the tick's beginning."""
    y, f = helicopter_terms(state, constants.plant.equations), constants.freshness
    travel = state[8] * y[0] + state[9] * y[1] + state[10] * y[2]
    elevation = state[11] * y[3] + state[12] * y[4] + state[13] * y[5] + state[14] * y[6]
    pitch = state[15] * y[7] + state[16] * y[8] + state[17] * y[9] + state[18] * y[10]
    pushed = (held[0], held[1], held[2], held[3] + travel, held[4] + elevation, held[5] + pitch)
    means = (
        moved_mean(state, y, f, 0),
        moved_mean(state, y, f, 1),
        moved_mean(state, y, f, 2),
        moved_mean(state, y, f, 3),
        moved_mean(state, y, f, 4),
        moved_mean(state, y, f, 5),
        moved_mean(state, y, f, 6),
        moved_mean(state, y, f, 7),
        moved_mean(state, y, f, 8),
        moved_mean(state, y, f, 9),
        moved_mean(state, y, f, 10),
    )
    return helicopter_tick(state[:8], command, pushed, constants.plant) + state[8:19] + means


class LearnedHelicopterModel(LearnedModel, FunctionModel):
    """Three angles, two rotors, and the errors of eight terms and three forces."""

    tick_function = staticmethod(learned_helicopter_tick)

    def __init__(self, plant: HelicopterModel, freshness: float) -> None:
        super().__init__(plant, tuple(TERMS), tuple(TERMS.values()))
        self.constants = LearnedHelicopterConstants(plant.constants, freshness)
