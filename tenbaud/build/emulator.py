"""The emulated rig of a configuration: the same plant with the interface of a real device."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Literal

from plant_sim.encoder import Encoder
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.rig import (
    build_axes,
    build_plant,
    quarc_commands,
    quarc_fields,
    require_one_output,
    wired_outputs,
)
from tenbaud.build.signals import configured_signals
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.schema import FlightConfig
from transmitter.rigs.axes import Axis
from transmitter.rigs.emulator.device import (
    CHANNELS,
    OFF,
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

MOTORS = len(OFF)
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
    if len(signals.outputs) > CHANNELS or len(signals.inputs) != MOTORS:
        raise ConfigError(
            f"the rig emulator has up to {CHANNELS} encoders and {MOTORS} motors, and model.kind = "
            f"{config.model.kind!r} has {len(signals.outputs)} output(s) and {len(signals.inputs)} "
            "input(s)"
        )
    if form not in DEFAULT_RATES:
        raise ConfigError(f"format {form!r}: one of {', '.join(DEFAULT_RATES)}")
    rate = DEFAULT_RATES[form] if samples_per_s is None else samples_per_s
    if not 1.0 <= rate <= 5000.0:
        raise ConfigError(f"{rate:g} samples/s: from 1 to 5000")
    axes = _axes(config, form)
    with config_errors():
        faulty = PITCH_CHANNEL if PITCH_CHANNEL in axes else next(iter(axes))
        broken = Faults(faults, config.seed)
        now_ns = time.monotonic_ns()
        device = EmulatedDevice(_body(config, axes), now_ns, watchdog_s, broken, faulty)
        line = parse_line(port, config.transmitter.serial.line_baud)
        speech = _speech(config, form, line_form, polled, axes)
    return RigEmulator(device, speech, line, rate)


def _axes(config: FlightConfig, form: EmulatedFormat) -> dict[int, Axis]:
    """Return the axis at each channel, in the order of the model's outputs."""
    outputs = wired_outputs(configured_signals(config))
    if form == "qsb":
        require_one_output(outputs)
    wired = {one.name: one for one in build_axes(config)}
    axes = [wired[name] for name in outputs]
    if form == "qsb":
        # One encoder per adapter; what it reads is the device's pitch.
        return {PITCH_CHANNEL: axes[0]}
    for axis in axes:
        if axis.channel >= CHANNELS:
            raise ConfigError(
                f"the rig emulator has the encoders 0 to {CHANNELS - 1}, and that of the output "
                f"{axis.name} is at {axis.channel}: set transmitter.bridge.{axis.name}.channel"
            )
    return {axis.channel: axis for axis in axes}


def _body(config: FlightConfig, axes: Mapping[int, Axis]) -> Body:
    encoders = {
        channel: Encoder(axis.counts_per_turn, axis.sign, axis.zero_counts or 0, axis.turn)
        for channel, axis in axes.items()
    }
    if config.transmitter.rig == "replay":
        return RecordedBody(read_flight_log(config), round(config.timing.tick_s * 1e9), encoders)
    return SimulatedBody(build_plant(config, STEP_S), round(STEP_S * 1e9), encoders)


def _speech(
    config: FlightConfig, form: EmulatedFormat, line_form: str, polled: bool, axes: Mapping[int, Axis]
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
        {at: scale_of(section.unit, int(axis.counts_per_turn)) for at, axis in axes.items()},
    )
