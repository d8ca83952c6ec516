"""The configuration of a real rig: its encoders, motors and connection."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tenbaud.config.section import Counts, NamedSections, Positive, Section

Channel = Annotated[int, Field(ge=0, le=9)]
Sign = Literal[-1, 1]


class AxisSection(Section):
    """One encoder."""

    channel: Channel = 0
    counts_per_turn: Annotated[int, Field(ge=2, le=10_000_000)] = 4096
    counts_per_unit: Positive | None = None
    """of an output that is no angle, in place of counts_per_turn"""
    sign: Sign = 1
    zero_counts: Counts | Literal["first"] = 0
    """counts at 0 rad; "first": those of the first sample, with the body at 0 rad then"""


class TravelSection(AxisSection):
    """The arm's turning about its post; it may go round and round."""

    counts_per_turn: Annotated[int, Field(ge=2, le=10_000_000)] = 8192


class PitchSection(AxisSection):
    """The body's tilt: the controlled axis."""

    channel: Channel = 1


class ElevationSection(AxisSection):
    """The arm's height. Its counts fall as it rises on the rigs that we know of."""

    channel: Channel = 2
    sign: Sign = -1


class MotorSection(Section):
    """One input of the plant."""

    channel: Channel = 0
    """output of the device"""
    sign: Sign = 1
    scale: Positive = 1.0
    """units of the device for one of the input"""


class MotorsSection(NamedSections):
    """The conversion of a command for the device; single inputs by name, in place of the lists."""

    unit: Literal["motor_volts", "dac_volts"] = "motor_volts"
    """what the device takes: volts at the motor, or before its amplifier"""
    amplifier_gain: Positive = 3.0
    """motor volts per output volt, used for dac_volts; a VoltPAQ has 3"""
    channels: tuple[Channel, ...] | None = None
    """output of each input; none: in their order"""
    signs: tuple[Sign, ...] | None = None
    """of each input; none: 1"""
    device_volts_max: Annotated[float, Field(ge=0.001, le=32.0)] = 10.0
    """what the device's output can give, in its own unit"""

    __pydantic_extra__: dict[str, MotorSection]


class BridgeSection(NamedSections):
    """Common settings of every real rig; encoders of other axes than these three by name."""

    travel: TravelSection = TravelSection()
    pitch: PitchSection = PitchSection()
    elevation: ElevationSection = ElevationSection()
    axes: tuple[str, ...] | None = None
    """those that are wired, the model's outputs among them; none: these three for a model whose outputs
    are among them, else the model's outputs"""
    motors: MotorsSection = MotorsSection()
    stale_s: Annotated[float, Field(ge=0.001, le=10.0)] = 0.1
    """age of the newest sample beyond which the sensor counts as lost"""
    first_sample_timeout_s: Annotated[float, Field(ge=0.01, le=120.0)] = 5.0
    rate_max_rad_per_s: Positive = 20.0
    """limit of an axis; a faster step of the counts is a jump"""

    __pydantic_extra__: dict[str, AxisSection]


class SerialSection(Section):
    """A serial line to the rig."""

    port: str = ""
    """/dev/ttyACM0, COM3, socket://host:port, rfc2217://host:port"""
    line_baud: Annotated[int, Field(ge=300, le=12_000_000)] = 115_200
    format: Literal["ascii", "cobs", "qsb"] = "cobs"
    columns: tuple[str, ...] = ("t_us", "travel", "pitch", "elevation")
    """ascii: columns of a plain line"""
    poll: str = ""
    """ascii: the request for a sample; empty if the device streams"""
    command_style: Literal["checked", "pulse"] = "checked"
    """ascii: `U,seq,v0,v1*HH`, or `o p0 p1` with pulse widths up to 255"""
    pulse_full_volts: Positive = 12.0
    motor_port: str = ""
    """a second line for commands in the checked style; needed for qsb, which has no outputs"""
    motor_line_baud: Annotated[int, Field(ge=300, le=12_000_000)] = 115_200


class QuarcSection(Section):
    """A running QUARC model, over TCP."""

    host: str = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65_535)] = 18_000
    role: Literal["client", "server"] = "client"
    """of this end; the model's Stream block has the other role"""
    byte_order: Literal["little", "big"] = "little"
    fields: tuple[str, ...] | None = None
    """of the vector that the model sends: names of axes, c0 ... c9, seq, time_s, flags, -; none: the
    axes that are wired"""
    unit: Literal["counts", "rad", "deg"] = "counts"
    """of its angles"""
    command_fields: tuple[str, ...] | None = None
    """of the vector that it receives: names of inputs, seq, enable; none: the inputs"""


class HilSection(Section):
    """A Quanser board."""

    card_type: str = "q8_usb"
    card_identifier: str = "0"
    sample_rate_hz: Annotated[float, Field(ge=0.1, le=8000.0)] = 500.0
    encoder_channels: tuple[Annotated[int, Field(ge=0, le=31)], ...] = (0, 1, 2)
    """of the board; the axes' channels count within this list"""
    analog_channels: tuple[Annotated[int, Field(ge=0, le=31)], ...] = (0, 1)
    enable_channels: tuple[Annotated[int, Field(ge=0, le=31)], ...] = ()
    """digital outputs that switch the amplifiers on"""
    watchdog_s: Annotated[float, Field(ge=0.001, le=5.0)] = 0.1
    card_options: str = ""
