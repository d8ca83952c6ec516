"""The configuration of a real rig: its encoders and motors, and the way to it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from tenbaud.config.section import Counts, Positive, Section

Channel = Annotated[int, Field(ge=0, le=9)]
Sign = Literal[-1, 1]


class AxisSection(Section):
    """One encoder."""

    channel: Channel = 0
    counts_per_turn: Annotated[int, Field(ge=2, le=10_000_000)] = 4096
    sign: Sign = 1
    zero_counts: Counts | Literal["first"] = 0
    """counts at 0 rad; "first": those of the first sample, with the body at 0 rad then"""


class TravelSection(AxisSection):
    """The arm's turning about its post; it may go round and round."""

    counts_per_turn: Annotated[int, Field(ge=2, le=10_000_000)] = 8192


class PitchSection(AxisSection):
    """The body's tilt: the axis that is flown."""

    channel: Channel = 1


class ElevationSection(AxisSection):
    """The arm's height. Its counts fall as it rises on the rigs that we know of."""

    channel: Channel = 2
    sign: Sign = -1


class MotorsSection(Section):
    """The conversion of a motor voltage for the device."""

    unit: Literal["motor_volts", "dac_volts"] = "motor_volts"
    """what the device takes: volts at the motor, or before its amplifier"""
    amplifier_gain: Positive = 3.0
    """motor volts per output volt, used for dac_volts; a VoltPAQ has 3"""
    channels: tuple[Channel, Channel] = (0, 1)
    """output of the front motor, of the rear motor"""
    signs: tuple[Sign, Sign] = (1, 1)
    device_volts_max: Annotated[float, Field(ge=0.001, le=32.0)] = 10.0
    """what the device's output can give, in its own unit"""


class BridgeSection(Section):
    """Common settings of every real rig."""

    travel: TravelSection = TravelSection()
    pitch: PitchSection = PitchSection()
    elevation: ElevationSection = ElevationSection()
    axes: tuple[Literal["travel", "pitch", "elevation"], ...] = ("travel", "pitch", "elevation")
    """those that are wired; pitch must be among them"""
    motors: MotorsSection = MotorsSection()
    stale_s: Annotated[float, Field(ge=0.001, le=10.0)] = 0.1
    """age of the newest sample beyond which the sensor counts as lost"""
    first_sample_timeout_s: Annotated[float, Field(ge=0.01, le=120.0)] = 5.0
    rate_max_rad_per_s: Positive = 20.0
    """faster than any axis turns; a step of the counts beyond it is a jump"""


class SerialSection(Section):
    """A serial line to the rig."""

    port: str = ""
    """/dev/ttyACM0, COM3, socket://host:port, rfc2217://host:port"""
    line_baud: Annotated[int, Field(ge=300, le=12_000_000)] = 115_200
    format: Literal["ascii", "cobs", "qsb"] = "cobs"
    columns: tuple[str, ...] = ("t_us", "travel", "pitch", "elevation")
    """ascii: what the columns of a plain line are"""
    poll: str = ""
    """ascii: what asks for a sample; empty where the device streams"""
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
    """what this end is; the model's Stream block is the other"""
    byte_order: Literal["little", "big"] = "little"
    fields: tuple[str, ...] = ("travel", "pitch", "elevation")
    """of the vector that the model sends: travel, pitch, elevation, c0 ... c9, seq, time_s,
    flags, -"""
    unit: Literal["counts", "rad", "deg"] = "counts"
    """of its angles"""
    command_fields: tuple[Literal["front", "rear", "seq", "enable"], ...] = ("front", "rear")
    """of the vector that it takes"""


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
