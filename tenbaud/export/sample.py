"""A codec's samples as functions: what `channel.codec.codec.Codec` does with objects.

They are in the language of the coders (`channel.codec.coders.base`) and are translated with them; they
run as Python too.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from channel.codec.codec import add_correction, is_estimate
from channel.codec.lead import fly_ticks
from channel.codec.numerics import cos, exp, sin
from transmitter.session.state_observer import seen_row


class Parts(NamedTuple):
    """Functions, constants and sizes of a codec."""

    tick: Any
    output: Any
    """`output_function` of the model; None: each output is a state"""
    encode: Any
    decode: Any
    model: Any
    """constants of tick and output"""
    coder: Any
    output_states: Any
    impulse: bool
    uses_rates: bool
    states: int
    corrected: int
    ticks_per_sample: int
    lead_ticks: int
    gains: Any = ()
    """of the transmitter's observer, as `StateObserver` has them"""
    anew: Any = ()
    largest: Any = ()


def output_of(parts: Parts, model: Any, place: int) -> Any:
    """Return the prediction of an output."""
    if parts.output is None:
        return model[parts.output_states[place]]
    return parts.output(model, parts.model, place)


def encode_word(parts: Parts, model: Any, coder: Any, measurement: Any, symbols: Any) -> None:
    """Write the word for a measurement (`Codec.encode`)."""
    predicted = [0.0] * len(measurement)
    for place in range(len(measurement)):
        if parts.uses_rates:
            predicted[place] = model[place]
        else:
            predicted[place] = output_of(parts, model, place)
    parts.encode(parts.coder, coder, predicted, measurement, symbols)


def known_step(flight: Any, carried: bool, at: int, within: bool, ahead: bool, model: Any) -> Any:
    """Return the command of a tick."""
    _, commands, _, _ = flight
    return carried, commands[at]


def live_step(flight: Any, carried: bool, at: int, within: bool, ahead: bool, model: Any) -> Any:
    """Return the command of a tick; keep the state that it was to be decided from."""
    parts, commands, _, live = flight
    if ahead:
        for index in range(len(model)):
            live[at - parts.lead_ticks][index] = model[index]
    return carried, commands[at]


def keep(flight: Any, carried: bool, model: Any) -> bool:
    """Keep the state after the sample; return whether it is an estimate (`Codec.close`)."""
    _, _, after, _ = flight
    for index in range(len(model)):
        after[index] = model[index]
    return is_estimate(model)


def move(flight: Any, carried: bool, at: int, within: bool, model: Any, command: Any, held: Any) -> Any:
    """Advance the model by a tick."""
    parts, _, _, _ = flight
    return carried, parts.tick(model, command, held, parts.model)


def fly_word(
    parts: Parts,
    step: Any,
    lead: int,
    model: Any,
    coder: Any,
    symbols: Any,
    erased: bool,
    commands: Any,
    model_after: Any,
    coder_after: Any,
    live: Any,
) -> Any:
    """Run one whole sample (`fly_sample`); return whether the state after it is an estimate."""
    correction = [0.0] * parts.corrected
    nothing = [0.0] * parts.corrected
    opened = [0.0] * parts.states
    for index in range(parts.states):
        opened[index] = model[index]
    parts.decode(parts.coder, coder, model, symbols, erased, correction, coder_after)
    flight = (parts, commands, model_after, live)
    count = parts.ticks_per_sample
    if parts.impulse:
        add_correction(opened, correction)
        return fly_ticks(step, keep, move, flight, True, opened, nothing, nothing, 0, count, lead)
    return fly_ticks(step, keep, move, flight, True, opened, correction, nothing, 0, count, lead)


def look(
    parts: Parts, state: Any, is_expected: bool, measurement: Any, command: Any, after: Any
) -> None:
    """Write all states as the transmitter's observer sees them (`StateObserver.look`)."""
    nothing = [0.0] * parts.corrected
    errors = [0.0] * len(measurement)
    if is_expected:
        moved = parts.tick(state, command, nothing, parts.model)
        for place in range(len(measurement)):
            errors[place] = measurement[place] - output_of(parts, moved, place)
        for row in range(parts.states):
            after[row] = seen_row(moved, errors, parts.gains, parts.largest, row)
    else:
        for place in range(len(measurement)):
            errors[place] = measurement[place] - output_of(parts, state, place)
        for row in range(parts.states):
            after[row] = seen_row(state, errors, parts.anew, parts.largest, row)


def simulate(parts: Parts, state: Any, command: Any, push: Any, after: Any, outputs: Any) -> None:
    """Write state and outputs of the model as a plant one tick later; `push` is added to the rates."""
    moved = parts.tick(state, command, push, parts.model)
    for index in range(parts.states):
        after[index] = moved[index]
    for place in range(len(outputs)):
        outputs[place] = output_of(parts, moved, place)


def numbers_of(x: float, results: Any) -> None:
    """Write sine, cosine and exponential."""
    results[0] = sin(x)
    results[1] = cos(x)
    results[2] = exp(x)
