"""Several flights of one configuration side by side, to be compiled.

The same course as `kernel.fly`, on a line without faults, where nothing but the plant's torque differs
from lane to lane. What happens once a sample is done lane by lane; what happens at every tick is done
for all lanes at once (`lane_ticks`). A lane that leaves the ordinary course is flown on, to no purpose,
and marked. Tests compare lanes with single flights, bit by bit.
"""

from __future__ import annotations

import math
from typing import Any

from channel.codec import add_correction, is_estimate
from tenbaud.studies.flight_data import Given, Numbers
from tenbaud.studies.lane_data import LaneWork, bare_lanes
from tenbaud.studies.lane_ticks import add_error, add_tracking, decide, drive, observe, push, watch
from tenbaud.studies.parts import decode, encode
from tenbaud.studies.sensor_side import angle_at, count_at, is_stuck
from tenbaud.studies.uncounted import bare_given


def fly_lanes(numbers: Numbers, constants: Any, given: Given, work: LaneWork) -> bool:
    """Fly; return whether the commands came in time. Everything else is in `work`."""
    model_constants, coder_constants, plant_constants, pid_constants = constants
    given = bare_given(given)
    work = bare_lanes(work)
    age = 0
    for sample in range(given.scored.shape[0]):
        first = sample * numbers.per_sample
        _guess(sample, numbers, model_constants, coder_constants, given, work)
        _send(sample, numbers, coder_constants, work)
        take(sample, work.coders[sample], work.coders[sample + 1], work.models[sample], numbers,
             coder_constants, work)
        _answer(sample, numbers, model_constants, pid_constants, given, work)
        for at in range(first, min(first + numbers.per_sample, numbers.ticks)):
            longest = watch(work.plant[0], work.counts, work.still, at == 0, numbers)
            if longest >= numbers.watch:
                _watch_closely(at, numbers, model_constants, given, work)
            if given.late[at]:
                age += 1
                if age > numbers.guard_timeout:
                    return False
                work.applied[at + 1] = work.applied[at]
            else:
                age = 0
                drive(work.commanded[at + 1], work.applied[at], work.applied[at + 1], numbers)
            if at >= numbers.window_start:
                _score(at, sample, numbers, given, work)
            torque = work.torque[at if work.torque.shape[0] > 1 else 0]
            push(work.plant, work.applied[at + 1], torque, plant_constants)
    return True


def _guess(
    sample: int,
    numbers: Numbers,
    model_constants: Any,
    coder_constants: Any,
    given: Given,
    work: LaneWork,
) -> None:
    """Carry the confirmed copy of every lane to a sample's beginning; see `sensor_side.guess`."""
    known = given.known[sample * numbers.per_sample]
    commands = known * numbers.per_sample + numbers.lead
    work.model[:] = work.models[known]
    work.coder[:] = work.coders[known]
    for one in range(known, sample):
        take(one, work.coder, work.spare, work.model, numbers, coder_constants, work)
        work.coder[:] = work.spare
        first = one * numbers.per_sample
        for at in range(first, first + numbers.per_sample):
            last = min(at, commands - 1)
            observe(work.state, work.commanded[last + 1], work.held, model_constants)
        _close(work.model, work)


def _send(sample: int, numbers: Numbers, coder_constants: Any, work: LaneWork) -> None:
    """Form the word of a sample for every lane."""
    for lane in range(work.well.shape[0]):
        if not math.isfinite(work.plant[0, lane]):
            work.well[lane] = False
            continue
        angle = angle_at(count_at(work.plant[0, lane], numbers), numbers)
        encode(
            coder_constants, work.coder[lane], work.model[lane], (angle,), work.sent[sample, lane]
        )


def take(
    sample: int,
    coders: Any,
    after: Any,
    models: Any,
    numbers: Numbers,
    coder_constants: Any,
    work: LaneWork,
) -> None:
    """Consume a sample's word for every lane: coder states `after`, and the model ready for its ticks."""
    for lane in range(models.shape[0]):
        word = work.sent[sample, lane]
        decode(
            coder_constants, coders[lane], models[lane], word, False, work.correction, after[lane]
        )
        work.state[:, lane] = models[lane]
        if numbers.impulse:
            add_correction(work.state[:, lane], work.correction)
        else:
            work.held[:, lane] = work.correction


def _answer(
    sample: int,
    numbers: Numbers,
    model_constants: Any,
    pid_constants: Any,
    given: Given,
    work: LaneWork,
) -> None:
    """Fly the opened sample and decide its commands; see `kernel._answer`."""
    first = sample * numbers.per_sample
    after = first + numbers.per_sample
    state = work.state
    for at in range(first, after + numbers.lead):
        if at == after:
            _close(work.models[sample + 1], work)
        if at < after:
            work.coded[at] = state[0]
        if at >= first + numbers.lead:
            work.live[at] = state[0]
            decide(
                given.reference[at],
                state[0],
                state[1],
                work.integral,
                work.commanded[at],
                work.commanded[at + 1],
                numbers,
                pid_constants,
            )
        held = work.held if at < after else work.nothing
        observe(state, work.commanded[at + 1], held, model_constants)
    if numbers.lead == 0:
        _close(work.models[sample + 1], work)


def _close(models: Any, work: LaneWork) -> None:
    """Keep the state of every lane after a sample, and mark those that are no estimate."""
    for lane in range(models.shape[0]):
        models[lane] = work.state[:, lane]
        if not (is_estimate(models[lane]) and math.isfinite(work.integral[lane])):
            work.well[lane] = False


def _watch_closely(
    at: int, numbers: Numbers, model_constants: Any, given: Given, work: LaneWork
) -> None:
    """Mark the lanes whose encoder would be taken for stuck; see `sensor_side.act`."""
    start = at - numbers.watch + 1
    for lane in range(work.well.shape[0]):
        still = work.still[lane]
        if still == 0 or still % numbers.watch != 0:
            continue
        model = work.models[given.known[start], lane]
        applied = work.applied[1:, :, lane]
        if is_stuck(start, at, model, applied, model_constants, work.nothing[:, 0]):
            work.well[lane] = False


def _score(at: int, sample: int, numbers: Numbers, given: Given, work: LaneWork) -> None:
    """Add the errors of one tick; see `sensor_side.score`."""
    angle, squares, largest = work.plant[0], work.squares, work.largest
    if given.scored[sample]:
        add_error(angle, work.coded[at], squares[0], largest[0])
        if at >= numbers.lead:
            add_error(angle, work.live[at], squares[1], largest[1])
    add_tracking(angle, given.reference[at], squares[2], largest[2])
