"""A whole flight as one function, to be compiled.

What the two sessions, the guard and the rig do one message at a time is done here sample by sample, in
the order of cause and effect: the transmitter's word, what the receiver made of it, its commands, the
plant under them. All arithmetic is that of the nodes, imported, and so is the order of a sample's ticks
(`fly_ticks`); tests compare with ordinary flights, bit by bit. A flight that leaves the ordinary
course, by a guard that steps in or an estimate that diverges, is not followed: it comes back as False,
and the caller flies it with the nodes themselves.

The functions that depend on the kinds of model, coder, plant and controller are placeholders here, and
so are the numbers of inputs and outputs (`parts`); all are given when the flight is compiled.
"""

from __future__ import annotations

from typing import Any

from channel.codec.codec import add_correction, is_estimate
from channel.codec.lead import fly_ticks
from channel.protocol.limits import as_carried, limited
from tenbaud.studies.flight_data import Given, Numbers, Work
from tenbaud.studies.parts import (
    INPUTS,
    OUTPUTS,
    command_of,
    decode,
    encode,
    held_of,
    law,
    output_of,
    plant_of,
    plant_step,
    push_of,
    sine,
    state_of,
    tick,
)
from tenbaud.studies.sensor_side import act, guess, look, put, read, score

Carried = tuple[bool, tuple[float, ...]]
"""Whether all is well, and the plant's state."""


def fly(numbers: Numbers, constants: Any, given: Given, work: Work) -> bool:
    """Fly; return whether the flight kept its ordinary course.

    `constants` are those of (model, coder, plant, law).
    """
    for at in range(numbers.lead):
        put(given.initial, work.commands[at])
    put(work.models[0], work.seen)
    put(given.initial, work.known_command)
    put(given.safe, work.held)
    work.memory[:] = 0.0
    work.still[:] = 0
    work.squares[:] = 0.0
    work.largest[:] = 0.0
    work.counted[:] = 0
    carried = (True, plant_of(given.start))
    for sample in range(given.scored.shape[0]):
        well = _measure(sample, carried[1], numbers, constants, given, work)
        erased = _receive(sample, given, work)
        held = _open(sample, erased, numbers, constants[1], work)
        carried = fly_ticks(
            _step,
            _close,
            _tick,
            (sample, numbers, constants, given, work),
            (well, carried[1]),
            state_of(work.model),
            held,
            held_of(work.nothing),
            sample * numbers.per_sample,
            numbers.per_sample,
            numbers.lead,
        )
        if not carried[0]:
            return False
    return True


def _step(flight: Any, carried: Carried, at: int, within: bool, ahead: bool, state: Any) -> Any:
    """Keep the outputs of a tick, and decide its command where that is not known."""
    _, _, constants, given, work = flight
    well, plant = carried
    if within:
        for place in range(OUTPUTS):
            work.coded[at, place] = output_of(state, constants[0], place)
    if ahead:
        for place in range(OUTPUTS):
            work.live[at, place] = output_of(state, constants[0], place)
        well = _decide(at, state, constants[3], given, work) and well
    return (well, plant), command_of(work.commands[at])


def _close(flight: Any, carried: Carried, state: Any) -> Carried:
    """Keep the state after a sample; what is carried says whether it is an estimate (`Codec.close`)."""
    row = flight[4].models[flight[0] + 1]
    for index in range(len(state)):
        row[index] = state[index]
    return (carried[0] and is_estimate(state), carried[1])


def _tick(
    flight: Any, carried: Carried, at: int, within: bool, state: Any, command: Any, held: Any
) -> Any:
    """Advance the model, and the plant beside it.

    Neither waits for the other within a tick, so that the processor works on both at once.
    """
    sample, numbers, constants, given, work = flight
    well, plant = carried
    state = tick(state, command, held, constants[0])
    if within and at < numbers.ticks:
        if at > sample * numbers.per_sample:
            read(at, plant, numbers, constants[2], given, work)
            if numbers.uses_rates:
                look(at, constants[0], given, work)
        well = act(at, numbers, constants[0], given, work) and well
        if at >= numbers.window_start:
            score(at, sample, numbers, given, work)
        if not numbers.replay:
            push = push_of(given.pushes[at if given.pushes.shape[0] > 1 else 0])
            plant = plant_step(plant, command_of(work.held), push, constants[2], sine)
    return (well, plant), state


def _measure(
    sample: int, plant: Any, numbers: Numbers, constants: Any, given: Given, work: Work
) -> bool:
    """Measure at a sample's beginning and send its word; return whether the estimate is one."""
    first = sample * numbers.per_sample
    known = given.known[first]
    put(work.models[known], work.model)
    put(work.coders[known], work.coder)
    well = True
    if known < sample:
        well = guess(sample, numbers, constants[0], constants[1], given, work)
    read(first, plant, numbers, constants[2], given, work)
    if numbers.uses_rates:
        look(first, constants[0], given, work)
        put(work.model, work.predicted)
    else:
        put(work.measured, work.seen)
        state = state_of(work.model)
        for place in range(OUTPUTS):
            work.predicted[place] = output_of(state, constants[0], place)
    size = work.word.shape[0]
    word = work.sent[sample * size : (sample + 1) * size]
    encode(constants[1], work.coder, work.predicted, work.seen, word)
    return well


def _receive(sample: int, given: Given, work: Work) -> bool:
    """Set `work.word` to the line's output; return whether it is erased."""
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


def _open(sample: int, erased: bool, numbers: Numbers, coder_constants: Any, work: Work) -> Any:
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


def _decide(at: int, state: Any, law_constants: Any, given: Given, work: Work) -> bool:
    """Decide the command of a tick as the receiver's session does; return whether all is well."""
    if not law(at, state, law_constants, given, work):
        return False
    for index in range(INPUTS):
        before = work.commands[at - 1, index] if at > 0 else given.initial[index]
        most, slew = given.command_max[index], given.slew[index]
        value = limited(work.wanted[index], before, most, slew)
        work.commands[at, index] = as_carried(value, given.steps_per_unit[index])
    return True
