"""The configuration of a flight: one TOML file for both ends.

The sections `timing`, `channel`, `model`, `coder` and `limits` are *shared*: both ends must have them
alike, and the handshake compares their digest; so is `downlink` where the downlink is narrow. The
others concern one end, or how it is run.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, Field, PrivateAttr, field_validator, model_validator

from channel.line.impairments import parse_impairments
from channel.links.registry import LINKS
from channel.protocol.identity import LEFT_OUT
from channel.protocol.terms import Rung
from tenbaud.config.coders import ZoomCoderSection
from tenbaud.config.controllers import PidSection, ReferencesSection, StateFeedbackSection
from tenbaud.config.deprecated import DIGEST_KINDS
from tenbaud.config.downlink import DownlinkSection
from tenbaud.config.kinds import (
    CODERS,
    CONTROLLERS,
    MODELS,
    PLANTS,
    PartName,
    kind_of,
    sections_of,
    union_of,
)
from tenbaud.config.models import PitchModelSection
from tenbaud.config.rig_schema import BridgeSection, HilSection, QuarcSection, SerialSection
from tenbaud.config.section import (
    CodePermission,
    Command,
    Counts,
    Factor,
    KindSection,
    Mismatch,
    NamedSections,
    Options,
    OutsideSection,
    Positive,
    SabotageText,
    Section,
)

PerOutput: TypeAlias = Positive | tuple[Positive, ...] | dict[str, Positive] | None
"""A number for all outputs, a list with one for each, or a table by name."""
SHARED_SECTIONS = ("timing", "channel", "model", "coder", "limits")
ADDED_FIELDS = {"start", "travel_stop_rad", "outputs", "floor_gain", "floor_exponent", "learns"}
"""Of models and coders that were flown before they had them."""


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
    downlink: Rung = "full"
    """full: a command for every tick; compact: one for each sample, in frames of 16 bytes for two
    motors, two repeats and words of one symbol; narrow: single bits, as `[downlink]` says"""
    downlink_baud: Annotated[float, Field(ge=0.001, le=100_000.0)] = 20.0
    """R_d: symbols per second that may go down the narrow downlink"""


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
    """Limits of commands and set-points; the receiver applies them.

    The guard beside the motors checks those of commands: a number for all inputs or a list with one for
    each, in the unit of the input.
    """

    command_max: Positive | tuple[Positive, ...] | None = None
    """largest value of an input, either way; none: the input's own range, or 5 where it has none"""
    command_slew_per_s: Positive | tuple[Positive, ...] = 1000.0
    """fastest change of an input; on the compact downlink a command changes once a sample, and by one
    tick's share: N times slower"""
    initial_command: Command = 0.0
    """command until the first one from the receiver"""
    set_point_max: PerOutput = None
    """largest set-point of an output, either way: a number for all outputs, a list with one for each,
    or a table by name; none: no limit"""
    set_point_slew_per_s: PerOutput = None
    """fastest change of a set-point, from the output at the model's start on; none: no limit"""


class PlantSection(Section):
    """The simulated plant, relative to the codec's model."""

    kind: Annotated[str, AfterValidator(PartName(PLANTS, also="auto"))] = "auto"
    """built-in, an FMU (machine code in a file) or external; "auto": that of the codec's model"""
    options: Options = Field(default_factory=dict)
    """what the plant's class is built with"""
    relative_to: Literal["model", "pitch"] = "model"
    """the codec's model, so that the plant changes with it; or the constants in `pitch`"""
    pitch: PitchModelSection = PitchModelSection()
    """what the plant is relative to where the codec's model is none, or `relative_to` says so"""
    mismatch: Mismatch | tuple[Mismatch, Mismatch, Mismatch] = 0.0
    """fraction by which damping, stiffness and gain differ from the model: 0.1 is 10 % more of each"""
    disturbance: str = ""
    """such as "q=2e-3,step=0.5@30": white torque density in rad^2/s^3, torque steps in rad/s^2"""
    initial: Command = ()
    """outputs at the start: a number for the first, or a list; empty: the plant's own start"""

    @property
    def initial_outputs(self) -> tuple[float, ...]:
        """Return the outputs at the start, as far as they are given."""
        return self.initial if isinstance(self.initial, tuple) else (self.initial,)


class EncoderSection(Section):
    """The encoder of an output."""

    counts_per_turn: Annotated[int, Field(ge=2, le=10_000_000)] | None = None
    """of an angle; none: 4096"""
    counts_per_unit: Positive | None = None
    """of any other output: counts per metre, per rad/s; none: it is read exactly"""
    sign: Literal[-1, 1] = 1
    zero_counts: Counts = 0
    """counts at 0"""
    quantised: bool = True
    """false: the output is read exactly"""


class EncodersSection(EncoderSection, NamedSections):
    """The encoders of a simulated rig or a replay: those of all outputs, and single ones by name."""

    __pydantic_extra__: dict[str, EncoderSection]


class TransmitterSection(Section):
    """The sensor node."""

    rig: Literal["simulated", "replay", "serial", "quarc", "hil"] = "simulated"
    dry_run: bool = False
    """read the rig, send no commands"""
    rate_observer_bandwidth_rad_s: Annotated[float, Field(ge=0.001, le=10_000.0)] = 30.0
    """bandwidth of the rate observer, for the coder `history`; `direction` has a Kalman filter"""
    encoders: EncodersSection = EncodersSection()
    plant: PlantSection = PlantSection()
    watchdog_s: Positive | Literal["auto"] = "auto"
    """age of the last command after which the watchdog trips; "auto": the largest of 5 T_s,
    0.1 s, command lead + 2 T_s and round trip + 2 T_s"""
    ramp_s: Positive = 1.0
    """time from the held command to the safe one"""
    safe_command: Command = 0.0
    """a number for all inputs, or a list with one for each"""
    soft_limits: PerOutput = None
    """largest measured value before the guard ramps down: a number for all outputs, a list with one for
    each, or a table by name; none: no limit"""
    bridge: BridgeSection = BridgeSection()
    serial: SerialSection = SerialSection()
    quarc: QuarcSection = QuarcSection()
    hil: HilSection = HilSection()
    on_desync: Literal["rejoin", "stop"] = "rejoin"
    """after unequal digests: continue from a common state, or end the flight (exit code 5)"""
    sabotage: SabotageText = ""
    """such as "sample=500,field=range": corrupt one bit of this end's codec on purpose"""


class ReceiverSection(Section):
    """The controller node."""

    controller: Annotated[str, AfterValidator(PartName(CONTROLLERS))] = "pid"
    """the PID law, feedback of all states, the commands of a recorded flight, or an external law"""
    controller_options: Options = Field(default_factory=dict)
    """options of an external class"""
    pid: PidSection = PidSection()
    state_feedback: StateFeedbackSection = StateFeedbackSection()
    reference: ReferencesSection = ReferencesSection()
    sabotage: SabotageText = ""
    """such as "sample=500,field=range": corrupt one bit of this end's codec on purpose"""


class FlightLogSection(Section):
    """A recorded flight: its file and columns. FILE.toml beside it may hold the same."""

    file: str = ""
    join: tuple[str, ...] = ()
    """further files, whose columns are joined by time"""
    columns: dict[str, str] = Field(default_factory=dict)
    """column, by name or number, of a signal, `angle`, `output`, `input`, `time` or `index` (it counts
    rows, `period_s` apart); "0": no such input. The others are guessed from the names"""
    period_s: Annotated[float, Field(ge=1e-6, le=1e6)] | None = None
    """time between two rows of a file without a clock; none: timing.tick_s"""
    units: dict[str, str] = Field(default_factory=dict)
    """of a signal, of all outputs (`angles`), or of `time`: rad, deg, counts, mV, ms ...; none: as the
    file says, or as the model's"""
    signs: dict[str, Literal[-1, 1]] = Field(default_factory=dict)
    scales: dict[str, Factor] = Field(default_factory=dict)
    offsets: dict[str, Factor] = Field(default_factory=dict)
    """value = sign * scale * number + offset, then the unit"""
    start_s: Annotated[float, Field(ge=-2.4e9, le=2.4e9)] | None = None
    """on the file's own clock; earlier rows are ignored"""
    end_s: Annotated[float, Field(ge=-2.4e9, le=2.4e9)] | None = None
    remove_spikes: bool = False
    """replace single outlier rows by the mean of their neighbours"""
    digest: str = ""
    """of ticks, rows and commands, for the handshake; a replay computes it"""


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
    """Zenoh: a congested network may drop symbols instead of delaying them"""
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
    mission: str = ""
    """settings of the package over the preset: `square`, or `two-boxes`, which takes off and lands"""
    description: str = ""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    duration_s: Annotated[float, Field(ge=1e-5, le=1e7)] = 100.0
    timing: Timing = Timing()
    channel: ChannelSection = ChannelSection()
    model: ModelSection = PitchModelSection()
    coder: CoderSection = ZoomCoderSection()
    limits: Limits = Limits()
    downlink: DownlinkSection = DownlinkSection()
    transmitter: TransmitterSection = TransmitterSection()
    receiver: ReceiverSection = ReceiverSection()
    flight_log: FlightLogSection = FlightLogSection()
    link: LinkSection = LinkSection()
    telemetry: TelemetrySection = TelemetrySection()
    _notes: tuple[str, ...] = PrivateAttr(default=())
    _given: frozenset[str] = PrivateAttr(default=frozenset())

    @property
    def notes(self) -> tuple[str, ...]:
        """Return what of the settings was changed, for people; what goes through text forgets it."""
        return self._notes

    def noting(self, *notes: str) -> FlightConfig:
        """Return the same configuration with notes."""
        noted = self.model_copy()
        noted._notes = notes
        return noted

    @property
    def given(self) -> frozenset[str]:
        """Return the full names of the settings that a person gave; through text they are forgotten."""
        return self._given

    def giving(self, names: Iterable[str]) -> FlightConfig:
        """Return the same configuration with the names of the settings that were given."""
        marked = self.model_copy()
        marked._given = frozenset(names)
        return marked

    @property
    def plant_kind(self) -> str:
        kind = self.transmitter.plant.kind
        if kind != "auto":
            return kind
        outside = isinstance(self.model, OutsideSection)
        return "pitch" if outside else kind_of(MODELS, self.model.kind).plant

    def shared_json(self, lead_ticks: int, downlink: Mapping[str, Any] | None = None) -> str:
        """Return the shared part as canonical JSON, with the command lead that was chosen.

        `downlink` is the narrow one as it was built.
        """
        shared = self.model_dump(mode="json", include=set(SHARED_SECTIONS))
        shared["timing"]["lead_ticks"] = lead_ticks
        for name, section in (("model", self.model), ("coder", self.coder)):
            fields = type(section).model_fields
            added = {"learns"} if section.kind == "linear" else ADDED_FIELDS
            for field in added & fields.keys():
                if getattr(section, field) == fields[field].default:
                    del shared[name][field]  # recordings from before it have the same digest
        for field in ("set_point_max", "set_point_slew_per_s"):
            if shared["limits"][field] is None:
                del shared["limits"][field]  # likewise
        if downlink is not None:
            shared["downlink"] = downlink
        else:
            del shared["channel"]["downlink_baud"]
        for place, value in LEFT_OUT.items():
            name, field = place.split(".")
            if shared[name][field] == value:
                del shared[name][field]
        if self.flight_log.digest:
            shared["flight_log"] = {"digest": self.flight_log.digest}
        shared["coder"]["kind"] = DIGEST_KINDS.get(self.coder.kind, self.coder.kind)
        return json.dumps(shared, sort_keys=True, separators=(",", ":"))
