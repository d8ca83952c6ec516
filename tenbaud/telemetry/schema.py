"""The messages of the telemetry keys, described once: tests check each message against it.

`tenbaud view --schema` prints it as JSON schema; `docs/telemetry.schema.json` is that file.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, create_model, field_validator

from channel.line.impairments import parse_impairments
from channel.protocol.events import EVENT_CHANNEL, EventKind
from tenbaud.telemetry.common import SCHEMA_VERSION

SET_POINT_MAX = 1e6


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class SignalName(_Message):
    """One output or input of the plant."""

    name: str = Field(description="as the model names it")
    unit: str = Field(description="as a person writes it; empty: none")
    low: float | None = Field(description="smallest value that makes sense; null: not known")
    high: float | None = Field(description="largest value that makes sense; null: not known")


class PlantSignals(_Message):
    """What the lists of the messages hold, in this order."""

    model: str = Field(description="kind of the codec's model")
    picture: str = Field(description="what the plant looks like, see the model's signals; empty: bars")
    outputs: list[SignalName] = Field(description="what is measured and steered")
    inputs: list[SignalName] = Field(description="what a command has a value for")


class Point(_Message):
    """One tick as both the rig and the codec know it; the lists have a value per output."""

    time_s: float = Field(description="flight time")
    measured: list[float] = Field(description="as the sensors give them")
    true: list[float] | None = Field(description="true outputs, where the rig knows them")
    coded: list[float] = Field(description="the codec's estimate of that tick")
    live: list[float] | None = Field(description="the receiver's predicted estimate of it")
    range: list[float] = Field(description="ranges M of the coder at that tick")


class Decision(_Message):
    """One tick as the receiver decided it; the lists have a value per output."""

    time_s: float = Field(description="flight time")
    reference: list[float | None] = Field(description="set-points; null: it has none")
    live: list[float] = Field(description="estimate that the command was decided with")


class SentSample(_Message):
    """One sample whose word, as the receiver consumed it, the transmitter knows."""

    sample: int = Field(description="index of the sample")
    word_sent: list[int] | None = Field(description="symbols sent; null: none")
    word: list[int] | None = Field(description="symbols as the receiver consumed them; null: erased")
    about: list[int] | None = Field(
        description="place of the output that each symbol was about, by the codec; null: erased"
    )
    digest: str = Field(description="64-bit digest of the transmitter's copy after the sample")
    peer_digest: str = Field(description="the last digits that came of the receiver's; empty: none")


class TakenSample(_Message):
    """One sample as the receiver consumed it."""

    sample: int = Field(description="index of the sample")
    word: list[int] | None = Field(description="symbols consumed; null: erased")
    digest: str = Field(description="64-bit digest of the receiver's copy after the sample")


_TYPES: dict[str, Any] = {"number": float, "integer": int, "boolean": bool, "string": str}
_OF_EVENT: dict[str, Any] = {
    one.name: (_TYPES[one.type] | None, Field(None, description=one.description))
    for one in EVENT_CHANNEL.fields
} | {
    "time_s": (float, Field(description="flight time")),
    "kind": (EventKind, Field(description="what happened")),
}
Happening: Any = create_model("Happening", __base__=_Message, **_OF_EVENT)
Happening.__doc__ = "An event, as recordings have it; fields without meaning for its kind are left out."


class Lateness(_Message):
    """How late the last ticks of the loop began."""

    p50_ms: float = Field(description="median")
    p99_ms: float = Field(description="of 99 ticks in 100, at most")
    max_ms: float = Field(description="largest")


class _EndMessage(_Message):
    version: Literal[3] = Field(description="of this schema")
    session: str = Field(description="name of the session")
    plant: PlantSignals = Field(description="its model and signals")
    flight: int = Field(description="number of the session, 0 while there is none")
    number: int = Field(description="counts the messages of this end")
    phase: Literal["greeting", "waiting", "flying", "rejoining", "ended"] = Field(
        description="where the session stands"
    )
    ending: str | None = Field(None, description="how the session ended, by name; null: not yet")
    clock: Literal["real", "virtual"] = Field(description="virtual: as fast as possible, or at `pace`")
    takes_commands: bool = Field(description="whether the flight was started with control allowed")
    time_s: float = Field(description="flight time reached")
    epoch: int = Field(description="counts the common states that the two ends began from")
    impairments: str = Field(description="what goes wrong on the line, on purpose, at present")
    counts: dict[str, int] = Field(description="erasures, desyncs, rejoins and others, so far")
    events: list[Happening] = Field(description="since the message before")
    dropped: int = Field(description="messages and rows of telemetry left out so far")


class Confirmation(_Message):
    """What the transmitter of a narrow downlink knows of the receiver's state."""

    sample: int = Field(description="the last one whose down symbols came or were given up")
    confirmed_to: int = Field(description="the first sample that is not certain")
    size: int = Field(description="hypotheses, copies of the state, that are followed")
    rest: float = Field(description="weight of what is not followed, in units of theirs")
    hash_symbols: int | None = Field(
        description="hash bits that came, of confirmed samples; a difference of the states stays "
        "unseen for n of them with a probability of 2^-n; null: not counted"
    )
    baud_measured: float | None = Field(
        description="down symbols per second on this end's clock, over the last 5 s"
    )
    baud_configured: float = Field(description="down symbols per second that the line may carry")
    is_mirrored: bool = Field(description="whether the law runs beside the plant too")


class TransmitterTelemetry(_EndMessage):
    """The telemetry of the sensor node."""

    role: Literal["transmitter"]
    preset: str = Field(description="that the configuration is based on")
    tick_s: float = Field(description="control tick")
    symbol_period_s: float = Field(description="time of a sample, which has one word")
    baud_configured: float = Field(description="symbols per second that may go up the link")
    duration_s: float = Field(description="of the whole flight as configured")
    points: list[Point] = Field(description="ticks since the message before, some left out")
    samples: list[SentSample] = Field(description="confirmed since the message before")
    guard: str = Field(description="state of the guard")
    applied: list[float] | None = Field(description="what each input was given last")
    lateness: Lateness | None = Field(description="null on the virtual clock")
    paused: bool = Field(description="the virtual clock stands still")
    pace: float | None = Field(description="virtual seconds per second at most; null: unlimited")
    gap_to_floor: float | None = Field(
        default=None, description="estimation error over the least that any coder could reach"
    )
    narrow: Confirmation | None = Field(default=None, description="null: another downlink")
    learned: dict[str, tuple[float, float]] = Field(
        default_factory=dict,
        description="of each term that the codec learns: its relative error (a force: the force), and "
        "the standard deviation that both ends assume of it",
    )


class ReceiverTelemetry(_EndMessage):
    """The telemetry of the controller node."""

    role: Literal["receiver"]
    baud_measured: float | None = Field(
        description="symbols per second on this end's clock, over the last 5 s"
    )
    points: list[Decision] = Field(description="ticks since the message before, some left out")
    samples: list[TakenSample] = Field(description="consumed since the message before")
    set_points: list[float | None] = Field(
        description="given by hand, of each output; null: the reference is followed"
    )
    steerable: list[bool] = Field(description="whether the set-point of each output can be given")


class SetPoint(_Message):
    """Steer an output to a value, or (null) follow the configured reference again."""

    kind: Literal["set_point"]
    value: Annotated[float, Field(ge=-SET_POINT_MAX, le=SET_POINT_MAX)] | None = Field(
        description="in the output's unit"
    )
    output: Annotated[int, Field(ge=0, description="place of the output, from 0")] = 0


class Pause(_Message):
    """Stop the virtual clock at the next sample, or let it go on."""

    kind: Literal["pause"]
    paused: bool = Field(description="false: go on")


class Step(_Message):
    """Let a number of samples pass on the virtual clock, then pause."""

    kind: Literal["step"]
    samples: Annotated[int, Field(ge=1, le=1000, description="how many")] = 1


class Pace(_Message):
    """Virtual seconds per second, at most."""

    kind: Literal["pace"]
    factor: Annotated[float, Field(ge=0.05, le=1000.0, description="multiple of real time")]


class Impair(_Message):
    """All impairments of the line from now on; an empty text for a clean line."""

    kind: Literal["impair"]
    text: Annotated[str, Field(max_length=300, description="as `--impair` takes it")]

    @field_validator("text")
    @classmethod
    def _readable(cls, value: str) -> str:
        faults = parse_impairments(value)
        if faults.skew_ppm or faults.clock_steps:
            raise ValueError("the receiver's clock cannot be changed in flight")
        return value


class Corrupt(_Message):
    """Corrupt the codec of one end in one bit, at its next sample."""

    kind: Literal["corrupt"]
    end: Literal["transmitter", "receiver"] = Field(description="whose codec")
    field: Annotated[str, Field(pattern=r"^(range|angle|rate)$", description="of its state")] = "range"


Telemetry = TransmitterTelemetry | ReceiverTelemetry
Command = SetPoint | Pause | Step | Pace | Impair | Corrupt

TELEMETRY: TypeAdapter[Telemetry] = TypeAdapter(Annotated[Telemetry, Field(discriminator="role")])
COMMAND: TypeAdapter[Command] = TypeAdapter(Annotated[Command, Field(discriminator="kind")])


def schema_json() -> dict[str, Any]:
    """Return the JSON schema of both kinds of message."""
    definitions: dict[str, Any] = {}
    parts = {}
    for name, adapter in (("telemetry", TELEMETRY), ("control", COMMAND)):
        schema = adapter.json_schema(ref_template="#/$defs/{model}")
        definitions |= schema.pop("$defs", {})
        parts[name] = schema
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "tenbaud telemetry",
        "description": "Keys tenbaud/NAME/telemetry/ROLE and tenbaud/NAME/control",
        "version": SCHEMA_VERSION,
        "properties": parts,
        "$defs": definitions,
    }
