"""The rest of a compiled flight: the transmitter's second copy, guard, encoder watch and scores."""

from __future__ import annotations

import math
from typing import Any

from channel.codec.codec import add_correction, is_estimate
from channel.protocol.limits import limited
from plant_sim.encoder import angle_of, counts_of
from tenbaud.studies.flight_data import Errors, Given, Motion, Numbers, Work
from tenbaud.studies.parts import decode, held_of, state_of, tick
from transmitter.encoder_watch import MOTION_RAD
from transmitter.session.state_observer import seen_row


def put(values: Any, target: Any) -> None:
    """Copy an array's values into another: a slice assignment would allocate memory for them first."""
    for index in range(values.shape[0]):
        target[index] = values[index]


def count_at(angle: float, numbers: Numbers) -> int:
    """Return what the encoder reads."""
    return counts_of(angle, numbers.counts_per_turn, numbers.sign, numbers.zero_counts)


def angle_at(counts: int, numbers: Numbers) -> float:
    """Return the angle that counts stand for."""
    return angle_of(counts, numbers.counts_per_turn, numbers.sign, numbers.zero_counts)


def look(
    at: int, angle: float, numbers: Numbers, model_constants: Any, given: Given, work: Work
) -> None:
    """Let the transmitter's observer look at a tick, as `StateObserver.look` does."""
    if not numbers.uses_rates:
        work.seen[0] = angle
        return
    state = state_of(work.seen)
    gains = given.anew
    if at > 0:
        volts = (work.given_out[0], work.given_out[1])
        state = tick(state, volts, held_of(work.nothing), model_constants)
        gains = given.gains
    errors = (angle - state[0],)
    for row in range(len(state)):
        work.seen[row] = seen_row(state, errors, gains, given.largest, row)


def guess(
    sample: int,
    numbers: Numbers,
    model_constants: Any,
    coder_constants: Any,
    given: Given,
    work: Work,
) -> bool:
    """Carry `work.model` and `work.coder` from the confirmed copy to a sample's beginning.

    The words are those sent, the commands those known, a missing one the last
    (`transmitter.session.copies`).
    Return whether the estimate is one.
    """
    size = work.word.shape[0]
    known = given.known[sample * numbers.per_sample]
    commands = known * numbers.per_sample + numbers.lead
    good = True
    for one in range(known, sample):
        word = work.sent[one * size : (one + 1) * size]
        decode(coder_constants, work.coder, work.model, word, False, work.correction, work.spare)
        put(work.spare, work.coder)
        if numbers.impulse:
            add_correction(work.model, work.correction)
        held = held_of(work.nothing) if numbers.impulse else held_of(work.correction)
        state = state_of(work.model)
        first = one * numbers.per_sample
        for at in range(first, first + numbers.per_sample):
            last = min(at, commands - 1)
            front = work.front[last] if last >= 0 else numbers.initial_front
            rear = work.rear[last] if last >= 0 else numbers.initial_rear
            state = tick(state, (front, rear), held, model_constants)
        good = good and is_estimate(state)
        for index in range(len(state)):
            work.model[index] = state[index]
    return good


def act(
    at: int,
    angle: float,
    motion: Motion,
    numbers: Numbers,
    model_constants: Any,
    given: Given,
    work: Work,
) -> tuple[bool, Motion]:
    """Read the encoder and put the tick's command on the motors, as node and guard do.

    Return whether nothing tripped, and what is carried on.
    """
    counts = given.counts[at] if numbers.replay else count_at(angle, numbers)
    still = motion.still + 1 if at > 0 and counts == motion.counts else 0
    window_over = still > 0 and still % numbers.watch == 0
    if window_over:
        start = at - numbers.watch + 1
        model = work.models[given.known[start]]
        if is_stuck(start, at, model, work.applied, model_constants, work.nothing):
            return False, motion
    if numbers.soft_limit < math.inf and abs(angle_at(counts, numbers)) > numbers.soft_limit:
        return False, motion
    front, rear, age, late = motion.front, motion.rear, motion.age, motion.late
    if not given.late[at]:
        work.given_out[0] = work.front[at]
        work.given_out[1] = work.rear[at]
        largest, slew = numbers.command_max, numbers.slew
        front = limited(work.front[at], front, largest[0], slew[0])
        rear = limited(work.rear[at], rear, largest[1], slew[1])
        age = 0
    else:
        age += 1
        late += 1
        if age > numbers.guard_timeout:
            return False, motion
    if given.applied.shape[0] > 0:
        work.applied[at, 0] = given.applied[at, 0]
        work.applied[at, 1] = given.applied[at, 1]
    else:
        work.applied[at, 0] = front
        work.applied[at, 1] = rear
    return True, Motion(front, rear, counts, still, age, late)


def is_stuck(start: int, at: int, model: Any, applied: Any, model_constants: Any, nothing: Any) -> bool:
    """Return whether the encoder watch would take the encoder for stuck at the end of a window.

    `model` is the state confirmed at the window's first tick, `applied` the voltages of each tick.
    """
    held = held_of(nothing)
    state = state_of(model)
    angle = state[0]
    for one in range(start, at + 1):
        state = tick(state, (applied[one - 1, 0], applied[one - 1, 1]), held, model_constants)
    return not -MOTION_RAD < state[0] - angle < MOTION_RAD


def score(
    at: int,
    sample: int,
    angle: float,
    errors: Errors,
    numbers: Numbers,
    given: Given,
    work: Work,
) -> Errors:
    """Add the errors of one tick, in the order in which `transmitter.metrics.scores` adds them."""
    coded_count, coded_squares, coded_max = errors[0], errors[1], errors[2]
    live_count, live_squares, live_max = errors[3], errors[4], errors[5]
    tracking_count, tracking_squares = errors[6], errors[7]
    if given.scored[sample]:
        error = angle - work.coded[at]
        coded_count += 1
        coded_squares += error * error
        coded_max = max(coded_max, abs(error))
        if at >= numbers.lead:
            error = angle - work.live[at]
            live_count += 1
            live_squares += error * error
            live_max = max(live_max, abs(error))
    if given.reference.shape[0] > 0:
        error = given.reference[at] - angle
        tracking_count += 1
        tracking_squares += error * error
    return Errors(
        coded_count,
        coded_squares,
        coded_max,
        live_count,
        live_squares,
        live_max,
        tracking_count,
        tracking_squares,
        max(errors[8], abs(angle)),
    )
