"""What the study flies: the pitch axis and the helicopter of the presets, 10 % off their models."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import Any

from channel.codec.codec import Codec, Vector
from channel.codec.downlink.coded import CodedCommands, CodedDirection, held_inputs
from channel.codec.downlink.laws import MirroredFeedback, MirroredLoop, MirroredPid
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay
from channel.codec.downlink.mirrored import Law, MirroredLaw, SetPointRange
from channel.codec.downlink.scheme import Scheme
from receiver.controllers.pid import PidLoops
from receiver.controllers.state_feedback import StateFeedback
from reproduction.bothways.flights import Body, Targets, Wants
from tenbaud.build.codec import build_codec
from tenbaud.build.controllers import build_controller
from tenbaud.build.ends import build_observer
from tenbaud.build.flight import agree
from tenbaud.build.references import build_references
from tenbaud.build.rig import build_rig
from tenbaud.build.signals import build_limits, configured_signals, initial_command
from tenbaud.config.load import load_config
from tenbaud.config.schema import FlightConfig
from transmitter.rigs.base import Rig

SCHEMES = ("announced", "live", "coded")
BITS = 9


class RigBody:
    """A `Body`: the simulated rig of a configuration, with the observer of its transmitter."""

    def __init__(self, config: FlightConfig) -> None:
        self._rig: Rig = build_rig(config)
        agreement = agree(config, "virtual")
        self._observer = build_observer(agreement)
        self._tick = 0
        self._read(agreement.terms.initial_command)

    def _read(self, held: Vector) -> None:
        reading = self._rig.read(self._tick)
        assert reading is not None
        assert reading.true is not None
        self.measured, self.true = reading.measured, reading.true
        if self._observer is not None:
            self.measured = self._observer.look(self._tick, reading.measured, held)

    def step(self, command: Vector) -> None:
        self._rig.write(self._tick, command)
        self._tick += 1
        self._read(command)


@dataclass(frozen=True)
class Subject:
    """A plant of the study. Outputs with a set-point come first."""

    name: str
    preset: str
    settings: dict[str, Any]
    ranges: tuple[tuple[float, float], ...]
    """of the set-points of these outputs"""
    directions: tuple[CodedDirection, ...]

    def config(self, seed: int = 1) -> FlightConfig:
        return load_config(self.preset, None, {"seed": seed, **self.settings})

    def body(self, seed: int) -> Body:
        return RigBody(self.config(seed))


PITCH = Subject(
    "pitch",
    "tuned-10baud",
    {"transmitter": {"plant": {"mismatch": 0.1, "disturbance": "q=2e-3"}}},
    ((-2.0, 2.0),),
    (CodedDirection((0.5, -0.5), (1.0, -1.0)),),
)
HELICOPTER = Subject(
    "helicopter",
    "helicopter-20baud",
    {},
    ((-1.0, 1.0), (-0.5, 0.8)),
    held_inputs((5.0, 5.0)),
)
SUBJECTS = {one.name: one for one in (PITCH, HELICOPTER)}


@dataclass(frozen=True)
class Parts:
    """What a subject's flights share."""

    codec: Codec
    law: Law
    targets: Targets
    start: Vector
    limits: Vector
    uplink_baud: float
    sample_s: float

    @property
    def outputs(self) -> int:
        return len(self.codec.model.measured(self.codec.model.initial()))


@cache
def parts_of(name: str) -> Parts:
    """Return the parts of a subject."""
    config = SUBJECTS[name].config()
    codec, controller = build_codec(config), build_controller(config)
    signals = configured_signals(config)
    references = [one for one in build_references(config, signals) if one is not None]
    limits, tick_s = build_limits(config, signals).command_max, config.timing.tick_s
    law: Law
    if isinstance(controller, StateFeedback):
        law = MirroredFeedback(controller.law, limits, tick_s)
    else:
        assert isinstance(controller, PidLoops)
        places = tuple(float(place) for place in range(codec.model.state_size))
        loops = [
            MirroredLoop(one.constants, one.output, int(one.rate(places)), one.reference is not None)
            for one in controller.loops
        ]
        law = MirroredPid(tuple(loops), limits, controller.bias, tick_s)

    def targets(tick: int) -> Vector:
        return tuple([one.value(tick) for one in references])

    start = initial_command(config, signals)
    sample_s = config.timing.symbol_period_s
    return Parts(codec, law, targets, start, limits, config.channel.rate_baud, sample_s)


def layout_of(scheme: str, symbols: int) -> Layout:
    """Return the layout that suits a scheme: words are rare, coded commands want every sample."""
    if scheme == "announced":
        return Layout(symbols, 1, 8 if symbols == 1 else 4)
    return Layout(symbols, 1 if symbols < 8 else 2, 2 if symbols == 1 else 1)


def machine_of(name: str, scheme: str, symbols: int, round_trip: int) -> tuple[TwoWay, Wants]:
    """Return the state machine, and what its source of commands or set-points wants.

    Coded commands fly with the command lead of the round trip, a mirrored law with none. Set-points
    are announced as many samples ahead as a word and the round trip need, or not at all.
    """
    subject, parts, layout = SUBJECTS[name], parts_of(name), layout_of(scheme, symbols)
    ticks, slew = parts.codec.ticks_per_sample, (math.inf,) * len(parts.limits)

    def machine(scheme: Scheme, lead: int) -> TwoWay:
        return TwoWay(parts.codec, scheme, layout, lead, parts.start, parts.limits, slew)

    if scheme == "coded":
        coded = CodedCommands(parts.start, subject.directions)
        return machine(coded, round_trip * ticks), build_controller(subject.config()).command
    first = parts.targets(0)
    ranges = [
        SetPointRange(at, low, high, start)
        for at, ((low, high), start) in enumerate(zip(subject.ranges, first, strict=True))
    ]

    def words(queue: int) -> MirroredLaw:
        return MirroredLaw(parts.law, ranges, parts.outputs, BITS, queue, layout)

    queue = 0 if scheme == "live" else words(0).queue_needed + round_trip
    rest = (0.0,) * (parts.outputs - len(first))

    def wanted(tick: int, live: Vector) -> Vector:
        return parts.targets(tick + queue * ticks) + rest

    return machine(words(queue), 0), wanted
