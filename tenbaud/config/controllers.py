"""The sections of the built-in controllers, and of their set-points."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from tenbaud.config.section import Factor, Gain, NamedSections, NotNegative, Positive, Section


class PidLoopSection(Section):
    """One loop of a PID law: which output, by which inputs."""

    output: str = ""
    """name of the output; empty: the first"""
    rate: str = ""
    """name of the state that is its rate; empty: OUTPUT_rate, or else the output's change"""
    inputs: dict[str, Factor] = Field(default_factory=dict)
    """share of the loop's sum that each input gets; empty: a single input gets all of it; of two, the
    first gets half and the second minus half"""
    steers: str = ""
    """in place of inputs: output whose loop, later in the list, takes the sum as its set-point"""
    reversed: bool = False
    """the sum's sign is reversed for that loop"""
    set_point_max: Positive = 1e9
    """largest set-point given to that loop, either way"""
    proportional: Gain = 0.0
    integral: Gain = 0.0
    derivative: Gain = 0.0
    unit: str = ""
    """of the gains, such as V/rad or V/deg; empty: the input's unit per unit of the output"""


class PidSection(PidLoopSection):
    """PID law (24): one loop, or the list `loops` of several."""

    proportional: Gain = 0.1
    integral: Gain = 0.053
    derivative: Gain = 0.12
    unit: str = "V/deg"
    """the paper prints no unit; only V/deg follows its reference"""
    anti_windup: Literal["conditional", "none"] = "conditional"
    normal_force_volts: Factor = 0.0
    """w of (1): a sum that all inputs share equally"""
    loops: tuple[PidLoopSection, ...] = ()
    """[[receiver.pid.loops]]: instead of the one loop described here"""


class StateFeedbackSection(Section):
    """Feedback of all states: gains as given, or designed (LQR) from weights."""

    gains: tuple[tuple[Factor, ...], ...] = ()
    """a row for each input, a column for each state; empty: designed"""
    integral_gains: tuple[tuple[Factor, ...], ...] = ()
    """with given gains: a row for each input, a column for each output"""
    state_weights: dict[str, NotNegative] = Field(default_factory=dict)
    """cost of each state by name, 0 for the others; empty: 1 for every output"""
    input_weights: dict[str, Positive] = Field(default_factory=dict)
    """cost of each input by name, 1 for the others"""
    integral_weights: dict[str, Positive] = Field(default_factory=dict)
    """outputs with integral action, and the cost of the integral of their error"""
    anti_windup: Literal["conditional", "none"] = "conditional"


class ReferenceSection(Section):
    """The set-point of an output."""

    kind: Literal["square", "step", "sine", "constant", "points", "csv", "none"] = "square"
    """none: the output has no set-point"""
    amplitude: Factor = 1.5707963267948966
    """in the unit of the output"""
    offset: Factor = 0.0
    """added to a set-point of any kind"""
    period_s: Positive = 25.0
    start_s: NotNegative = 1.0
    """time of the step"""
    points: tuple[tuple[NotNegative, Factor], ...] = ()
    """for points: (time in s, set-point); each holds until the next"""
    file: str = ""
    """for csv: columns time_s and NAME_UNIT of the output, such as pitch_rad"""


class ReferencesSection(ReferenceSection, NamedSections):
    """The set-point of the first output; those of the others, or of any, by name."""

    __pydantic_extra__: dict[str, ReferenceSection]
