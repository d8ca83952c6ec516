"""A whole flight as one function, to be compiled.

What the two sessions, the guard and the rig do one message at a time is done here sample by sample, in
the order of cause and effect: the transmitter's word, what the receiver made of it, its commands, the
plant under them. All arithmetic is that of the nodes, imported, and so is the order of a sample's ticks
(`fly_ticks`); tests compare with ordinary flights, bit by bit. A flight that leaves the ordinary
course, by a guard that steps in or an estimate that diverges, is not followed: it comes back with the
status `LEFT`, and the caller flies it with the nodes themselves.

The functions that depend on the kinds of model and coder are placeholders here (`parts`) and given
when the flight is compiled.
"""

from __future__ import annotations

import math
from typing import Any

from channel.codec.codec import add_correction, is_estimate
from channel.codec.lead import fly_ticks
from channel.protocol.limits import as_carried, limited
from plant_sim.pitch import pitch_step
from receiver.controllers.pid import clamped, is_stuck, pid_integral, pid_sum
from tenbaud.studies.flight_data import DONE, LEFT, Errors, Given, Motion, Numbers, Work
from tenbaud.studies.parts import decode, encode, held_of, sine, state_of, tick
from tenbaud.studies.sensor_side import act, angle_at, count_at, guess, look, put, score

Carried = tuple[bool, float, tuple[float, float, float, float], Motion, Errors]
"""Whether all is well, the PID's integral, the plant's state, the sensor node's side, the errors."""


def fly(
    numbers: Numbers,
    constants: Any,
    given: Given,
    work: Work,
) -> tuple[int, Motion, Errors]:
    """Fly; return status, what the sensor node's side ended with, and the errors.

    `constants` are those of (model, coder, plant, PID).
    """
    model_constants, coder_constants = constants[0], constants[1]
    plant = (given.start[0], given.start[1], 0.0, 0.0)
    motion = Motion(numbers.safe_front, numbers.safe_rear, 0, 0, 0, 0)
    errors = Errors(0, 0.0, 0.0, 0, 0.0, 0.0, 0, 0.0, 0.0)
    work.front[: numbers.lead] = numbers.initial_front
    work.rear[: numbers.lead] = numbers.initial_rear
    put(work.models[0], work.seen)
    work.given_out[0] = numbers.initial_front
    work.given_out[1] = numbers.initial_rear
    carried = (True, 0.0, plant, motion, errors)
    for sample in range(given.scored.shape[0]):
        well = _measure(sample, carried[2][0], numbers, model_constants, coder_constants, given, work)
        erased = _receive(sample, given, work)
        held = _open(sample, erased, numbers, coder_constants, work)
        carried = fly_ticks(
            _step,
            _close,
            _tick,
            (sample, numbers, constants, given, work),
            (well, carried[1], carried[2], carried[3], carried[4]),
            state_of(work.model),
            held,
            held_of(work.nothing),
            sample * numbers.per_sample,
            numbers.per_sample,
            numbers.lead,
        )
        if not carried[0]:
            return LEFT, carried[3], carried[4]
    return DONE, carried[3], carried[4]


def _step(flight: Any, carried: Carried, at: int, within: bool, ahead: bool, state: Any) -> Any:
    """Keep the state of a tick, and decide its command where that is not known."""
    _, numbers, constants, given, work = flight
    well, integral, plant, motion, errors = carried
    if within:
        work.coded[at] = state[0]
    if ahead:
        work.live[at] = state[0]
        decided, integral = _decide(
            at, state[0], state[1], integral, numbers, constants[3], given, work
        )
        well = well and decided
    return (well, integral, plant, motion, errors), (work.front[at], work.rear[at])


def _close(flight: Any, carried: Carried, state: Any) -> Carried:
    """Keep the state after a sample; what is carried says whether it is an estimate (`Codec.close`)."""
    row = flight[4].models[flight[0] + 1]
    for index in range(len(state)):
        row[index] = state[index]
    return (carried[0] and is_estimate(state), carried[1], carried[2], carried[3], carried[4])


def _tick(
    flight: Any, carried: Carried, at: int, within: bool, state: Any, volts: Any, held: Any
) -> Any:
    """Advance the model, and the plant beside it.

    Neither waits for the other within a tick, so that the processor works on both at once.
    """
    sample, numbers, constants, given, work = flight
    well, integral, plant, motion, errors = carried
    state = tick(state, volts, held, constants[0])
    if within and at < numbers.ticks:
        if at > sample * numbers.per_sample and numbers.uses_rates:
            look(at, _read(at, plant[0], numbers, given), numbers, constants[0], given, work)
        untripped, motion = act(at, plant[0], motion, numbers, constants[0], given, work)
        well = well and untripped
        if at >= numbers.window_start:
            angle = angle_at(motion.counts, numbers) if numbers.replay else plant[0]
            errors = score(at, sample, angle, errors, numbers, given, work)
        if not numbers.replay:
            torque = given.torque[at] if given.torque.shape[0] > 0 else 0.0
            volts = (motion.front, motion.rear)
            plant = pitch_step(plant, volts, torque, constants[2], sine)
    return (well, integral, plant, motion, errors), state


def _measure(
    sample: int,
    angle: float,
    numbers: Numbers,
    model_constants: Any,
    coder_constants: Any,
    given: Given,
    work: Work,
) -> bool:
    """Measure at a sample's beginning and send its word; return whether the estimate is one."""
    first = sample * numbers.per_sample
    known = given.known[first]
    put(work.models[known], work.model)
    put(work.coders[known], work.coder)
    well = True
    if known < sample:
        well = guess(sample, numbers, model_constants, coder_constants, given, work)
    look(first, _read(first, angle, numbers, given), numbers, model_constants, given, work)
    size = work.word.shape[0]
    word = work.sent[sample * size : (sample + 1) * size]
    encode(coder_constants, work.coder, work.model, work.seen, word)
    return well


def _read(at: int, angle: float, numbers: Numbers, given: Given) -> float:
    """Return the angle that the encoder shows."""
    return angle_at(given.counts[at] if numbers.replay else count_at(angle, numbers), numbers)


def _receive(sample: int, given: Given, work: Work) -> bool:
    """Make `work.word` what comes out of the line; return whether it is erased."""
    size = work.word.shape[0]
    kinds = given.alphabet.shape[0]
    for place in range(size):
        shift = given.shifts[sample * size + place]
        symbol = work.sent[sample * size + place]
        if shift < 0:
            work.word[:] = 0
            return True
        if shift > 0:
            number = 0
            while given.alphabet[number] != symbol:
                number += 1
            symbol = given.alphabet[(number + shift) % kinds]
        work.word[place] = symbol
    return False


def _open(
    sample: int,
    erased: bool,
    numbers: Numbers,
    coder_constants: Any,
    work: Work,
) -> Any:
    """Consume a word on the receiver's copy; return the correction to hold (`Codec.open`)."""
    model = work.models[sample]
    decode(
        coder_constants,
        work.coders[sample],
        model,
        work.word,
        erased,
        work.correction,
        work.coders[sample + 1],
    )
    put(model, work.model)
    if numbers.impulse:
        add_correction(work.model, work.correction)
        return held_of(work.nothing)
    return held_of(work.correction)


def _decide(
    at: int,
    angle: float,
    rate: float,
    integral: float,
    numbers: Numbers,
    pid_constants: Any,
    given: Given,
    work: Work,
) -> tuple[bool, float]:
    """Decide the command of a tick as the receiver's session does; return (well, integral)."""
    if numbers.replay:
        front, rear = given.commands[at, 0], given.commands[at, 1]
    else:
        error = given.reference[at] - angle
        total = pid_sum(pid_constants, integral, error, rate)
        if not math.isfinite(total):
            return False, integral
        first, second = pid_constants.mixing
        front = numbers.bias[0] + first * total
        rear = numbers.bias[1] + second * total
        stuck = is_stuck(front, first * error, numbers.command_max[0])
        stuck = is_stuck(rear, second * error, numbers.command_max[1]) and stuck
        integral = pid_integral(pid_constants, integral, error, stuck)
        front = clamped(front, numbers.command_max[0])
        rear = clamped(rear, numbers.command_max[1])
    front_before = work.front[at - 1] if at > 0 else numbers.initial_front
    rear_before = work.rear[at - 1] if at > 0 else numbers.initial_rear
    largest, slew, steps = numbers.command_max, numbers.slew, numbers.steps_per_unit
    work.front[at] = as_carried(limited(front, front_before, largest[0], slew[0]), steps[0])
    work.rear[at] = as_carried(limited(rear, rear_before, largest[1], slew[1]), steps[1])
    return True, integral
