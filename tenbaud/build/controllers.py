"""The controller of a configuration and the set-point that it follows."""

from __future__ import annotations

from pathlib import Path

from channel.codec.signals import Signals
from receiver.controllers.base import Controller, ControllerContext
from receiver.controllers.pid import Pid, PidGains
from receiver.controllers.recorded import RecordedController
from receiver.controllers.references import Constant, Csv, Reference, Sine, Square, Step
from tenbaud.build.flight import read_flight_log
from tenbaud.build.plugins import build_part
from tenbaud.build.signals import build_limits, configured_signals, initial_command
from tenbaud.config.kinds import CONTROLLERS
from tenbaud.config.load import ConfigError
from tenbaud.config.schema import FlightConfig, ReferenceSection


def build_controller(
    config: FlightConfig, reference: Reference | None = None, signals: Signals | None = None
) -> Controller:
    """Return the controller; it follows `reference` instead of the configured one if it is given."""
    signals = signals or configured_signals(config)
    context = ControllerContext(
        config.timing.tick_s,
        reference or build_reference(config),
        build_limits(config, signals).command_max,
        initial_command(config, signals),
    )
    section = config.receiver
    controller: Controller = build_part(
        config, CONTROLLERS, section.controller, context, section.controller_options, Controller
    )
    return controller


def pid(config: FlightConfig, context: ControllerContext) -> Pid:
    """Return the PID law."""
    section = config.receiver.pid
    return Pid(
        PidGains(section.proportional, section.integral, section.derivative, section.unit),
        context.reference,
        context.tick_s,
        volts_max=context.volts_max,
        normal_force_volts=section.normal_force_volts,
        anti_windup=section.anti_windup,
    )


def recorded(config: FlightConfig, context: ControllerContext) -> RecordedController:
    """Return what gives the voltages of a recorded flight again."""
    return RecordedController(read_flight_log(config))


def build_reference(config: FlightConfig) -> Reference:
    """Return the set-point over the ticks."""
    return reference_of(config.receiver.reference, config.timing.tick_s)


def reference_of(section: ReferenceSection, tick_s: float) -> Reference:
    """Return the set-point that a section describes."""
    match section.kind:
        case "square":
            return Square(section.amplitude, section.period_s, tick_s)
        case "sine":
            return Sine(section.amplitude, section.period_s, tick_s)
        case "step":
            return Step(section.amplitude, section.start_s, tick_s)
        case "constant":
            return Constant(section.amplitude, tick_s)
        case "csv":
            if not section.file:
                raise ConfigError("receiver.reference.file names no file for the csv reference")
            try:
                return Csv(Path(section.file), tick_s)
            except ValueError as error:
                raise ConfigError(f"receiver.reference: {error}") from error
