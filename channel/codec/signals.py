"""The signals of a plant: names, units, ranges and groups of its states, inputs and outputs.

A model defines them once, and all code that shows, limits, records or controls a plant reads them here:
their number, names and units. No other part of the project depends on the kind of plant.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, cast

NAME = re.compile(r"[a-z][a-z0-9_]*")
NEAR = 1e-9
"""Difference up to which an output is the sum of states that it seems to be."""
STEPS_MAX = 32_767
"""Largest number of steps, either way, that a frame carries for an input."""


PICTURES: tuple[tuple[str, tuple[int, ...]], ...] = (
    ("helicopter", (1, 3)),
    ("pendulum", (1,)),
    ("rotary pendulum", (2,)),
    ("dial", (1,)),
)
"""Pictures of plants, and for how many outputs; all are angles. The parts turn in the order of the
outputs: the helicopter's by pitch, or by travel, elevation and pitch; a rotary pendulum's by arm and
pendulum."""


@dataclass(frozen=True, slots=True)
class Signal:
    """One state or output.

    ValueError for a name that is no lower-case identifier, or an empty range.
    """

    name: str
    """lower-case letters, digits and underscores; with the unit's suffix it names columns"""
    unit: str = ""
    """as a person writes it: "rad", "rad/s", "V", "N m"; empty: no dimension"""
    low: float = -float("inf")
    """smallest value that makes sense, for displays and checks"""
    high: float = float("inf")
    """largest value that makes sense"""
    group: str = ""
    """signals of one group share a panel; empty: those of one unit do"""

    def __post_init__(self) -> None:
        if not NAME.fullmatch(self.name):
            raise ValueError(
                f"{self.name!r} is no name of a signal: use lower-case letters, digits and "
                "underscores, a letter first"
            )
        if not self.low < self.high:
            raise ValueError(f"signal {self.name}: its range is {self.low:g} to {self.high:g}")

    @property
    def column(self) -> str:
        """The name with its unit, for files that have no other place for it: `pitch_rad`."""
        suffix = unit_suffix(self.unit)
        return f"{self.name}_{suffix}" if suffix else self.name

    @property
    def label(self) -> str:
        """The name with its unit, for a person: `pitch, rad`."""
        return f"{self.words}, {self.unit}" if self.unit else self.words

    @property
    def words(self) -> str:
        """The name alone, for a person."""
        return self.name.replace("_", " ")


@dataclass(frozen=True, slots=True)
class InputSignal(Signal):
    """One input of the plant: a command has one value for it."""

    steps_per_unit: float = 1000.0
    """A command travels as a whole number of steps, at most `STEPS_MAX` either way: 1000 are mV."""

    def __post_init__(self) -> None:
        # Not super(): a dataclass with slots is a class made anew.
        Signal.__post_init__(self)
        if not 0.0 < self.steps_per_unit < float("inf"):
            raise ValueError(f"input {self.name}: steps_per_unit is {self.steps_per_unit:g}")

    @property
    def largest(self) -> float:
        """The largest value that a frame carries, either way."""
        return STEPS_MAX / self.steps_per_unit


_SUFFIXES = {"V": "volts", "A": "amperes", "%": "percent", "°": "deg"}


def unit_suffix(unit: str) -> str:
    """Return a unit as the end of a column's name: `rad_per_s` for rad/s, `volts` for V."""
    words = []
    for part in unit.replace("²", "2").replace("^", "").split("/"):
        factors = [_SUFFIXES.get(factor, factor) for factor in re.split(r"[ ·*]+", part) if factor]
        words.append("_".join(factors))
    return "_per_".join(words)


@dataclass(frozen=True, slots=True)
class Signals:
    """All signals of a plant, in the order in which vectors hold them."""

    states: tuple[Signal, ...]
    inputs: tuple[InputSignal, ...]
    outputs: tuple[Signal, ...]
    """measured, and controlled to a set-point"""
    output_states: tuple[int | None, ...] = field(default=())
    """for each output the state that it is, None for another function of the states"""
    picture: str = ""
    """picture of the plant, one of `PICTURES`; empty: each output is shown as a bar"""
    output_rows: tuple[tuple[float, ...], ...] = ()
    """for each output that is a sum of states their coefficients, for another one nothing; without
    any such output empty"""
    steps_per_unit: tuple[float, ...] = field(init=False)
    """of each input"""

    def __post_init__(self) -> None:
        for what in ("states", "inputs", "outputs"):
            names = [one.name for one in getattr(self, what)]
            doubled = sorted({name for name in names if names.count(name) > 1})
            if doubled:
                raise ValueError(f"{what}: {', '.join(doubled)} is named twice")
        if self.picture and len(self.outputs) not in dict(PICTURES).get(self.picture, ()):
            pictures = ", ".join([f"{one} (outputs: {counts})" for one, counts in PICTURES])
            raise ValueError(
                f"picture {self.picture!r} is unknown or not for {len(self.outputs)} output(s); known "
                f"are {pictures}"
            )
        steps = tuple([one.steps_per_unit for one in self.inputs])
        object.__setattr__(self, "steps_per_unit", steps)
        if not self.output_states:
            states = [one.name for one in self.states]
            found = [states.index(one.name) if one.name in states else None for one in self.outputs]
            object.__setattr__(self, "output_states", tuple(found))
        if len(self.output_states) != len(self.outputs):
            raise ValueError(
                f"{len(self.output_states)} output_states are given for {len(self.outputs)} outputs"
            )
        known = range(len(self.states))
        if wrong := [one for one in self.output_states if one is not None and one not in known]:
            raise ValueError(f"output_states: there is no state {wrong[0]}")
        sizes = {len(row) for row in self.output_rows} - {0, len(self.states)}
        if sizes or len(self.output_rows) not in (0, len(self.outputs)):
            raise ValueError("output_rows have a coefficient per state, and a row per output")

    def row(self, place: int) -> tuple[float, ...]:
        """Return the coefficients of the states that make an output; () where it is no sum of them."""
        state = self.output_states[place]
        if state is None:
            return self.output_rows[place] if self.output_rows else ()
        return unit_row(state, len(self.states))

    def index(self, what: str, name: str) -> int:
        """Return the place of a signal among the `states`, `inputs` or `outputs`.

        ValueError with the names there are.
        """
        names = [one.name for one in getattr(self, what)]
        if name not in names:
            raise ValueError(f"{name!r} is none of the {what}: {', '.join(names)}")
        return names.index(name)

    def groups(self, what: str) -> list[tuple[str, list[int]]]:
        """Return which of the `inputs` or `outputs` share a panel: its label, and their places."""
        signals: tuple[Signal, ...] = getattr(self, what)
        keys = [(one.group, "" if one.group else one.unit) for one in signals]
        return [
            (_group_label(key[0], [signals[place] for place in places]), places)
            for first, key in enumerate(keys)
            if key not in keys[:first]
            for places in [[place for place, other in enumerate(keys) if other == key]]
        ]


def _group_label(group: str, signals: Sequence[Signal]) -> str:
    """Return what stands beside a panel: `motors, V`, or `arm, pendulum, rad`."""
    if any(one.unit != signals[0].unit for one in signals):
        return "; ".join(one.label for one in signals)
    names = group or ", ".join(one.words for one in signals)
    return f"{names}, {signals[0].unit}" if signals[0].unit else names


def named(what: str, count: int) -> tuple[Signal, ...]:
    """Return `count` signals without unit or range, called `what_1`, `what_2`, ..."""
    return tuple(Signal(f"{what}_{number}") for number in range(1, count + 1))


def unit_row(state: int, count: int) -> tuple[float, ...]:
    """Return the coefficients that make one of `count` states."""
    return tuple([1.0 if place == state else 0.0 for place in range(count)])


class Sized(Protocol):
    """The sizes of a prediction model (`channel.codec.codec.Model`)."""

    state_size: int
    input_size: int

    def initial(self) -> tuple[float, ...]:
        """Return the common first state."""

    def measured(self, state: tuple[float, ...]) -> tuple[float, ...]:
        """Return the predicted outputs."""


def signals_of(model: Sized) -> Signals:
    """Return the signals of a model; numbered ones for a model that names none.

    ValueError where their numbers are not those of the model's states, inputs and outputs.
    """
    outputs = len(model.measured(model.initial()))
    found = getattr(model, "signals", None)
    if found is None:
        inputs = tuple(InputSignal(one.name) for one in named("input", model.input_size))
        states = named("state", model.state_size)
        read = _states_read(model, outputs)
        found = Signals(states, inputs, named("output", outputs), read)
    signals = cast(Signals, found)
    _require("states", model.state_size, signals.states)
    _require("inputs", model.input_size, signals.inputs)
    _require("outputs", outputs, signals.outputs)
    if None not in signals.output_states or signals.output_rows:
        return signals
    return replace(signals, output_rows=_sums_read(model, outputs))


def _sums_read(model: Sized, outputs: int) -> tuple[tuple[float, ...], ...]:
    """Return the coefficients of outputs that are sums of states, () for each other one."""
    count = model.state_size
    single = [unit_row(at, count) for at in range(count)]
    probe = tuple(0.125 * (place + 1) for place in range(count))
    try:
        columns = [model.measured(state) for state in single]
        read = model.measured(probe)
    except (ArithmeticError, ValueError):
        return ()
    found = []
    for row, value in zip(zip(*columns, strict=True), read, strict=True):
        for share, state in zip(row, probe, strict=True):
            value -= share * state
        found.append(row if -NEAR < value < NEAR else ())
    return tuple(found)


def _states_read(model: Sized, outputs: int) -> tuple[int | None, ...]:
    """Return which state each output is: what the model reads from two states, all values unlike."""
    count = model.state_size
    rising = tuple(0.125 * (place + 1) for place in range(count))
    probes = (rising, tuple(-0.5 * value for value in reversed(rising)))
    try:
        read = [model.measured(state) for state in probes]
    except (ArithmeticError, ValueError):
        return (None,) * outputs
    pairs = list(zip(*probes, strict=True))
    return tuple(pairs.index(pair) if pair in pairs else None for pair in zip(*read, strict=True))


def _require(what: str, size: int, given: Sequence[Signal]) -> None:
    if len(given) != size:
        raise ValueError(f"the model has {size} {what}, and {len(given)} are named")
