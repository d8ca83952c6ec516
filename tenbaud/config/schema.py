"""The configuration of a flight: one TOML file for both ends.

The sections `timing`, `channel`, `model`, `coder` and `limits` are *shared*: both ends must have them
alike, and the handshake compares their digest. The others concern one end, or how it is run.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from pydantic import AfterValidator, Field, field_validator, model_validator

from channel.line.impairments import parse_impairments
from channel.links.registry import LINKS
from channel.protocol.sabotage import parse_sabotage
from tenbaud.config.coders import ZoomCoderSection
from tenbaud.config.deprecated import DIGEST_KINDS
from tenbaud.config.kinds import (
    CODERS,
    CONTROLLERS,
    MODELS,
    PLANTS,
    PartName,
    sections_of,
    union_of,
)
from tenbaud.config.models import PitchModelSection
from tenbaud.config.permission import CodePermission
from tenbaud.config.rig_schema import BridgeSection, HilSection, QuarcSection, SerialSection
from tenbaud.config.section import (
    Counts,
    Gain,
    KindSection,
    Mismatch,
    NotNegative,
    Options,
    Positive,
    Section,
    Volts,
)


def _checked_sabotage(text: str) -> str:
    if text:
        parse_sabotage(text)
    return text


SabotageText = Annotated[str, AfterValidator(_checked_sabotage)]

SHARED_SECTIONS = ("timing", "channel", "model", "coder", "limits")


class Timing(Section):
    """Ticks, samples and lead."""

    tick_s: Annotated[float, Field(ge=1e-5, le=1.0)] = 0.01
    """h: control tick"""
    symbol_period_s: Annotated[float, Field(ge=1e-5, le=60.0)] = 0.1
    """T_s: one word per this time; a whole number of ticks"""
    lead_ticks: Annotated[int, Field(ge=0, le=10_000)] | Literal["auto"] = "auto"
    """D: command lead; "auto": 0 where the virtual clock allows it, else the smallest that is safe"""

    @model_validator(mode="after")
    def _whole_ticks(self) -> Timing:
        ticks = self.symbol_period_s / self.tick_s
        if ticks < 0.5 or abs(ticks - round(ticks)) > 1e-6 * ticks:
            raise ValueError(
                f"symbol_period_s = {self.symbol_period_s:g} is {ticks:g} ticks of tick_s = "
                f"{self.tick_s:g}; it must be a whole number of them"
            )
        return self


class ChannelSection(Section):
    """Symbol rate and timing of the line."""

    rate_baud: Annotated[float, Field(ge=0.001, le=100_000.0)] = 10.0
    """R: symbols per second that may go up the link"""
    delivery: Literal["start", "end"] = "start"
    """a symbol arrives at the start of its slot (the paper), or at its end (a real wire)"""
    deadline_allowance_s: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.02
    """how long after its due time a symbol may arrive before its slot is erased"""
    downlink_budget_s: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.01
    """time reserved for a command frame to reach the plant"""
    repeats: Annotated[int, Field(ge=0, le=32)] = 2
    """W: earlier samples that each command frame repeats"""


if TYPE_CHECKING:
    ModelSection: TypeAlias = KindSection
    CoderSection: TypeAlias = KindSection
else:
    ModelSection = union_of(MODELS)
    CoderSection = union_of(CODERS)

KINDS: dict[str, dict[str, type[KindSection]]] = {
    "model": sections_of(MODELS),
    "coder": sections_of(CODERS),
}
"""Sections that come in kinds; the first kind is what a section without `kind` is."""


class Limits(Section):
    """Limits of a command; the receiver keeps them and the guard beside the motors checks them."""

    volts_max: Annotated[float, Field(ge=0.001, le=32.0)] = 5.0
    slew_volts_per_s: Positive = 1000.0
    initial_volts: tuple[Volts, Volts] = (0.0, 0.0)
    """command of the ticks before the first one decided"""


class PlantSection(Section):
    """The simulated plant, relative to the codec's model."""

    kind: Annotated[str, AfterValidator(PartName(PLANTS))] = "pitch"
    """the pitch axis, or a plant from outside"""
    options: Options = Field(default_factory=dict)
    """options of an external class"""
    relative_to: Literal["model", "pitch"] = "model"
    """the codec's model, so that the plant changes with it; or the constants in `pitch`"""
    pitch: PitchModelSection = PitchModelSection()
    """what the plant is relative to where the codec's model is none, or `relative_to` says so"""
    mismatch: Mismatch | tuple[Mismatch, Mismatch, Mismatch] = 0.0
    """fraction by which damping, stiffness and gain are off the model: 0.1 is 10 % more of each"""
    disturbance: str = ""
    """such as "q=2e-3,step=0.5@30": white torque density in rad^2/s^3, torque steps in rad/s^2"""
    initial_angle_rad: Annotated[float, Field(ge=-3.2, le=3.2)] = 0.0


class TransmitterSection(Section):
    """The sensor node."""

    rig: Literal["simulated", "replay", "serial", "quarc", "hil"] = "simulated"
    dry_run: bool = False
    """read the rig and never move it"""
    rate_observer_bandwidth_rad_s: Annotated[float, Field(ge=0.001, le=10_000.0)] = 30.0
    """bandwidth of the rate observer, for coders that use rates"""
    encoder_counts_per_turn: Annotated[int, Field(ge=2, le=10_000_000)] = 4096
    encoder_sign: Literal[-1, 1] = 1
    encoder_zero_counts: Counts = 0
    plant: PlantSection = PlantSection()
    watchdog_s: Positive | Literal["auto"] = "auto"
    """age of the last command after which the watchdog trips; "auto": the largest of 5 T_s,
    0.1 s, command lead + 2 T_s and round trip + 2 T_s"""
    ramp_s: Positive = 1.0
    """time from the held voltage to the safe one"""
    safe_volts: tuple[Volts, Volts] = (0.0, 0.0)
    soft_limit_rad: Positive | None = None
    """largest measured angle before the guard ramps down; none: no limit"""
    bridge: BridgeSection = BridgeSection()
    serial: SerialSection = SerialSection()
    quarc: QuarcSection = QuarcSection()
    hil: HilSection = HilSection()
    on_desync: Literal["rejoin", "stop"] = "rejoin"
    """after unequal digests: continue from a common state, or end the flight (exit code 5)"""
    sabotage: SabotageText = ""
    """such as "sample=500,field=range": corrupt one bit of this end's codec on purpose"""


class PidSection(Section):
    """PID law (24)."""

    proportional: Gain = 0.1
    integral: Gain = 0.053
    derivative: Gain = 0.12
    unit: Literal["V/rad", "V/deg"] = "V/deg"
    """the paper prints no unit; only V/deg follows its reference"""
    anti_windup: Literal["conditional", "none"] = "conditional"
    normal_force_volts: Volts = 0.0
    """w of (1), common to both motors"""


class ReferenceSection(Section):
    """The set-point of the controller."""

    kind: Literal["square", "step", "sine", "constant", "csv"] = "square"
    amplitude_rad: Annotated[float, Field(ge=-6.3, le=6.3)] = 1.5707963267948966
    period_s: Positive = 25.0
    start_s: NotNegative = 1.0
    """time of the step"""
    file: str = ""
    """for csv: columns time_s, angle_rad"""


class ReceiverSection(Section):
    """The controller node."""

    controller: Annotated[str, AfterValidator(PartName(CONTROLLERS))] = "pid"
    """the PID law, the voltages of a recorded flight, or a law from outside"""
    controller_options: Options = Field(default_factory=dict)
    """options of an external class"""
    pid: PidSection = PidSection()
    reference: ReferenceSection = ReferenceSection()
    sabotage: SabotageText = ""
    """such as "sample=500,field=range": corrupt one bit of this end's codec on purpose"""


class FlightLogSection(Section):
    """A recorded flight, for the replay rig and the recorded controller."""

    file: str = ""
    index_column: str = "step"
    counts_column: str = "pitch_counts"
    volts_columns: tuple[str, str] = ("right_volts", "left_volts")
    """front and rear motor; their difference pitches the body"""


class LinkSection(Section):
    """The link to the other end."""

    kind: Annotated[str, AfterValidator(PartName(LINKS))] = "zenoh"
    session: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+(/[A-Za-z0-9_.-]+)*$")] = "helicopter"
    peer_timeout_s: Annotated[float, Field(ge=0.01, le=3600.0)] = 10.0
    """silence after which the other end counts as lost"""
    port: str = ""
    """serial: this end's port, /dev/ttyUSB0, COM3, socket://HOST:PORT, rfc2217://HOST:PORT"""
    line_rate_baud: Annotated[int, Field(ge=50, le=10_000_000)] = 115_200
    """serial: bits per second on the line, ten of them for a byte"""
    downlink: str = ""
    """serial: "zenoh", or a second port for the commands; empty: the same line"""
    downlink_rate_baud: Annotated[int, Field(ge=50, le=10_000_000)] = 115_200
    """serial: of that second port"""
    best_effort: bool = False
    """Zenoh: a congested network may drop symbols instead of letting them wait"""
    options: Options = Field(default_factory=dict)
    """for a kind from an installed package"""
    impairments: str = ""
    """such as "loss=0.2,up:flip=0.01,delay=30ms±10ms": simulated impairments of the line"""

    @field_validator("impairments")
    @classmethod
    def _readable(cls, value: str) -> str:
        parse_impairments(value)
        return value


class TelemetrySection(Section):
    """Telemetry for viewers during the flight."""

    rate_hz: Annotated[float, Field(ge=0.01, le=100.0)] = 20.0
    """messages per second of each end"""


class FlightConfig(CodePermission):
    """Everything about a flight."""

    preset: str = "paper-10baud"
    """preset that the file is based on"""
    description: str = ""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    duration_s: Annotated[float, Field(ge=1e-5, le=1e7)] = 100.0
    timing: Timing = Timing()
    channel: ChannelSection = ChannelSection()
    model: ModelSection = PitchModelSection()
    coder: CoderSection = ZoomCoderSection()
    limits: Limits = Limits()
    transmitter: TransmitterSection = TransmitterSection()
    receiver: ReceiverSection = ReceiverSection()
    flight_log: FlightLogSection = FlightLogSection()
    link: LinkSection = LinkSection()
    telemetry: TelemetrySection = TelemetrySection()

    def shared_json(self, lead_ticks: int) -> str:
        """Return the shared part as canonical JSON, with the command lead that was chosen."""
        shared = self.model_dump(mode="json", include=set(SHARED_SECTIONS))
        shared["timing"]["lead_ticks"] = lead_ticks
        shared["coder"]["kind"] = DIGEST_KINDS.get(self.coder.kind, self.coder.kind)
        return json.dumps(shared, sort_keys=True, separators=(",", ":"))
