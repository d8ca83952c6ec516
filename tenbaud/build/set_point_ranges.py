"""The range of each output's set-points, which the words of a mirrored law divide."""

from __future__ import annotations

import math

from channel.codec.codec import Codec, Model
from channel.codec.downlink.mirrored import SetPointRange
from channel.codec.signals import Signal, Signals
from receiver.controllers.base import Controller
from tenbaud.build.references import (
    limits_kept,
    reached,
    reference_of,
    reference_sections,
    set_point_limits,
)
from tenbaud.build.signals import per_output
from tenbaud.config.load import ConfigError
from tenbaud.config.schema import FlightConfig
from tenbaud.design.encoders import output_names


def set_point_ranges(
    config: FlightConfig, codec: Codec, signals: Signals, given: Controller | None
) -> list[SetPointRange]:
    """Return the range of each output that is steered; ConfigError for a set-point outside of its own.

    A range that is not given is the output's own; where it has none, the configured set-points and
    what is beyond them, chosen so that the least and the largest are words without rounding.
    """
    section, outputs = config.downlink, signals.outputs
    lowest = per_output("downlink.set_point_min", section.set_point_min, signals, -math.inf)
    highest = per_output("downlink.set_point_max", section.set_point_max, signals)
    found = []
    if given is None:
        steered = _programmes(config, signals, codec.model)
    else:
        first = [*given.references(0), *[None] * len(outputs)]
        steered = tuple([None if one is None else (one, one, one) for one in first[: len(outputs)]])
    for place, (output, one) in enumerate(zip(outputs, steered, strict=True)):
        if one is None:
            continue
        least, most, start = one
        low, high = lowest[place], highest[place]
        around = _around(least, most, section.bits)
        low = next((one for one in (low, output.low) if one > -math.inf), around[0])
        high = next((one for one in (high, output.high) if one < math.inf), around[1])
        _require_range(output, low, high, least, most)
        found.append(SetPointRange(place, low, high, start))
    if not found:
        raise ConfigError(
            'no output has a set-point, so nothing would go down: set downlink.scheme = "coded", or '
            f"give one of the outputs a reference: {output_names(signals)}"
        )
    return found


def _around(least: float, most: float, bits: int) -> tuple[float, float]:
    """Return a range in which both are words to the last digit, with an eighth of the words beyond."""
    beyond = (1 << bits) // 8
    step = (most - least) / ((1 << bits) - 1 - 2 * beyond)
    return least - (beyond + 0.5) * step, most + (beyond + 0.5) * step


def _require_range(output: Signal, low: float, high: float, least: float, most: float) -> None:
    advice = (
        "give it with downlink.set_point_min and downlink.set_point_max, one value for each output or "
        f"a table {{ {output.name} = ... }}"
    )
    if not low < high:
        raise ConfigError(
            f"the set-points of {output.name} have the range {low:g} to {high:g} {output.unit}, which "
            f"is empty, and the output has none of its own: {advice}"
        )
    if not low <= least <= most <= high:
        raise ConfigError(
            f"the set-points of {output.name} reach from {least:g} to {most:g} {output.unit}, beyond "
            f"the range of their words, {low:g} to {high:g}: {advice}"
        )


def _programmes(
    config: FlightConfig, signals: Signals, model: Model
) -> tuple[tuple[float, float, float] | None, ...]:
    """Return the least, the largest and the first set-point of each output; None: it has none."""
    found: list[tuple[float, float, float] | None] = []
    limits = set_point_limits(config, signals, model)
    for (output, section), limit in zip(reference_sections(config, signals), limits, strict=True):
        if section is None:
            found.append(None)
            continue
        reference = reference_of(section, config.timing.tick_s, output)
        most = math.inf if limit is None else limit[1]
        low, high = (min(max(one, -most), most) for one in reached(section, reference))
        first = limits_kept(reference, limit).value(0)
        found.append((min(low, first), max(high, first), first))
    return tuple(found)
