"""Several flights of one configuration side by side, to be compiled.

The same course as `kernel.fly`, on a line without faults, where only the torque on the plant differs
from lane to lane. What happens once a sample is done lane by lane (`lane_samples`), what happens at
every tick for several lanes at once (`lane_ticks`). A lane that leaves the ordinary course is flown on,
to no purpose, and marked. Tests compare lanes with single flights, bit by bit.
"""

from __future__ import annotations

from typing import Any

from tenbaud.studies.flight_data import Given, Numbers
from tenbaud.studies.lane_data import LaneWork
from tenbaud.studies.lane_samples import close, copy, send, take, watch_closely
from tenbaud.studies.lane_ticks import (
    add_error,
    add_tracking,
    decide,
    drive,
    keep,
    observe,
    push,
    watch,
)


def fly_lanes(numbers: Numbers, constants: Any, given: Given, work: LaneWork) -> bool:
    """Fly; return whether the commands came in time. Everything else is in `work`."""
    model_constants, coder_constants, plant_constants, pid_constants = constants
    age = 0
    for sample in range(given.scored.shape[0]):
        _guess(sample, numbers, model_constants, coder_constants, given, work)
        words = work.sent[sample]
        send(work.plant, work.coder, work.model, words, work.well, numbers, coder_constants)
        take(
            words,
            work.coders[sample],
            work.coders[sample + 1],
            work.models[sample],
            work.state,
            work.held,
            work.correction,
            numbers,
            coder_constants,
        )
        _answer(sample, numbers, model_constants, pid_constants, given, work)
        first = sample * numbers.per_sample
        for at in range(first, min(first + numbers.per_sample, numbers.ticks)):
            age = age + 1 if given.late[at] else 0
            if age > numbers.guard_timeout:
                return False
            _act(at, numbers, model_constants, given, work)
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
    copy(work.models[known], work.model)
    copy(work.coders[known], work.coder)
    for one in range(known, sample):
        take(
            work.sent[one],
            work.coder,
            work.spare,
            work.model,
            work.state,
            work.held,
            work.correction,
            numbers,
            coder_constants,
        )
        copy(work.spare, work.coder)
        first = one * numbers.per_sample
        for at in range(first, first + numbers.per_sample):
            last = min(at, commands - 1)
            observe(work.state, work.commanded[last + 1], work.held, model_constants)
        close(work.state, work.integral, work.model, work.well)


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
            close(state, work.integral, work.models[sample + 1], work.well)
        if at < after:
            keep(state[0], work.coded[at])
        if at >= first + numbers.lead:
            keep(state[0], work.live[at])
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
        close(state, work.integral, work.models[sample + 1], work.well)


def _act(at: int, numbers: Numbers, model_constants: Any, given: Given, work: LaneWork) -> None:
    """Read the encoder and put the tick's command on the motors; see `sensor_side.act`."""
    longest = watch(work.plant[0], work.counts, work.still, at == 0, numbers)
    if longest >= numbers.watch:
        start = at - numbers.watch + 1
        watch_closely(
            start,
            at,
            work.still,
            work.models[given.known[start]],
            work.applied,
            work.nothing,
            work.well,
            numbers,
            model_constants,
        )
    if given.late[at]:
        copy(work.applied[at], work.applied[at + 1])
    else:
        drive(work.commanded[at + 1], work.applied[at], work.applied[at + 1], numbers)


def _score(at: int, sample: int, numbers: Numbers, given: Given, work: LaneWork) -> None:
    """Add the errors of one tick; see `sensor_side.score`."""
    angle, squares, largest = work.plant[0], work.squares, work.largest
    if given.scored[sample]:
        add_error(angle, work.coded[at], squares[0], largest[0])
        if at >= numbers.lead:
            add_error(angle, work.live[at], squares[1], largest[1])
    add_tracking(angle, given.reference[at], squares[2], largest[2])
