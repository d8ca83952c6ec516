"""The set-points of a configuration, one for each output."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from channel.codec.codec import Model, Vector
from channel.codec.signals import Signal, Signals
from receiver.controllers.references import (
    Constant,
    LimitedReference,
    Listed,
    Reference,
    Shifted,
    Sine,
    Square,
    SteeredReference,
    Step,
)
from receiver.session.commander import UNWRITTEN_MAX
from tenbaud.build.signals import per_output
from tenbaud.config.controllers import ReferenceSection
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.schema import FlightConfig
from tenbaud.design.encoders import check_outputs

References = tuple[Reference | None, ...]
PERIODIC = ("square", "sine")
ANNOUNCED_SAMPLES_MAX = 1000


def reference_sections(
    config: FlightConfig, signals: Signals
) -> tuple[tuple[Signal, ReferenceSection | None], ...]:
    """Return each output with the section of its set-point, None for one that follows nothing.

    That of the first output is the section itself.
    """
    section = config.receiver.reference
    check_outputs("receiver.reference", section.by_name, signals)
    rest = (None,) * (len(signals.outputs) - 1)
    pairs = zip(signals.outputs, (section, *rest), strict=True)
    found = [(one, section.by_name.get(one.name, usual)) for one, usual in pairs]
    return tuple([(one, None if own is None or own.kind == "none" else own) for one, own in found])


def build_references(config: FlightConfig, signals: Signals, model: Model | None = None) -> References:
    """Return the set-point of each output over the ticks; None for one that follows nothing.

    Limited ones move from the outputs at the start of `model`, without it from 0.
    """
    tick_s = config.timing.tick_s
    found: list[Reference | None] = []
    stops = config.model.stops
    for output, section in reference_sections(config, signals):
        found.append(None if section is None else reference_of(section, tick_s, output))
        if section is not None and output.name in stops:
            _require_within(stops[output.name], section, found[-1], output)
    limits = set_point_limits(config, signals, model)
    # The receiver records the set-points of so many samples after it has flown them.
    ticks = round(config.timing.symbol_period_s / tick_s)
    kept = max(LimitedReference.KEPT, 2 * UNWRITTEN_MAX * ticks)
    if config.channel.downlink == "narrow":
        # It sends them so much ahead of time.
        kept += ANNOUNCED_SAMPLES_MAX * ticks
    return tuple([one and limits_kept(one, of, kept) for one, of in zip(found, limits, strict=True)])


def begin_from(references: References, tick: int, outputs: Vector) -> None:
    """Have limited set-points move from the outputs at this tick."""
    for one, start in zip(references, outputs, strict=False):
        if isinstance(one, LimitedReference | SteeredReference):
            one.begin(tick, start)


SetPointLimits = tuple[float, float, float] | None
"""Start, largest value and step per tick; None: no limit."""


def set_point_limits(
    config: FlightConfig, signals: Signals, model: Model | None
) -> tuple[SetPointLimits, ...]:
    """Return the limits of the set-point of each output."""
    section, tick_s = config.limits, config.timing.tick_s
    largest = per_output("limits.set_point_max", section.set_point_max, signals)
    slew = per_output("limits.set_point_slew_per_s", section.set_point_slew_per_s, signals)
    if {*largest, *slew} == {math.inf}:
        return (None,) * len(largest)
    start = (0.0,) * len(largest) if model is None else model.measured(model.initial())
    return tuple(zip(start, largest, [one * tick_s for one in slew], strict=True))


def limits_kept(
    reference: Reference, limits: SetPointLimits, kept: int = LimitedReference.KEPT
) -> Reference:
    """Return a set-point that keeps to its limits."""
    return reference if limits is None else LimitedReference(reference, *limits, kept)


def _require_within(
    stops: tuple[float, float], section: ReferenceSection, reference: Reference | None, output: Signal
) -> None:
    """Raise ConfigError for a set-point that goes beyond a stop of its output."""
    for value in reached(section, reference):
        if not stops[0] <= value <= stops[1]:
            raise ConfigError(
                f"receiver.reference: the set-point of {output.name} reaches {value:.4g} "
                f"{output.unit}, beyond the plant's stops at {stops[0]:.4g} and {stops[1]:.4g}; make "
                "its amplitude or offset smaller"
            )


def reached(section: ReferenceSection, reference: Reference | None) -> tuple[float, float]:
    """Return the least and the largest value of a configured set-point."""
    about = reference.about if isinstance(reference, Shifted) else reference
    if isinstance(about, Listed):
        reached = about.values
    else:
        other = {"step": 0.0, "constant": section.amplitude}.get(section.kind, -section.amplitude)
        reached = [section.amplitude, other]
    return min(reached) + section.offset, max(reached) + section.offset


def values_of(references: References) -> Callable[[int], tuple[float | None, ...]]:
    """Return the function from a tick to all set-points."""
    if len(references) == 1 and references[0] is not None:
        value = references[0].value
        return lambda tick: (value(tick),)
    return lambda tick: tuple([None if one is None else one.value(tick) for one in references])


def longest_period_s(config: FlightConfig, signals: Signals) -> float:
    """Return the period of the slowest periodic set-point; 0 without one."""
    sections = [section for _, section in reference_sections(config, signals) if section]
    return max([one.period_s for one in sections if one.kind in PERIODIC], default=0.0)


def reference_of(section: ReferenceSection, tick_s: float, output: Signal) -> Reference:
    """Return the set-point that a section describes."""
    found = _about_zero(section, tick_s, output)
    return Shifted(found, section.offset) if section.offset else found


def _about_zero(section: ReferenceSection, tick_s: float, output: Signal) -> Reference:
    match section.kind:
        case "square":
            return Square(section.amplitude, section.period_s, tick_s)
        case "sine":
            return Sine(section.amplitude, section.period_s, tick_s)
        case "step":
            return Step(section.amplitude, section.start_s, tick_s)
        case "constant":
            return Constant(section.amplitude, tick_s)
        case "points":
            if not section.points:
                raise ConfigError(f"receiver.reference: the points of {output.name} are missing")
            with config_errors(f"receiver.reference: points of {output.name}"):
                times_s, values = zip(*section.points, strict=True)
                return Listed(times_s, values, tick_s)
        case "csv":
            if not section.file:
                raise ConfigError("receiver.reference.file names no file for the csv reference")
            with config_errors("receiver.reference"):
                return Csv(section.file, tick_s, output.column)
        case "none":
            raise ConfigError(f"the output {output.name} follows no reference")


class Csv(Listed):
    """Values from a log with the columns `time_s` and `column`; each row holds until the next.

    Times rise from row to row and are at least 0. A file without `column` may have `angle_rad` instead.
    """

    def __init__(self, path: str | Path, tick_s: float, column: str = "angle_rad") -> None:
        """Read the whole file; ValueError with file and line for anything wrong in it."""
        from tenbaud.log.reader import read_table

        table = read_table(path)
        if column not in table.names and "angle_rad" in table.names:
            column = "angle_rad"
        at, of = table.find("time_s"), table.find(column)
        times_s, values = table.check(at), table.check(of)
        if not len(values):
            raise ValueError(f"{path}: no rows; a reference needs at least 1")
        wrong = [0] if times_s[0] < 0.0 else (np.flatnonzero(np.diff(times_s) <= 0.0) + 1).tolist()
        if wrong:
            row = wrong[0]
            floor = f"above {times_s[row - 1]}" if row else "at least 0"
            raise table.fault(row, at, f"{times_s[row]} found; it must be {floor}")
        super().__init__(times_s.tolist(), values.tolist(), tick_s)
