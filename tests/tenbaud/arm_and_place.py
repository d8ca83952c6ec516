"""A plant from outside with two outputs of different units and one input, flown and recorded."""

from __future__ import annotations

import math
from pathlib import Path

from channel.codec.codec import Vector
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.signals import InputSignal, Signal, Signals
from tenbaud import Codec, FlightResult, MemoryFlight, Run, Terms
from tenbaud.recording.encoding import SIGNALS_KEY, signals_text
from tenbaud.recording.folder import RECEIVER_NAME, TRANSMITTER_NAME
from tenbaud.recording.writer import McapRecorder

TICK_S = 0.01
ZOOM = ZoomParameters(
    initial_range=0.5,
    minimum_range=0.02,
    decay=0.9,
    window=3,
    gains=((4.0, 0.0), (0.0, 4.0), (6.0, 0.0), (0.0, 6.0)),
)


class Model:
    """An arm on a place that moves, both pulled by one torque; what the codecs predict with."""

    state_size, correction_size, input_size = 4, 4, 1
    signals = Signals(
        states=(
            Signal("arm", "rad"),
            Signal("place", "m"),
            Signal("arm_rate", "rad/s"),
            Signal("speed", "m/s"),
        ),
        inputs=(InputSignal("torque", "N m"),),
        outputs=(Signal("arm", "rad"), Signal("place", "m")),
    )

    def initial(self) -> Vector:
        return (0.0, 0.0, 0.0, 0.0)

    def measured(self, state: Vector) -> Vector:
        return state[:2]

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        arm, place, arm_rate, speed = state
        arm_pull = command[0] - 2.0 * arm - 0.5 * arm_rate + held[2]
        place_pull = 0.5 * command[0] - place - 0.3 * speed + held[3]
        return (
            arm + TICK_S * (arm_rate + held[0]),
            place + TICK_S * (speed + held[1]),
            arm_rate + TICK_S * arm_pull,
            speed + TICK_S * place_pull,
        )


class Plant:
    """The same, disturbed."""

    def __init__(self) -> None:
        self.state: Vector = (0.2, -0.1, 0.0, 0.0)
        self._ticks = 0

    @property
    def measured(self) -> Vector:
        return self.state[:2]

    def advance(self, volts: Vector) -> None:
        self._ticks += 1
        pull = 0.3 * math.sin(0.004 * self._ticks), 0.2 * math.cos(0.007 * self._ticks)
        self.state = Model().tick(self.state, volts, (0.0, 0.0, *pull))


class Law:
    """Damps the arm."""

    def command(self, tick: int, state: Vector) -> Vector:
        return (max(-2.0, min(2.0, -state[0] - state[2])),)

    def references(self, tick: int) -> tuple[float | None, ...]:
        return (0.1,)


def fly_recorded(
    folder: Path, seconds: float = 10.0, signals: Signals = Model.signals
) -> tuple[FlightResult, Run]:
    """Fly and return what was seen, and the run that was recorded."""
    codec = Codec(Model(), ZoomCoder(ZOOM), ticks_per_sample=10)
    terms = Terms.for_codec(codec, TICK_S, lead_ticks=8)
    folder.mkdir()
    head = {"tick_s": repr(TICK_S), SIGNALS_KEY: signals_text(signals)}
    upper, lower = (
        McapRecorder(folder / name, {"role": name.split(".")[0], **head}, wait_when_full=True)
        for name in (TRANSMITTER_NAME, RECEIVER_NAME)
    )
    with upper, lower:
        flight = MemoryFlight(codec, terms, Plant(), Law(), recorder=upper, receiver_recorder=lower)
        result = flight.fly(seconds)
    return result, Run(folder)
