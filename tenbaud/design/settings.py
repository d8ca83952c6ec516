"""The settings of a flight of a plant that is given by its matrices and a rate."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from channel.codec.codec import Vector
from channel.codec.signals import STEPS_MAX, InputSignal, Signals, named
from channel.protocol.limits import COMMAND_MAX, per_input
from plant_sim.zero_order_hold import continuous
from tenbaud.config.load import OWN, ConfigError, config_errors, load_config
from tenbaud.config.models import LinearModelSection
from tenbaud.config.schema import EncoderSection
from tenbaud.design.complete import checked_section
from tenbaud.design.systems import Matrices, Names, name_and_unit

RATE_BAUD = 10.0
TICK_S_MAX = 0.01
"""longest tick that is chosen for a continuous plant"""
TICK_S_LIMIT = 1.0
BITS_MAX = 15
"""what `timing.tick_s` and `coder.bits` may be at most"""
DISTURBED = 0.02
"""assumed disturbance of an input: rms of its mean over a symbol period, by the largest command"""
SLEWED = 200.0
"""slew limit over the largest command, 1/s: no limit to anything but jumps within a tick"""
WHOLE = 1e-6


def settings_of(plant: Matrices, rate_baud: float | None, over: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested settings: timing, channel, model, coder, plant and controller; not designed yet.

    `over` are the settings that will be laid over them, as far as the others follow from these.
    ConfigError, naming the field, for a value that cannot be used.
    """
    rate = _rate(rate_baud, over)
    timing, bits = _timing(over, plant.dt, rate)
    model = _model(plant, timing["tick_s"])
    given = over.get("model", {})
    most = load_config(OWN, None, {"limits": over.get("limits", {})}).limits.command_max
    if most is None:
        most = tuple(np.maximum(COMMAND_MAX, 2.0 * abs(plant.u0)).tolist())
    largest = np.array(_per_input(most, model, len(plant.u0)))
    model["input_steps_per_unit"] = [10.0 ** math.floor(math.log10(STEPS_MAX / one)) for one in largest]
    if not given.keys() & {"densities", "G"}:
        assumed = (DISTURBED * largest) ** 2 * timing["symbol_period_s"]
        model["densities"] = [float(f"{one:.3g}") for one in assumed]
    densities = given.get("densities", model.get("densities", [1.0]))
    if not isinstance(densities, list | tuple):
        raise ConfigError(f"model.densities = {densities!r}: give a list, [{densities}]")
    rest = plant.u0.tolist()
    return {
        "timing": timing,
        "channel": {"rate_baud": rate},
        "model": model,
        "coder": {"kind": "direction", "bits": bits},
        "limits": {
            "command_max": largest.tolist(),
            "command_slew_per_s": (SLEWED * largest).tolist(),
            "initial_command": rest,
        },
        "transmitter": {
            "plant": {"disturbance": "q=" + ":".join(map(str, densities))},
            "safe_command": rest,
        },
        "receiver": {
            "controller": "state_feedback",
            "pid": {"unit": ""},
            "reference": {"kind": "none"},
        },
    }


def _rate(rate_baud: float | None, over: Mapping[str, Any]) -> float:
    """Return the rate that is given, as an argument or as a setting."""
    set_rate = over.get("channel", {}).get("rate_baud")
    rates = [one for one in (rate_baud, set_rate) if one is not None]
    if len(rates) == 2 and rate_baud != set_rate:
        raise ConfigError(f"rate_baud = {rate_baud} and channel.rate_baud = {set_rate}: give one rate")
    checked = load_config(OWN, None, {"channel": {"rate_baud": rates[0] if rates else RATE_BAUD}})
    return checked.channel.rate_baud


def _per_input(most: float | Vector, model: Mapping[str, Any], inputs: int) -> Vector:
    names = model.get("inputs") or [one.name for one in named("input", inputs)]
    signals = Signals((), tuple([InputSignal(name) for name in names]), ())
    with config_errors():
        return per_input("limits.command_max", most, signals)


def exact_outputs(model: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings by which an output without a unit is read exactly: it may be no angle.

    Where the settings `over` them have an encoder, for it or for all outputs, that stays.
    """
    encoders = over.get("transmitter", {}).get("encoders", {})
    if encoders.keys() & EncoderSection.model_fields.keys():
        return {}
    section = checked_section("model", LinearModelSection, model)
    outputs = section.signals(len((section.B or section.E)[0])).outputs
    exact = {
        one.name: {"quantised": False} for one in outputs if not one.unit and one.name not in encoders
    }
    return {"transmitter": {"encoders": exact}}


def _model(plant: Matrices, tick_s: float) -> dict[str, Any]:
    """Return the section `model`; of a discrete plant it has F and E where a tick is a step of it."""
    A, B, transition, drive = plant.A, plant.B, "A", "B"
    if plant.dt:
        steps = plant.dt / tick_s
        if steps < 1.0 - WHOLE or abs(steps - round(steps)) > WHOLE * steps:
            raise ConfigError(
                f"dt = {plant.dt:g} s of the discrete system is {steps:.6g} ticks of timing.tick_s = "
                f"{tick_s:g} s; it must be a whole number of them"
            )
        if round(steps) == 1:
            transition, drive = "F", "E"
        elif plant.linear:
            A, B = continuous(A, B, plant.dt)
        else:
            raise ConfigError(
                f"timing.tick_s is {tick_s:g} s; it must be dt = {plant.dt:g} s of a discrete system "
                "that is not linear"
            )
    model = {"kind": "linear", transition: A.tolist(), drive: B.tolist(), "C": plant.C.tolist()}
    if np.any(plant.x0) or np.any(plant.u0):
        model |= {"operating_state": plant.x0.tolist(), "operating_command": plant.u0.tolist()}
    for what in Names._fields:
        named = [name_and_unit(label) for label in getattr(plant.names, what)]
        if named:
            model |= {f"{what}s": [name for name, _ in named], f"{what}_units": [u for _, u in named]}
    return model


def _timing(over: Mapping[str, Any], dt: float, rate: float) -> tuple[dict[str, float], int]:
    """Return tick and symbol period, and the bits of a word: several where a discrete plant is slow."""
    given = over.get("timing", {})
    tick_s, period_s = given.get("tick_s"), given.get("symbol_period_s")
    bits = over.get("coder", {}).get("bits") or min(max(1, math.floor(rate * dt + WHOLE)), BITS_MAX)
    for name, value in (("timing.tick_s", tick_s), ("timing.symbol_period_s", period_s)):
        if value is not None and not 0.0 < value < math.inf:
            raise ConfigError(f"{name} = {value}: it must be above 0 and finite")
    least_s = bits / rate
    if tick_s is None:
        span_s = period_s or least_s
        # Whole nanoseconds, rounded up: the line carries no more than its rate.
        ticks = math.ceil(span_s / TICK_S_MAX - WHOLE)
        steps = math.ceil(dt / TICK_S_LIMIT - WHOLE)
        tick_s = dt / steps if dt else math.ceil(span_s / ticks * 1e9 - WHOLE) / 1e9
    if period_s is None:
        period_s = round(tick_s * max(1, math.ceil(least_s / tick_s - WHOLE)), 9)
    return {"tick_s": tick_s, "symbol_period_s": period_s}, bits
