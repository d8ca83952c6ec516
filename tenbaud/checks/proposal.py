"""Settings of a first flight, from what was read while somebody turned the axes of a rig by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Protocol

from tenbaud.build.first_contact import first_settings, rounded_down
from tenbaud.build.rig import build_axes, wired_outputs
from tenbaud.build.signals import configured_signals
from tenbaud.config.load import flattened
from tenbaud.config.schema import FlightConfig

SHARE = 0.9
"""of the nearer end of the range that an axis was turned through"""
LEAST_COUNTS = 50
"""An axis that was turned by less on one side was not turned to its end."""


class TurnedAxis(Protocol):
    """What was seen of an axis."""

    name: str
    angle_min_rad: float
    angle_max_rad: float


def proposed(config: FlightConfig, seen: Sequence[TurnedAxis]) -> tuple[dict[str, Any], list[str]]:
    """Return the settings of a first flight by their full names, and what they do not rest on."""
    signals = configured_signals(config)
    by_name = {one.name: one for one in seen}
    axes = {one.name: one for one in build_axes(config, signals)}
    soft, not_seen = [], []
    for name, unit in wired_outputs(signals).items():
        axis, step = by_name[name], axes[name].turn / axes[name].counts_per_turn
        reach = min(-axis.angle_min_rad, axis.angle_max_rad)
        if reach < LEAST_COUNTS * step:
            soft.append(math.inf)
            not_seen.append(
                f"{name} was turned from {axis.angle_min_rad:.3g} to {axis.angle_max_rad:.3g} {unit}, "
                "not to an end on both sides of 0: its soft limit is a guess"
            )
        else:
            soft.append(rounded_down(SHARE * reach))
    settings = first_settings(config, signals, soft)
    names = ", ".join(one.name for one in signals.inputs)
    not_seen += [
        f"the motors ({names}): they stay disabled, so limits.command_max = "
        f"{settings['limits.command_max']} is not measured, and neither signs nor outputs are checked",
        "the emergency stop and the device's watchdog: press the one, unplug the other",
    ]
    section = config.transmitter
    of_rig = {"transmitter": {"rig": section.rig, "bridge": _changed(section.bridge)}}
    of_rig["transmitter"][section.rig] = _changed(getattr(section, section.rig))
    return {"preset": config.preset} | dict(flattened(of_rig)) | settings, not_seen


def _changed(section: Any) -> dict[str, Any]:
    changed: dict[str, Any] = section.model_dump(mode="json", exclude_defaults=True)
    return changed
