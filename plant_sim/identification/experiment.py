"""An identification experiment on a rig: rest, then an exciting signal, then estimates.

The rig is anything that gives an angle and takes voltages once per tick, simulated or real. It rests
first with both motors at the normal force alone, which gives theta_0; then mu follows the signal.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import ExcitingSignal
from plant_sim.identification.record import PitchRecord

Step = Callable[[int, float, float], float | None]
"""(tick, front volts, rear volts) -> angle measured before they act, rad; None when the rig ends."""

REST_S = 5.0


def excite(
    step: Step,
    signal: ExcitingSignal,
    step_s: float,
    duration_s: float,
    *,
    rest_s: float = REST_S,
    normal_force_volts: float = 0.0,
) -> PitchRecord:
    """Return the record of the whole experiment of `duration_s`, the rest at its beginning included.

    The rest belongs to it: the state filters must have seen that the body was quiet before.
    """
    rest = round(rest_s / step_s)
    total = round(duration_s / step_s)
    if total <= rest:
        raise IdentificationError(
            f"an experiment of {duration_s:g} s is over before the rig is excited: it rests for "
            f"{rest_s:g} s first; make it longer (--duration), best by a minute"
        )
    rows = np.empty((total, 3))
    for tick in range(total):
        mu = signal.volts(tick - rest) if tick >= rest else 0.0
        front, rear = 0.5 * (normal_force_volts + mu), 0.5 * (normal_force_volts - mu)
        angle = step(tick, front, rear)
        if angle is None:
            raise IdentificationError(f"the rig ended at tick {tick} of {total}")
        rows[tick] = angle, front, rear
    return PitchRecord(step_s, rows[:, 0], rows[:, 1], rows[:, 2])
