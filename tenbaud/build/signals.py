"""The settings of a configuration for the inputs and outputs of its model, in their order."""

from __future__ import annotations

import math

from channel.codec.codec import Vector
from channel.codec.signals import Signals, signals_of
from channel.protocol.limits import CommandLimits, per_input, require_carried
from plant_sim.encoder import OutputReader
from tenbaud.build.codec import build_model
from tenbaud.build.parts import Parts
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.schema import FlightConfig, PerOutput
from tenbaud.design.encoders import check_outputs, encoders_of, output_names, steps_of


def configured_signals(config: FlightConfig, parts: Parts | None = None) -> Signals:
    """Return the signals of the configured model."""
    return signals_of(build_model(config, parts))


def build_limits(config: FlightConfig, signals: Signals) -> CommandLimits:
    """Return clamp and slew of each input, the latter per tick."""
    section, tick_s = config.limits, config.timing.tick_s
    slews = per_input("limits.command_slew_per_s", section.command_slew_per_s, signals)
    with config_errors("limits"):
        return CommandLimits.of(signals, section.command_max, [slew * tick_s for slew in slews])


def initial_command(config: FlightConfig, signals: Signals) -> Vector:
    """Return the command of the ticks before the first one decided."""
    return _command("limits.initial_command", config.limits.initial_command, signals)


def safe_command(config: FlightConfig, signals: Signals) -> Vector:
    """Return the command that the guard ramps to."""
    return _command("transmitter.safe_command", config.transmitter.safe_command, signals)


def _command(field: str, given: float | tuple[float, ...], signals: Signals) -> Vector:
    with config_errors():
        command = per_input(field, given, signals)
        require_carried(field, command, signals)
    return command


def soft_limits(config: FlightConfig, signals: Signals) -> Vector:
    """Return the largest value of each output before the guard steps in."""
    return per_output("transmitter.soft_limits", config.transmitter.soft_limits, signals)


def per_output(field: str, given: PerOutput, signals: Signals, without: float = math.inf) -> Vector:
    """Return one value for each output, `without` for one that has none; ConfigError for misfits."""
    given = without if given is None else given
    if isinstance(given, dict):
        check_outputs(field, given, signals)
        return tuple([given.get(one.name, without) for one in signals.outputs])
    limits = (given,) * len(signals.outputs) if isinstance(given, float) else given
    if len(limits) != len(signals.outputs):
        raise ConfigError(
            f"{field} has {len(limits)} values, and the plant {len(signals.outputs)} output(s): "
            f"{output_names(signals)}"
        )
    return limits


def build_encoders(config: FlightConfig, signals: Signals) -> tuple[OutputReader, ...]:
    """Return what reads each output on a simulated rig."""
    return encoders_of(config.transmitter.encoders, signals)


def encoder_steps(config: FlightConfig, signals: Signals) -> list[float]:
    """Return the step of what reads each output, in the output's unit; 0 where it is read exactly."""
    return steps_of(config.transmitter.encoders, signals)
