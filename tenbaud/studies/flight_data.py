"""The inputs and outputs of a compiled flight: flat numbers and arrays."""

from __future__ import annotations

from typing import Any, NamedTuple


class Numbers(NamedTuple):
    """The inputs of a flight, beside the constants of model, coder, plant and law."""

    ticks: int
    per_sample: int
    """N"""
    lead: int
    """D"""
    window_start: int
    impulse: bool
    replay: bool
    """the rig is a recording: outputs, commands and applied inputs are given"""
    uses_rates: bool
    """words are formed from all corrected states, which the transmitter observes"""
    watch: int
    """ticks of the window in which the encoders are watched; beyond any flight: they are not"""


class Given(NamedTuple):
    """Arrays that a flight reads; the last index is that of an input or an output."""

    start: Any
    """state of the plant"""
    alphabet: Any
    """symbols in the order of their numbers"""
    shifts: Any
    """per slot: what is added to the symbol's number on the way; -1: the slot is erased"""
    known: Any
    """per tick: samples whose echo has come before its measurement"""
    late: Any
    """per tick: whether its command has not come by then"""
    scored: Any
    """per sample: whether its echo came before the flight was over"""
    pushes: Any
    """per tick: the plant's disturbance; one row for all ticks without any"""
    targets: Any
    """per tick, `D` ticks beyond the flight included: set-points, 0 where there is none"""
    follows: Any
    """per output: whether it has a set-point"""
    command_max: Any
    slew: Any
    """per tick"""
    steps_per_unit: Any
    initial: Any
    """command of the first ticks"""
    safe: Any
    """command of the guard before the first one"""
    soft_limits: Any
    """per output; infinite for none"""
    motions: Any
    """per output: motion that a standing encoder contradicts"""
    counts_per_turn: Any
    """per output; 0: it is read exactly"""
    sign: Any
    zero_counts: Any
    turn: Any
    recorded: Any
    """replay: outputs per tick"""
    commands: Any
    """replay: per tick, `D` ticks beyond the flight included"""
    applied: Any
    """replay: inputs per tick; empty when they were not recorded"""
    gains: Any
    anew: Any
    largest: Any
    """of the transmitter's observer (`transmitter.session.state_observer`); a row per state"""


class Work(NamedTuple):
    """Arrays that a flight writes."""

    models: Any
    """codec's model state before each sample"""
    coders: Any
    """coder state before each sample"""
    sent: Any
    """per slot: symbol sent"""
    word: Any
    """the sample's word as received"""
    model: Any
    coder: Any
    spare: Any
    """states of the provisional copy"""
    predicted: Any
    """what a measurement is compared with"""
    correction: Any
    nothing: Any
    """no correction"""
    seen: Any
    """the transmitter's observer; without one, what is measured"""
    innovation: Any
    """of the observer, per output"""
    true: Any
    """outputs at the present tick"""
    measured: Any
    """what their encoders show"""
    reading: Any
    """counts of their encoders"""
    read_before: Any
    """counts at the tick before"""
    still: Any
    """per output, ticks since its counts changed; then the age of the window that is watched"""
    known_command: Any
    """the last command that the observer knows"""
    held: Any
    """what the guard passes"""
    wanted: Any
    """what the law wants"""
    memory: Any
    """of the law: integrals, and the outputs of the tick before"""
    errors: Any
    rates: Any
    """of the law's loops"""
    coded: Any
    """per tick: the codec's outputs"""
    live: Any
    """per tick: the predicted outputs"""
    commands: Any
    """per tick: commanded"""
    applied: Any
    """per tick: applied to the plant"""
    squares: Any
    """per output: sums of squared errors, coded, live, tracking"""
    largest: Any
    """per output: largest error, coded, live; and of the output itself"""
    counted: Any
    """ticks whose errors, coded and live, were scored"""
