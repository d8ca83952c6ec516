"""First contact with a rig that drives motors: what a person decides before they turn.

Such a flight needs a soft limit on every output, a limit of every input that a person stated, and
set-points that begin gently: at most a third of the soft limit and 10 degrees, at most that much a
second. The limits of set-points are shared: a receiver that has others is refused by the handshake.
"""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Protocol

from channel.codec.codec import Vector
from channel.codec.signals import Signal, Signals
from tenbaud.build.flight import REAL_RIGS
from tenbaud.build.parts import Parts
from tenbaud.build.references import reference_sections
from tenbaud.build.rig import build_axes, build_device, real_rig_name, wired_outputs
from tenbaud.build.signals import build_limits, configured_signals, per_output, soft_limits
from tenbaud.config.kinds import CONTROLLERS
from tenbaud.config.load import ConfigError, flattened, toml_text
from tenbaud.config.schema import FlightConfig
from tenbaud.log.units import turn_in

HIL_SUBSTITUTE = "fake"
"""What `--rig hil:fake` drives is in this process."""
GENTLE_SHARE = 1.0 / 3.0
"""of the soft limit"""
GENTLE_TURN = 10.0 / 360.0
FIRST_SOFT_TURN = 0.5 / math.tau
"""Soft limit of an angle that is proposed where nothing is known of its stops: 0.5 rad."""
FIRST_COMMAND_SHARE = 0.2
"""of an input's limit"""
DECLARATION_S = 0.5
"""Every sample of this time must say that the device is emulated."""
LINE_DECLARATION_S = 2.0
"""A device that says it in a line between samples has this long."""
TURNED_SHARE = 0.9
"""of the nearer end of the range that an axis was turned through"""
LEAST_COUNTS = 50
"""An axis that was turned by less on one side was not turned to its end."""


def drives_motors(config: FlightConfig) -> bool:
    """Return whether a flight turns the motors of a rig, as far as the configuration knows."""
    section = config.transmitter
    if section.rig not in REAL_RIGS or section.dry_run:
        return False
    return section.rig != "hil" or section.hil.card_type != HIL_SUBSTITUTE


def require_safe(config: FlightConfig, accept_risk: bool = False, parts: Parts | None = None) -> bool:
    """Return whether motors of a real rig will turn; ConfigError where what that needs is missing.

    `accept_risk`: a person has typed that it may be missing. A device that declares itself emulated
    needs nothing.
    """
    if not drives_motors(config):
        return False
    parts = parts or Parts()
    signals = configured_signals(config, parts)
    missing = list(_missing(config, signals, parts))
    if not missing or accept_risk:
        return True
    if is_emulated(config, signals):
        return False
    values = first_settings(config, signals)
    raise ConfigError(
        f"the motors of {real_rig_name(config.transmitter)} stay off; before they turn, decide on\n  "
        + "\n  ".join(missing)
        + "\nTo begin with, after checking these values against the stand and its motors, add\n  "
        + as_options(values)
        + "\n`tenbaud rig-check` proposes them from what it reads, motors disabled. To fly without "
        "these limits, add --accept-risk (in Python: accept_risk=True)"
    )


def is_emulated(config: FlightConfig, signals: Signals) -> bool:
    """Return whether the device says that it is the rig emulator; nothing is sent to its motors.

    RigError where it cannot be opened. What cannot say so, raw doubles without flags, is not asked.
    """
    section = config.transmitter
    if section.rig == "hil" or (section.rig == "quarc" and "flags" not in (section.quarc.fields or ())):
        return False
    if section.rig == "serial" and section.serial.motor_port:
        return False  # the encoders' port says nothing of the motors behind another
    with build_device(config, output=False, signals=signals) as device:
        if section.rig == "serial" and section.serial.format == "ascii":
            # Its declaration is a line of its own between samples.
            return device.declares_emulation(LINE_DECLARATION_S, late=True)
        return device.declares_emulation(DECLARATION_S)


def _missing(config: FlightConfig, signals: Signals, parts: Parts) -> Iterator[str]:
    """Yield what a flight lacks, a line each."""
    soft = soft_limits(config, signals)
    open_outputs = [
        one.name for one, most in zip(signals.outputs, soft, strict=True) if most == math.inf
    ]
    if open_outputs:
        yield f"transmitter.soft_limits: none for {', '.join(open_outputs)}; beyond it the flight ends"
    if "limits.command_max" not in config.given:
        limits = build_limits(config, signals).command_max
        pairs = zip(signals.inputs, limits, strict=True)
        values = ", ".join(f"{one.name} {most:g} {one.unit}".rstrip() for one, most in pairs)
        yield f"limits.command_max: the preset's own ({values}); state the limit of your motors"
    controller = config.receiver.controller
    outside = controller == "recorded" or controller not in CONTROLLERS.built_in
    if outside or parts.controller is not None:
        yield "receiver.controller: it may follow set-points of its own, which no limit makes gentle"
        return
    for place, (output, section) in enumerate(reference_sections(config, signals)):
        gentle = gentle_limit(output, soft[place])
        for field, what in (("set_point_max", ""), ("set_point_slew_per_s", "/s")):
            value = per_output(f"limits.{field}", getattr(config.limits, field), signals)[place]
            if section is not None and not value <= gentle:
                now = "none" if value == math.inf else f"{value:g} {output.unit}{what}"
                yield (
                    f"limits.{field}: {now} for {output.name}; gentle is up to "
                    f"{rounded_down(gentle):g} {output.unit}{what}"
                )


def gentle_limit(output: Signal, soft_limit: float) -> float:
    """Return the largest set-point, and its largest change in a second, of a first flight."""
    if soft_limit == math.inf:
        soft_limit = _first_soft_limit(output)
    turn = turn_in(output.unit)
    return min(soft_limit * GENTLE_SHARE, math.inf if turn is None else turn * GENTLE_TURN)


def first_settings(
    config: FlightConfig, signals: Signals, soft: Sequence[float] | None = None
) -> dict[str, Any]:
    """Return the settings of a first flight: what is given where that is safe, else small values.

    `soft` are soft limits that were found out, infinite where nothing is known.
    """
    known = soft or soft_limits(config, signals)
    stops = config.model.stops
    limits = [
        most if most < math.inf else _first_soft_limit(one, stops.get(one.name))
        for one, most in zip(signals.outputs, known, strict=True)
    ]
    gentle = [
        rounded_down(gentle_limit(one, most)) for one, most in zip(signals.outputs, limits, strict=True)
    ]
    inputs: Vector = build_limits(config, signals).command_max
    if "limits.command_max" not in config.given:
        inputs = tuple([rounded_down(one * FIRST_COMMAND_SHARE) for one in inputs])
    return {
        "transmitter.soft_limits": _shortest(limits),
        "limits.command_max": _shortest(inputs),
        "limits.set_point_max": _shortest(gentle),
        "limits.set_point_slew_per_s": _shortest(gentle),
    }


def as_options(settings: Mapping[str, Any]) -> str:
    """Return settings as options for a shell."""
    return " ".join(
        f"--set {shlex.quote(toml_text({'x': value}).strip().replace('x = ', name + '=', 1))}"
        for name, value in settings.items()
    )


def motor_lines(config: FlightConfig) -> list[str]:
    """Return the limits of a flight with motors, a line each, for the person who stands beside them."""
    signals = configured_signals(config)
    columns = (
        soft_limits(config, signals),
        per_output("limits.set_point_max", config.limits.set_point_max, signals),
        per_output("limits.set_point_slew_per_s", config.limits.set_point_slew_per_s, signals),
    )
    lines = []
    for one, soft, largest, slew in zip(signals.outputs, *columns, strict=True):
        lines.append(
            f"{one.name}: ends the flight {_within(soft, one.unit)}; set-point "
            f"{_within(largest, one.unit, 'within')}, {_within(slew, one.unit + '/s', 'at most')}"
        )
    for one, most in zip(signals.inputs, build_limits(config, signals).command_max, strict=True):
        lines.append(f"{one.name}: commands within {most:g} {one.unit} either way")
    return lines


def _within(value: float, unit: str, word: str = "beyond") -> str:
    return "without a limit" if value == math.inf else f"{word} {value:g} {unit}".rstrip()


def _first_soft_limit(output: Signal, stops: tuple[float, float] | None = None) -> float:
    turn = turn_in(output.unit)
    largest = 1.0 if turn is None else turn * FIRST_SOFT_TURN
    if stops is None:
        return largest
    return min(largest, rounded_down(0.9 * min(abs(stops[0]), abs(stops[1]))))


def rounded_down(value: float) -> float:
    """Return a value to two digits, not above it."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.floor(value / unit + 1e-9) * unit:.2g}")


def _shortest(values: Sequence[float]) -> float | list[float]:
    """Return one number where all are alike."""
    return values[0] if len(set(values)) == 1 else list(values)


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
            soft.append(rounded_down(TURNED_SHARE * reach))
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
