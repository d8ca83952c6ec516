"""The inputs and outputs of a compiled flight: flat numbers and arrays."""

from __future__ import annotations

from typing import Any, NamedTuple

DONE, LEFT = 0, 1


class Numbers(NamedTuple):
    """The inputs of a flight, beside the constants of model, coder, plant and PID."""

    ticks: int
    per_sample: int
    """N"""
    lead: int
    """D"""
    window_start: int
    impulse: bool
    replay: bool
    """the rig is a recording: counts, commands and applied voltages are given"""
    command_max: tuple[float, float]
    slew: tuple[float, float]
    """per tick"""
    steps_per_unit: tuple[float, float]
    bias: tuple[float, float]
    """of the inputs, without the controller's loop"""
    initial_front: float
    initial_rear: float
    safe_front: float
    safe_rear: float
    guard_timeout: int
    """ticks"""
    soft_limit: float
    """rad; infinite for none"""
    watch: int
    """ticks of the window in which the encoder is watched"""
    counts_per_turn: int
    uses_rates: bool
    """words are formed from all corrected states, which the transmitter observes"""
    sign: int
    zero_counts: int


class Given(NamedTuple):
    """Arrays that a flight reads."""

    start: Any
    """plant: angle and rate"""
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
    reference: Any
    """per tick, `D` ticks beyond the flight included; empty without one"""
    torque: Any
    """per tick; empty for none"""
    counts: Any
    """replay: per tick"""
    commands: Any
    """replay: front and rear volts per tick, `D` ticks beyond the flight included"""
    applied: Any
    """replay: front and rear volts per tick; empty when they were not recorded"""
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
    correction: Any
    nothing: Any
    """no correction"""
    seen: Any
    """the transmitter's observer; without one, the measured angle"""
    given_out: Any
    """front and rear: the last command that the observer knows"""
    coded: Any
    """per tick: the codec's angle"""
    live: Any
    """per tick: the predicted angle"""
    front: Any
    rear: Any
    """per tick: commanded"""
    applied: Any
    """per tick: on the motors"""


class Motion(NamedTuple):
    """The sensor node's state between ticks."""

    front: float
    rear: float
    counts: int
    still: int
    """ticks since the counts changed"""
    age: int
    """ticks since the last command"""
    late: int
    """ticks whose command had not come"""


class Errors(NamedTuple):
    """Running figures as `transmitter.metrics.scores` keeps them."""

    coded_count: int = 0
    coded_squares: float = 0.0
    coded_max: float = 0.0
    live_count: int = 0
    live_squares: float = 0.0
    live_max: float = 0.0
    tracking_count: int = 0
    tracking_squares: float = 0.0
    angle_max: float = 0.0
