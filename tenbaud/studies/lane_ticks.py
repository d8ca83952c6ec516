"""One tick of several flights at once: loops over lanes that a processor does several at a time.

Each loop calls the nodes' own functions; they are put into it when it is compiled, and turned into
instructions for several numbers each. Arrays have the lane last. No two of them overlap, and the
compiler is told so.
"""

from __future__ import annotations

import math
from typing import Any

from channel.limits import as_carried, limited
from plant_sim.encoder import counts_of
from plant_sim.pitch import pitch_step
from receiver.controllers.pid import motor_volts, pid_integral, pid_volts
from tenbaud.studies.flight_data import Numbers
from tenbaud.studies.parts import keep_state, lane_held, lane_state, sine, tick


def observe(state: Any, volts: Any, held: Any, constants: Any) -> None:
    """Advance the model of every lane by one tick."""
    for lane in range(state.shape[1]):
        command = (volts[0, lane], volts[1, lane])
        after = tick(lane_state(state, lane), command, lane_held(held, lane), constants)
        keep_state(state, lane, after)


def decide(
    reference: float,
    angle: Any,
    rate: Any,
    integral: Any,
    before: Any,
    after: Any,
    numbers: Numbers,
    constants: Any,
) -> None:
    """Decide the command of a tick for every lane, as the receiver's session does.

    A lane whose state is no estimate leaves its integral not finite for ever.
    """
    for lane in range(integral.shape[0]):
        error = reference - angle[lane]
        volts = pid_volts(constants, integral[lane], error, rate[lane])
        next_integral = pid_integral(constants, integral[lane], error, volts)
        integral[lane] = next_integral if math.isfinite(volts) else math.nan
        front, rear = motor_volts(constants, volts)
        front = limited(front, before[0, lane], numbers.volts_max, numbers.slew)
        rear = limited(rear, before[1, lane], numbers.volts_max, numbers.slew)
        after[0, lane] = as_carried(front)
        after[1, lane] = as_carried(rear)


def watch(angle: Any, counts: Any, still: Any, first: bool, numbers: Numbers) -> int:
    """Read the encoder of every lane; return the longest time, in ticks, that one has stood still."""
    longest = 0
    for lane in range(angle.shape[0]):
        count = counts_of(angle[lane], numbers.counts_per_turn, numbers.sign, numbers.zero_counts)
        rests = still[lane] + 1 if count == counts[lane] else 0
        rests = 0 if first else rests
        counts[lane] = count
        still[lane] = rests
        longest = max(longest, rests)
    return longest


def drive(wanted: Any, before: Any, after: Any, numbers: Numbers) -> None:
    """Put a tick's command on the motors of every lane, as the guard does."""
    for lane in range(wanted.shape[1]):
        after[0, lane] = limited(wanted[0, lane], before[0, lane], numbers.volts_max, numbers.slew)
        after[1, lane] = limited(wanted[1, lane], before[1, lane], numbers.volts_max, numbers.slew)


def push(plant: Any, volts: Any, torque: Any, constants: Any) -> None:
    """Advance the plant of every lane by one tick."""
    for lane in range(plant.shape[1]):
        state = (plant[0, lane], plant[1, lane], plant[2, lane], plant[3, lane])
        after = pitch_step(state, (volts[0, lane], volts[1, lane]), torque[lane], constants, sine)
        plant[0, lane] = after[0]
        plant[1, lane] = after[1]
        plant[2, lane] = after[2]
        plant[3, lane] = after[3]


def add_error(angle: Any, estimate: Any, squares: Any, largest: Any) -> None:
    """Add one tick's error of an estimate, as `transmitter.scores` does."""
    for lane in range(angle.shape[0]):
        error = angle[lane] - estimate[lane]
        squares[lane] += error * error
        largest[lane] = max(largest[lane], abs(error))


def add_tracking(angle: Any, reference: float, squares: Any, largest: Any) -> None:
    """Add one tick's distance from the reference, and keep the largest angle."""
    for lane in range(angle.shape[0]):
        error = reference - angle[lane]
        squares[lane] += error * error
        largest[lane] = max(largest[lane], abs(angle[lane]))


def keep(values: Any, row: Any) -> None:
    """Keep one number of every lane."""
    for lane in range(values.shape[0]):
        row[lane] = values[lane]
