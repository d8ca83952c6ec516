"""Completing a configuration: the numbers that both ends must share to the last bit are computed once.

Neither end discretises or designs by itself: two machines' libraries differ in the last bit. The result
goes into the shared configuration by value.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, TypeVar

from pydantic import ValidationError

from plant_sim.zero_order_hold import discretised
from tenbaud.bounds.linear import rate_needed
from tenbaud.config.kinds import MODELS, kind_of
from tenbaud.config.load import ConfigError
from tenbaud.config.models import LinearModelSection
from tenbaud.config.schema import EncodersSection, Timing
from tenbaud.config.section import KindSection, Section
from tenbaud.design.described import corrected_part, linear_of, plant_of, require_rate, require_seen
from tenbaud.design.direction import design_direction, design_learning
from tenbaud.design.encoders import steps_of
from tenbaud.design.plant import behind_encoders

DESIGNED = (*("transition", "noise", "noises", "worth", "start", "starts", "reach", "removed", "step"),)
"""settings of a coder that are worked out; what else it has is the user's"""
SectionKind = TypeVar("SectionKind", bound=Section)


def completed(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested settings with the sections `model` and `coder` completed.

    A linear model gets F and E from its A and B, and a coder `direction` or `learning` its constants
    for the plant; both anew where they are there already. On a plant that grows the coder is designed
    for what the configured encoders show of it. Raises ConfigError where nothing can be designed.
    """
    given, coder = dict(values.get("model", {})), dict(values.get("coder", {}))
    try:
        timing = checked_section("timing", Timing, values.get("timing", {}))
        section = checked_section("model", kind_of(MODELS, given.get("kind", "pitch")).section, given)
        if isinstance(section, LinearModelSection) and section.A:
            F, E = discretised(section.A, section.B, timing.tick_s)
            given |= {"F": F.tolist(), "E": E.tolist()}
            section = checked_section("model", LinearModelSection, given)
        if coder.get("kind") in ("direction", "learning"):
            encoders = values.get("transmitter", {}).get("encoders", {})
            coder |= _designed(section, coder, timing, encoders)
    except ValueError as error:
        raise _undesigned(error) from error
    return {**values, "model": given, "coder": coder}


def _undesigned(why: object) -> ConfigError:
    return ConfigError(f"this cannot be designed: {why}")


def checked_section(place: str, sort: type[SectionKind], values: Mapping[str, Any]) -> SectionKind:
    """Return a section; ConfigError that names its fields."""
    try:
        return sort.model_validate(values)
    except ValidationError as error:
        faults = [
            f"{'.'.join([place, *map(str, one['loc'])])}: {one['msg'].removeprefix('Value error, ')}"
            for one in error.errors()
        ]
        raise _undesigned("; ".join(faults)) from error


def _designed(
    section: KindSection, coder: Mapping[str, Any], timing: Timing, encoders: Mapping[str, Any]
) -> dict[str, Any]:
    linear, plant = linear_of(section), plant_of(section, timing.tick_s)
    if linear is None or plant is None:
        raise ValueError(f"model.kind = {section.kind!r} describes no plant to design for")
    plant = corrected_part(plant, linear.corrected)
    rate = coder.get("bits", 1) / timing.symbol_period_s
    require_seen(plant, section)
    require_rate(plant, rate, section)
    if rate_needed(plant.A):
        read = checked_section("transmitter.encoders", EncodersSection, encoders)
        steps = steps_of(read, linear.signals(plant.B.shape[1]))
        if all(steps):
            plant, _ = behind_encoders(plant, steps, timing.tick_s)
    design = design_learning if coder["kind"] == "learning" else design_direction
    found = asdict(design(plant, rate, timing.symbol_period_s))
    return {name: _lists(value) for name, value in found.items() if name in DESIGNED}


def _lists(value: Any) -> Any:
    return [_lists(one) for one in value] if isinstance(value, tuple) else value
