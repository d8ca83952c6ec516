"""What a configuration gives for the inputs and outputs of its model, in their order."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from channel.codec.codec import Vector
from channel.codec.signals import Signal, Signals, signals_of
from channel.protocol.limits import CommandLimits, per_input, require_carried
from plant_sim.encoder import Encoder, ExactReader, OutputReader
from tenbaud.build.codec import build_model
from tenbaud.build.parts import Parts
from tenbaud.config.load import ConfigError
from tenbaud.config.schema import EncoderSection, FlightConfig
from tenbaud.log.units import turn_in

COUNTS_PER_TURN = 4096


def configured_signals(config: FlightConfig, parts: Parts | None = None) -> Signals:
    """Return the signals of the configured model."""
    return signals_of(build_model(config, parts))


def build_limits(config: FlightConfig, signals: Signals) -> CommandLimits:
    """Return clamp and slew of each input, the latter per tick."""
    section, tick_s = config.limits, config.timing.tick_s
    slews = per_input("limits.command_slew_per_s", section.command_slew_per_s, signals)
    try:
        return CommandLimits.of(signals, section.command_max, [slew * tick_s for slew in slews])
    except ValueError as error:
        raise ConfigError(f"limits: {error}") from error


def initial_command(config: FlightConfig, signals: Signals) -> Vector:
    """Return the command of the ticks before the first one decided."""
    return _command("limits.initial_command", config.limits.initial_command, signals)


def safe_command(config: FlightConfig, signals: Signals) -> Vector:
    """Return the command that the guard ramps to."""
    return _command("transmitter.safe_command", config.transmitter.safe_command, signals)


def _command(field: str, given: float | tuple[float, ...], signals: Signals) -> Vector:
    try:
        command = per_input(field, given, signals)
        require_carried(field, command, signals)
    except ValueError as error:
        raise ConfigError(str(error)) from error
    return command


def soft_limits(config: FlightConfig, signals: Signals) -> Vector:
    """Return the largest value of each output before the guard steps in; () without any."""
    field, given = "transmitter.soft_limits", config.transmitter.soft_limits
    if given is None:
        return ()
    if isinstance(given, dict):
        check_outputs(field, given, signals)
        return tuple([given.get(one.name, math.inf) for one in signals.outputs])
    limits = (given,) * len(signals.outputs) if isinstance(given, float) else given
    if len(limits) != len(signals.outputs):
        raise ConfigError(
            f"{field} has {len(limits)} values, and the plant {len(signals.outputs)} output(s): "
            f"{_names(signals)}"
        )
    return limits


def check_outputs(field: str, named: Mapping[str, Any], signals: Signals) -> None:
    """Raise ConfigError for a name that is not an output."""
    for name in named:
        if name not in [one.name for one in signals.outputs]:
            raise ConfigError(f"{field}.{name}: the plant's output(s) are {_names(signals)}")


def _names(signals: Signals) -> str:
    return ", ".join(one.name for one in signals.outputs)


def build_encoders(config: FlightConfig, signals: Signals) -> tuple[OutputReader, ...]:
    """Return what reads each output on a simulated rig."""
    field, section = "transmitter.encoders", config.transmitter.encoders
    check_outputs(field, section.by_name, signals)
    for one in signals.outputs:
        if (own := section.by_name.get(one.name)) is not None:
            _check_units(f"{field}.{one.name}", own, one)
    return tuple([_encoder(section.by_name.get(one.name, section), one) for one in signals.outputs])


def encoder_steps(config: FlightConfig, signals: Signals) -> list[float]:
    """Return the step of what reads each output, in the output's unit; 0 where it is read exactly."""
    readers = build_encoders(config, signals)
    return [one.turn / one.counts_per_turn if isinstance(one, Encoder) else 0.0 for one in readers]


def _check_units(field: str, section: EncoderSection, output: Signal) -> None:
    if section.counts_per_turn is not None and turn_in(output.unit) is None:
        raise ConfigError(
            f"{field}.counts_per_turn = {section.counts_per_turn}: the output {output.name} is in "
            f"{output.unit}, which has no turns; give counts_per_unit"
        )
    if section.counts_per_turn is not None and section.counts_per_unit is not None:
        raise ConfigError(f"{field}: give counts_per_turn or counts_per_unit, not both")


def _encoder(section: EncoderSection, output: Signal) -> OutputReader:
    turn = turn_in(output.unit)
    counts: float = section.counts_per_turn or COUNTS_PER_TURN
    if section.counts_per_unit is not None:
        turn, counts = 1.0, section.counts_per_unit
    if turn is None or not section.quantised:
        return ExactReader()
    return Encoder(counts, section.sign, section.zero_counts, turn)
