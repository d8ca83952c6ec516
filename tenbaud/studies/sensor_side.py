"""The rest of a compiled flight: the transmitter's second copy, rig, guard, watch and scores."""

from __future__ import annotations

import math
from typing import Any

from channel.codec.codec import add_correction, is_estimate
from channel.protocol.limits import limited
from plant_sim.encoder import EXACT_PER_UNIT, angle_of, counts_of
from tenbaud.studies.flight_data import Given, Numbers, Work
from tenbaud.studies.parts import (
    INPUTS,
    OUTPUTS,
    command_of,
    decode,
    held_of,
    output_of,
    plant_output,
    state_of,
    tick,
)
from transmitter.session.state_observer import seen_row


def put(values: Any, target: Any) -> None:
    """Copy an array's values into another: a slice assignment would allocate memory for them first."""
    for index in range(values.shape[0]):
        target[index] = values[index]


def read(at: int, plant: Any, numbers: Numbers, plant_constants: Any, given: Given, work: Work) -> None:
    """Read every output at a tick, as the rig does."""
    for place in range(OUTPUTS):
        per_turn, sign = given.counts_per_turn[place], given.sign[place]
        zero, turn = given.zero_counts[place], given.turn[place]
        if numbers.replay:
            counts = 0
            value = given.recorded[at, place]
            shown = value
        else:
            value = plant_output(plant, plant_constants, place)
            if per_turn == 0.0:
                counts = math.floor(value * EXACT_PER_UNIT)
                shown = value
            else:
                counts = counts_of(value, per_turn, sign, zero, turn)
                shown = angle_of(counts, per_turn, sign, zero, turn)
        work.reading[place] = counts
        work.true[place] = value
        work.measured[place] = shown


def look(at: int, model_constants: Any, given: Given, work: Work) -> None:
    """Let the transmitter's observer look at a tick, as `StateObserver.look` does."""
    state = state_of(work.seen)
    gains = given.anew
    if at > 0:
        state = tick(state, command_of(work.known_command), held_of(work.nothing), model_constants)
        gains = given.gains
    for place in range(OUTPUTS):
        work.innovation[place] = work.measured[place] - output_of(state, model_constants, place)
    for row in range(len(state)):
        work.seen[row] = seen_row(state, work.innovation, gains, given.largest, row)


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
    # A variable, as elsewhere: for the constant, `decode` would be compiled once more.
    erased = sample < known
    for one in range(known, sample):
        word = work.sent[one * size : (one + 1) * size]
        decode(coder_constants, work.coder, work.model, word, erased, work.correction, work.spare)
        put(work.spare, work.coder)
        if numbers.impulse:
            add_correction(work.model, work.correction)
        held = held_of(work.nothing) if numbers.impulse else held_of(work.correction)
        state = state_of(work.model)
        first = one * numbers.per_sample
        for at in range(first, first + numbers.per_sample):
            last = min(at, commands - 1)
            command = command_of(work.commands[last] if last >= 0 else given.initial)
            state = tick(state, command, held, model_constants)
        good = good and is_estimate(state)
        for index in range(len(state)):
            work.model[index] = state[index]
    return good


def act(at: int, numbers: Numbers, model_constants: Any, given: Given, work: Work) -> bool:
    """Apply the tick's command, as node and guard do; return whether nothing tripped."""
    if is_stuck(at, numbers, model_constants, given, work):
        return False
    well = True
    for place in range(OUTPUTS):
        well = well and not abs(work.measured[place]) > given.soft_limits[place]
    for index in range(INPUTS):
        if not given.late[at]:
            command = work.commands[at, index]
            most, slew = given.command_max[index], given.slew[index]
            work.held[index] = limited(command, work.held[index], most, slew)
            work.known_command[index] = command
        known = given.applied.shape[0] > 0
        work.applied[at, index] = given.applied[at, index] if known else work.held[index]
    return well


def is_stuck(at: int, numbers: Numbers, model_constants: Any, given: Given, work: Work) -> bool:
    """Return whether an encoder is taken for stuck at a tick, as `EncoderWatch.check` does."""
    still = False
    for place in range(OUTPUTS):
        same = at > 0 and work.reading[place] == work.read_before[place]
        work.still[place] = work.still[place] + 1 if same else 0
        work.read_before[place] = work.reading[place]
        still = still or same
    age = work.still[OUTPUTS]
    if not still or (age == 0 and given.known[at] == 0):
        work.still[OUTPUTS] = 0
        return False
    age += 1
    work.still[OUTPUTS] = age if age < numbers.watch else 0
    return age >= numbers.watch and _moved(at, numbers, model_constants, given, work)


def _moved(at: int, numbers: Numbers, model_constants: Any, given: Given, work: Work) -> bool:
    """Return whether an output should have moved in a window in which its encoder stood."""
    start = at - numbers.watch + 1
    before = state_of(work.models[given.known[start]])
    held = held_of(work.nothing)
    state = before
    for one in range(start, at + 1):
        state = tick(state, command_of(work.applied[one - 1]), held, model_constants)
    for place in range(OUTPUTS):
        moved = output_of(state, model_constants, place) - output_of(before, model_constants, place)
        motion = given.motions[place]
        if work.still[place] >= numbers.watch and not -motion < moved < motion:
            return True
    return False


def score(at: int, sample: int, numbers: Numbers, given: Given, work: Work) -> None:
    """Add the errors of one tick, in the order in which `transmitter.metrics.scores` adds them."""
    scored = given.scored[sample]
    work.counted[0] += scored
    work.counted[1] += scored and at >= numbers.lead
    for place in range(OUTPUTS):
        value = work.true[place]
        if scored:
            error = value - work.coded[at, place]
            work.squares[place, 0] += error * error
            work.largest[place, 0] = max(work.largest[place, 0], abs(error))
            if at >= numbers.lead:
                error = value - work.live[at, place]
                work.squares[place, 1] += error * error
                work.largest[place, 1] = max(work.largest[place, 1], abs(error))
        if given.follows[place]:
            error = given.targets[at, place] - value
            work.squares[place, 2] += error * error
        work.largest[place, 2] = max(work.largest[place, 2], abs(value))
