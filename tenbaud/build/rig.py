"""The rig of a configuration, real or simulated."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from channel.codec.numerics import sin
from channel.codec.signals import Signals
from plant_sim.disturbance import parse_disturbance
from plant_sim.pitch import PitchParameters, PitchPlant
from plant_sim.plant import Plant, PlantContext
from tenbaud.build.flight import REAL_RIGS
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.plugins import build_part
from tenbaud.build.signals import (
    build_encoders,
    build_limits,
    configured_signals,
    safe_command,
)
from tenbaud.config.kinds import PLANTS
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.models import PitchModelSection
from tenbaud.config.rig_schema import AxisSection
from tenbaud.config.schema import FlightConfig, TransmitterSection
from tenbaud.log.units import turn_in
from transmitter.rigs.axes import Axis, Motors
from transmitter.rigs.base import Rig
from transmitter.rigs.device import DeviceRig, DeviceSettings, Wiring
from transmitter.rigs.formats.base import SerialFormat
from transmitter.rigs.simulated import DryRig, ReplayRig, SimulatedRig

THREE_AXES = ("travel", "pitch", "elevation")
"""Of the three-axis stand, whose encoders have sections of their own."""
SERIAL_OUTPUTS = 2
"""What the serial formats carry."""


def build_rig(config: FlightConfig, plant: Plant | None = None, signals: Signals | None = None) -> Rig:
    """Return the rig: a plant off the model by the configured mismatch, a recording, or a real one.

    `plant` takes the place of the configured one on the simulated rig, `signals` of those of the
    configured model.
    """
    section = config.transmitter
    signals = signals or configured_signals(config)
    if section.rig in REAL_RIGS:
        rig: Rig = build_device(config, not section.dry_run, signals)
    elif section.rig == "replay":
        rig = ReplayRig(read_flight_log(config, signals))
    else:
        plant = plant or build_plant(config, config.timing.tick_s, signals)
        names = [one.name for one in signals.outputs]
        encoders = build_encoders(config, signals)
        rig = SimulatedRig(plant, encoders, safe_command(config, signals), names)
    return DryRig(rig, len(signals.inputs)) if section.dry_run else rig


def build_device(config: FlightConfig, output: bool, signals: Signals | None = None) -> DeviceRig:
    """Return the real rig; with `output` False it never sends a command."""
    section = config.transmitter
    signals = signals or configured_signals(config)
    settings = DeviceSettings(
        stale_s=section.bridge.stale_s,
        first_sample_timeout_s=section.bridge.first_sample_timeout_s,
        rate_max_rad_per_s=section.bridge.rate_max_rad_per_s,
        output=output,
    )
    build = {"serial": _build_serial, "quarc": _build_quarc, "hil": _build_hil}.get(section.rig)
    if build is None:
        raise ConfigError(
            f"rig = {section.rig!r} is not a device; name one: --rig cobs:PORT, ascii:PORT, qsb:PORT, "
            "quarc:HOST:PORT, quarc-server:PORT or hil"
        )
    with config_errors(f"transmitter.{section.rig}"):
        return build(config, settings, signals)


def real_rig_name(section: TransmitterSection) -> str:
    """Return where a real rig is, in a few words."""
    match section.rig:
        case "serial":
            return f"rig at {section.serial.port}, {section.serial.format}"
        case "quarc":
            return f"QUARC model at {section.quarc.host}:{section.quarc.port}"
        case _:
            return f"Quanser {section.hil.card_type} {section.hil.card_identifier}"


def build_plant(config: FlightConfig, step_s: float, signals: Signals | None = None) -> Plant:
    """Return the simulated plant, off the codec's model by the mismatch, or one from outside.

    ConfigError where it has other outputs than the model.
    """
    signals = signals or configured_signals(config)
    section = config.transmitter.plant
    context = plant_context(config, step_s, signals)
    plant: Plant = build_part(config, PLANTS, config.plant_kind, context, section.options, Plant)
    measured, outputs = len(plant.measured), [one.name for one in signals.outputs]
    if measured != len(outputs):
        raise ConfigError(
            f"transmitter.plant.kind = {config.plant_kind!r} has {measured} output(s), and "
            f"model.kind = {config.model.kind!r} has {len(outputs)}: {', '.join(outputs)}"
        )
    return plant


def plant_context(config: FlightConfig, step_s: float, signals: Signals) -> PlantContext:
    """Return what a simulated plant is built with."""
    section = config.transmitter.plant
    disturbance = None
    if section.disturbance:
        with config_errors("transmitter.plant.disturbance"):
            disturbance = parse_disturbance(section.disturbance, step_s, config.seed)
    context = PlantContext(
        step_s,
        config.seed,
        build_limits(config, signals).command_max,
        section.mismatch,
        disturbance,
        section.initial_outputs,
        config.model.model_dump(exclude={"kind"}),
        sin,
        disturbance_text=section.disturbance,
        inputs=tuple([one.name for one in signals.inputs]),
        outputs=tuple([one.name for one in signals.outputs]),
    )
    if len(context.initial) > len(signals.outputs):
        raise ConfigError(
            f"transmitter.plant.initial has {len(context.initial)} values, and the plant "
            f"{len(signals.outputs)} output(s)"
        )
    return context


def pitch_plant(config: FlightConfig, context: PlantContext) -> PitchPlant:
    """Return the pitch axis."""
    with config_errors("transmitter.plant.disturbance"):
        (disturbance,) = context.disturbances(1) or (None,)
    return PitchPlant(
        nominal_plant(config, context.command_max[0]).mismatched(config.transmitter.plant.mismatch),
        context.step_s,
        disturbance,
        initial_angle_rad=context.initial[0] if context.initial else 0.0,
        sine=context.sine,
    )


def nominal_plant(config: FlightConfig, volts_max: float | None = None) -> PitchParameters:
    """Return the plant that the codec's model describes, or the one that is given beside it."""
    if volts_max is None:
        volts_max = build_limits(config, configured_signals(config)).command_max[0]
    model = config.model
    plant = config.transmitter.plant
    follows = isinstance(model, PitchModelSection) and plant.relative_to == "model"
    section = model if follows else plant.pitch
    return PitchParameters(**section.model_dump(exclude={"kind", "start"}), volts_max=volts_max)


def build_axes(config: FlightConfig, signals: Signals | None = None) -> tuple[Axis, ...]:
    """Return the encoders that are wired; ConfigError where an output of the model has none."""
    bridge = config.transmitter.bridge
    outputs = wired_outputs(signals or configured_signals(config))
    sections: dict[str, AxisSection] = {name: getattr(bridge, name) for name in THREE_AXES}
    names = bridge.axes
    if names is None:
        names = THREE_AXES if outputs.keys() <= sections.keys() else tuple(outputs)
    unused = [name for name in bridge.by_name if name not in names]
    if bridge.axes is None:
        unused += [name for name, own in sections.items() if name not in names and own != type(own)()]
    if unused:
        raise ConfigError(f"transmitter.bridge.{unused[0]}: the wired axes are {', '.join(names)}")
    sections = {name: AxisSection(channel=at) for at, name in enumerate(names)} | sections
    sections |= bridge.by_name
    if config.transmitter.rig == "serial" and config.transmitter.serial.format == "qsb":
        # One encoder per adapter, whatever channel it would have elsewhere.
        require_one_output(outputs)
        (name,) = outputs
        return (_axis(name, sections[name].model_copy(update={"channel": 0}), outputs[name]),)
    missing = ", ".join(sorted(outputs.keys() - set(names)))
    if missing or len(set(names)) != len(names):
        raise ConfigError(
            f"transmitter.bridge.axes = {list(names)}: {len(names)} encoder(s), and the model has "
            f"{len(outputs)} output(s): {missing or ', '.join(outputs)} must be among them, and none "
            "twice"
        )
    at: dict[int, str] = {}
    for name in outputs:
        channel = sections[name].channel
        if at.setdefault(channel, name) != name:
            raise ConfigError(
                f"transmitter.bridge: the outputs {at[channel]} and {name} are both on channel "
                f"{channel}; give each a channel of its own, transmitter.bridge.{name}.channel"
            )
    return tuple(_axis(name, sections[name], outputs.get(name, "rad")) for name in names)


def require_one_output(outputs: Collection[str]) -> None:
    """Raise ConfigError where an adapter of the format qsb, which has one encoder, is not enough."""
    if len(outputs) > 1:
        raise ConfigError(
            f"format qsb has one encoder, and the model has {len(outputs)} outputs: "
            f"{', '.join(outputs)}; take another format"
        )


def _axis(name: str, section: AxisSection, unit: str) -> Axis:
    zero = None if section.zero_counts == "first" else section.zero_counts
    counts, turn = (
        (section.counts_per_turn, turn_in(unit))
        if section.counts_per_unit is None
        else (section.counts_per_unit, 1.0)
    )
    if turn is None:
        raise ConfigError(
            f"transmitter.bridge.{name}: the output is in {unit}, which has no turns; give "
            "counts_per_unit"
        )
    return Axis(name, section.channel, counts, section.sign, zero, turn)


def build_motors(config: FlightConfig, signals: Signals, outputs: int) -> Motors:
    """Return how each input reaches a device of `outputs` outputs; ConfigError for unknown names."""
    section = config.transmitter.bridge.motors
    names = [one.name for one in signals.inputs]
    gain = section.amplifier_gain if section.unit == "dac_volts" else 1.0
    channels = list(range(len(names)) if section.channels is None else section.channels)
    signs = list((1,) * len(names) if section.signs is None else section.signs)
    gains = [gain] * len(names)
    place = "transmitter.bridge.motors"
    if not len(channels) == len(signs) == len(names):
        raise ConfigError(f"{place}: channels and signs have one for each input: {', '.join(names)}")
    for name, own in section.by_name.items():
        if name not in names:
            raise ConfigError(f"{place}.{name}: the plant's input(s) are {', '.join(names)}")
        at = names.index(name)
        channels[at], signs[at], gains[at] = own.channel, own.sign, 1.0 / own.scale
    if len(set(channels)) != len(channels):
        raise ConfigError(f"{place}: the inputs {', '.join(names)} are on the outputs {channels}")
    limit = section.device_volts_max
    return Motors(tuple(gains), tuple(channels), tuple(signs), limit, outputs)


def serial_format(config: FlightConfig) -> SerialFormat:
    """Return this end of the configured serial format."""
    from transmitter.rigs.formats.ascii import AsciiFormat
    from transmitter.rigs.formats.cobs import CobsFormat
    from transmitter.rigs.formats.qsb import QsbFormat

    section = config.transmitter.serial
    if section.format == "cobs":
        return CobsFormat()
    if section.format == "qsb":
        return QsbFormat()
    return AsciiFormat(section.columns, section.poll, section.command_style, section.pulse_full_volts)


def wired_outputs(signals: Signals) -> dict[str, str]:
    """Return the name and unit of each output; the one of a model that names none is the pitch."""
    outputs = {one.name: one.unit or "rad" for one in signals.outputs}
    return {"pitch": "rad"} if list(outputs) == ["output_1"] else outputs


def _wiring(config: FlightConfig, settings: DeviceSettings, signals: Signals, outputs: int) -> Wiring:
    """Return what hangs on a device of `outputs` outputs."""
    motors = build_motors(config, signals, outputs)
    return Wiring(build_axes(config, signals), tuple(wired_outputs(signals)), motors, settings)


def _build_serial(config: FlightConfig, settings: DeviceSettings, signals: Signals) -> DeviceRig:
    from transmitter.rigs.formats.ascii import AsciiFormat
    from transmitter.rigs.serial_bridge import BytePort, SerialBridge

    section = config.transmitter.serial
    if not section.port:
        raise ValueError("port names no serial port; write --rig cobs:/dev/ttyACM0")
    wiring = _wiring(config, settings, signals, SERIAL_OUTPUTS)
    channels = wiring.motors.channels
    if max(channels) >= SERIAL_OUTPUTS:
        raise ValueError(f"the serial formats carry outputs 0 and 1, not {max(channels)}")
    second = BytePort(section.motor_port, section.motor_line_baud) if section.motor_port else None
    return SerialBridge(
        BytePort(section.port, section.line_baud),
        serial_format(config),
        wiring,
        motor_port=second,
        motor_format=AsciiFormat() if second else None,
    )


def quarc_fields(config: FlightConfig, signals: Signals | None = None) -> tuple[str, ...]:
    """Return the fields of the model's vector, axes as the channels they have."""
    signals = signals or configured_signals(config)
    axes = {axis.name: f"c{axis.channel}" for axis in build_axes(config, signals)}
    given = config.transmitter.quarc.fields
    fields = tuple(axes.get(name, name) for name in (tuple(axes) if given is None else given))
    for name in fields:
        is_channel = len(name) == 2 and name[0] == "c" and name[1].isdigit()
        if not is_channel and name not in ("seq", "time_s", "flags", "-"):
            raise ConfigError(
                f"transmitter.quarc.fields: {name!r} is no wired axis, c0 to c9, seq, time_s, "
                "flags or -"
            )
    for name in wired_outputs(signals):
        if axes[name] not in fields:
            raise ConfigError(f"transmitter.quarc.fields: the output {name} is not among them")
    return fields


def quarc_commands(config: FlightConfig, signals: Signals | None = None) -> tuple[str, ...]:
    """Return the fields of the vector that the model takes, inputs as the outputs they are on."""
    signals = signals or configured_signals(config)
    channels = build_motors(config, signals, 0).channels
    names = {one.name: f"v{at}" for one, at in zip(signals.inputs, channels, strict=True)}
    given = config.transmitter.quarc.command_fields
    fields = tuple(names) if given is None else given
    for name in fields:
        if name not in (*names, "seq", "enable"):
            raise ConfigError(
                f"transmitter.quarc.command_fields: {name!r} is none of the inputs "
                f"({', '.join(names)}), seq or enable"
            )
    return tuple(names.get(name, name) for name in fields)


def _build_quarc(config: FlightConfig, settings: DeviceSettings, signals: Signals) -> DeviceRig:
    from transmitter.rigs.formats.doubles import DoublesLayout
    from transmitter.rigs.quarc import QuarcBridge

    section = config.transmitter.quarc
    fields = quarc_fields(config, signals)
    wiring = _wiring(config, settings, signals, 0)
    # An axis that the model does not send is not wired, as far as we are concerned.
    wiring = replace(wiring, axes=tuple(one for one in wiring.axes if f"c{one.channel}" in fields))
    per_turn = {axis.channel: int(axis.counts_per_turn) for axis in wiring.axes}
    layout = DoublesLayout(fields, section.byte_order, section.unit, per_turn)
    commands = quarc_commands(config, signals)
    return QuarcBridge(section.host, section.port, section.role, layout, commands, wiring)


def _build_hil(config: FlightConfig, settings: DeviceSettings, signals: Signals) -> DeviceRig:
    from transmitter.rigs.hil import HilRig, HilSettings

    hil = HilSettings(**config.transmitter.hil.model_dump())
    return HilRig(hil, _wiring(config, settings, signals, len(hil.analog_channels)))
