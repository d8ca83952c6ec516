"""The rig of a configuration, real or simulated."""

from __future__ import annotations

from channel.codec.numerics import sin
from plant_sim.disturbance import parse_disturbance
from plant_sim.encoder import Encoder
from plant_sim.pitch import PitchParameters, PitchPlant
from plant_sim.plant import Plant, PlantContext
from tenbaud.build.flight import REAL_RIGS, read_flight_log
from tenbaud.build.plugins import build_part
from tenbaud.config.kinds import PLANTS
from tenbaud.config.load import ConfigError
from tenbaud.config.models import PitchModelSection
from tenbaud.config.rig_schema import AxisSection
from tenbaud.config.schema import FlightConfig
from transmitter.rigs.axes import Axis, Motors
from transmitter.rigs.base import Rig
from transmitter.rigs.device import DeviceRig, DeviceSettings
from transmitter.rigs.formats.base import SerialFormat
from transmitter.rigs.simulated import DryRig, ReplayRig, SimulatedRig

MEASURED = ("pitch",)


def build_rig(config: FlightConfig, plant: Plant | None = None) -> Rig:
    """Return the rig: a plant off the model by the configured mismatch, a recording, or a real one.

    `plant` takes the place of the configured one on the simulated rig.
    """
    section = config.transmitter
    if section.rig in REAL_RIGS:
        rig: Rig = build_device(config, output=not section.dry_run)
    else:
        rig = _build_other(config, plant)
    return DryRig(rig) if section.dry_run else rig


def build_device(config: FlightConfig, output: bool) -> DeviceRig:
    """Return the real rig; with `output` False it never sends a command."""
    section = config.transmitter
    settings = DeviceSettings(
        stale_s=section.bridge.stale_s,
        first_sample_timeout_s=section.bridge.first_sample_timeout_s,
        rate_max_rad_per_s=section.bridge.rate_max_rad_per_s,
        output=output,
    )
    try:
        match section.rig:
            case "serial":
                return _build_serial(config, settings)
            case "quarc":
                return _build_quarc(config, settings)
            case "hil":
                return _build_hil(config, settings)
    except ValueError as error:
        raise ConfigError(f"transmitter.{section.rig}: {error}") from error
    raise ConfigError(
        f"rig = {section.rig!r} is no device; name one: --rig cobs:PORT, ascii:PORT, qsb:PORT, "
        "quarc:HOST:PORT, quarc-server:PORT or hil"
    )


def build_plant(config: FlightConfig, step_s: float) -> Plant:
    """Return the simulated plant, off the codec's model by the mismatch, or one from outside."""
    section = config.transmitter.plant
    disturbance = None
    if section.disturbance:
        try:
            disturbance = parse_disturbance(section.disturbance, step_s, config.seed)
        except ValueError as error:
            raise ConfigError(f"transmitter.plant.disturbance: {error}") from error
    context = PlantContext(
        step_s,
        config.seed,
        config.limits.volts_max,
        section.mismatch,
        disturbance,
        section.initial_angle_rad,
    )
    plant: Plant = build_part(config, PLANTS, section.kind, context, section.options, Plant)
    return plant


def pitch_plant(config: FlightConfig, context: PlantContext) -> PitchPlant:
    """Return the pitch axis."""
    return PitchPlant(
        nominal_plant(config).mismatched(config.transmitter.plant.mismatch),
        context.step_s,
        context.disturbance,
        initial_angle_rad=context.initial_angle_rad,
        # Not the C library's: a simulated flight is then the same on every machine.
        sine=sin,
    )


def nominal_plant(config: FlightConfig) -> PitchParameters:
    """Return the plant that the codec's model describes, or the one that is given beside it."""
    model = config.model
    plant = config.transmitter.plant
    follows = isinstance(model, PitchModelSection) and plant.relative_to == "model"
    section = model if follows else plant.pitch
    return PitchParameters(**section.model_dump(exclude={"kind"}), volts_max=config.limits.volts_max)


def _build_other(config: FlightConfig, plant: Plant | None) -> Rig:
    section = config.transmitter
    encoder = Encoder(
        section.encoder_counts_per_turn, section.encoder_sign, section.encoder_zero_counts
    )
    if section.rig == "replay":
        return ReplayRig(read_flight_log(config), (encoder,))
    if plant is None:
        plant = build_plant(config, config.timing.tick_s)
    return SimulatedRig(plant, (encoder,), section.safe_volts)


def build_axes(config: FlightConfig) -> tuple[Axis, ...]:
    """Return the encoders that are wired; ConfigError without the pitch."""
    bridge = config.transmitter.bridge
    names = bridge.axes
    if config.transmitter.rig == "serial" and config.transmitter.serial.format == "qsb":
        # One encoder per adapter: the pitch, whatever channel it would have elsewhere.
        return (_axis("pitch", bridge.pitch, 0),)
    if "pitch" not in names or len(set(names)) != len(names):
        raise ConfigError(
            f"transmitter.bridge.axes = {list(names)}: pitch must be among them, and none twice"
        )
    sections = {"travel": bridge.travel, "pitch": bridge.pitch, "elevation": bridge.elevation}
    return tuple(_axis(name, sections[name], sections[name].channel) for name in names)


def _axis(name: str, section: AxisSection, channel: int) -> Axis:
    zero = None if section.zero_counts == "first" else section.zero_counts
    return Axis(name, channel, section.counts_per_turn, section.sign, zero)


def _motors(config: FlightConfig) -> Motors:
    return Motors(**config.transmitter.bridge.motors.model_dump())


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


def _build_serial(config: FlightConfig, settings: DeviceSettings) -> DeviceRig:
    from transmitter.rigs.formats.ascii import AsciiFormat
    from transmitter.rigs.serial_bridge import BytePort, SerialBridge

    section = config.transmitter.serial
    if not section.port:
        raise ValueError("port names no serial port; write --rig cobs:/dev/ttyACM0")
    second = BytePort(section.motor_port, section.motor_line_baud) if section.motor_port else None
    return SerialBridge(
        BytePort(section.port, section.line_baud),
        serial_format(config),
        build_axes(config),
        MEASURED,
        _motors(config),
        settings,
        motor_port=second,
        motor_format=AsciiFormat() if second else None,
    )


def quarc_fields(config: FlightConfig) -> tuple[str, ...]:
    """Return the fields of the model's vector, axes as the channels they have."""
    axes = {axis.name: f"c{axis.channel}" for axis in build_axes(config)}
    fields = tuple(axes.get(name, name) for name in config.transmitter.quarc.fields)
    for name in fields:
        is_channel = len(name) == 2 and name[0] == "c" and name[1].isdigit()
        if not is_channel and name not in ("seq", "time_s", "flags", "-"):
            raise ConfigError(
                f"transmitter.quarc.fields: {name!r} is no wired axis, c0 to c9, seq, time_s, "
                "flags or -"
            )
    if not any(name == axes["pitch"] for name in fields):
        raise ConfigError("transmitter.quarc.fields: the pitch is not among them")
    return fields


def quarc_commands(config: FlightConfig) -> tuple[str, ...]:
    """Return the fields of the vector that the model takes, motors as the outputs they are on."""
    front, rear = config.transmitter.bridge.motors.channels
    names = {"front": f"v{front}", "rear": f"v{rear}"}
    return tuple(names.get(name, name) for name in config.transmitter.quarc.command_fields)


def _build_quarc(config: FlightConfig, settings: DeviceSettings) -> DeviceRig:
    from transmitter.rigs.formats.doubles import DoublesLayout
    from transmitter.rigs.quarc import QuarcBridge

    section = config.transmitter.quarc
    fields = quarc_fields(config)
    # An axis that the model does not send is not wired, as far as we are concerned.
    axes = tuple(axis for axis in build_axes(config) if f"c{axis.channel}" in fields)
    layout = DoublesLayout(
        fields,
        section.byte_order,
        section.unit,
        {axis.channel: axis.counts_per_turn for axis in axes},
    )
    return QuarcBridge(
        section.host,
        section.port,
        section.role,
        layout,
        quarc_commands(config),
        section.byte_order,
        axes,
        MEASURED,
        _motors(config),
        settings,
    )


def _build_hil(config: FlightConfig, settings: DeviceSettings) -> DeviceRig:
    from transmitter.rigs.hil import HilRig, HilSettings

    hil = HilSettings(**config.transmitter.hil.model_dump())
    return HilRig(hil, build_axes(config), MEASURED, _motors(config), settings)
