"""An emulated rig of a configuration: the same plant, talking like a real device."""

from __future__ import annotations

import time
from typing import Literal

from plant_sim.encoder import Encoder
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.rig import build_axes, build_plant, quarc_commands, quarc_fields, wired_outputs
from tenbaud.build.signals import configured_signals
from tenbaud.config.load import ConfigError
from tenbaud.config.schema import FlightConfig
from transmitter.rigs.axes import Axis
from transmitter.rigs.emulator.device import (
    PITCH_CHANNEL,
    Body,
    EmulatedDevice,
    RecordedBody,
    RigEmulator,
    SimulatedBody,
)
from transmitter.rigs.emulator.faults import Faults
from transmitter.rigs.emulator.line import parse_line
from transmitter.rigs.emulator.speech import (
    AsciiSpeech,
    CobsSpeech,
    DoublesSpeech,
    QsbSpeech,
    Speech,
)
from transmitter.rigs.quarc import scale_of

EmulatedFormat = Literal["ascii", "cobs", "quarc", "qsb"]
STEP_S = 0.001
DEFAULT_RATES = {"ascii": 300.0, "cobs": 480.0, "quarc": 500.0, "qsb": 500.0}
"""Samples per second: what 115200 baud carries of the first two."""


def build_emulator(
    config: FlightConfig,
    form: EmulatedFormat,
    port: str,
    *,
    line_form: str = "checked",
    polled: bool = False,
    samples_per_s: float | None = None,
    watchdog_s: float = 0.1,
    faults: tuple[str, ...] = (),
) -> RigEmulator:
    """Return an emulator that is not yet on its line; ConfigError for settings that cannot be."""
    signals = configured_signals(config)
    if len(signals.outputs) != 1 or len(signals.inputs) != 2:
        raise ConfigError(
            "the rig emulator has the pitch axis and its two motors only, and model.kind = "
            f"{config.model.kind!r} is another plant"
        )
    if form not in DEFAULT_RATES:
        raise ConfigError(f"format {form!r}: one of {', '.join(DEFAULT_RATES)}")
    rate = DEFAULT_RATES[form] if samples_per_s is None else samples_per_s
    if not 1.0 <= rate <= 5000.0:
        raise ConfigError(f"{rate:g} samples/s: from 1 to 5000")
    axis = _axis(config, form)
    try:
        device = EmulatedDevice(
            _body(config, axis), time.monotonic_ns(), watchdog_s, Faults(faults, config.seed)
        )
        line = parse_line(port, config.transmitter.serial.line_baud)
        speech = _speech(config, form, line_form, polled, axis)
    except ValueError as error:
        raise ConfigError(str(error)) from error
    return RigEmulator(device, speech, line, rate)


def _axis(config: FlightConfig, form: EmulatedFormat) -> Axis:
    """Return the encoder of the one output, whatever it is called."""
    (name,) = wired_outputs(configured_signals(config))
    axis = next(one for one in build_axes(config) if one.name == name)
    if form != "qsb" and axis.channel != PITCH_CHANNEL:
        raise ConfigError(
            f"the rig emulator turns the encoder at channel {PITCH_CHANNEL}, and that of the output "
            f"{name} is at {axis.channel}: set transmitter.bridge.{name}.channel = {PITCH_CHANNEL}"
        )
    return axis


def _body(config: FlightConfig, axis: Axis) -> Body:
    encoder = Encoder(axis.counts_per_turn, axis.sign, axis.zero_counts or 0, axis.turn)
    if config.transmitter.rig == "replay":
        return RecordedBody(read_flight_log(config), round(config.timing.tick_s * 1e9), encoder)
    return SimulatedBody(build_plant(config, STEP_S), round(STEP_S * 1e9), encoder)


def _speech(
    config: FlightConfig, form: EmulatedFormat, line_form: str, polled: bool, axis: Axis
) -> Speech:
    match form:
        case "cobs":
            return CobsSpeech()
        case "ascii":
            return AsciiSpeech(line_form, polled)
        case "qsb":
            return QsbSpeech()
    section = config.transmitter.quarc
    return DoublesSpeech(
        quarc_fields(config),
        quarc_commands(config),
        section.byte_order,
        scale_of(section.unit, int(axis.counts_per_turn)),
    )
