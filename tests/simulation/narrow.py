"""Flights of the pitch axis with a narrow downlink, without sessions, and the same with a full one.

The plant is `mismatch` off from the model and pushed by white torque.
"""

from __future__ import annotations

import math
from random import Random

from channel.codec.codec import Codec, Vector
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.downlink.coded import CodedCommands, CodedDirection
from channel.codec.downlink.laws import MirroredLoop, MirroredPid
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay
from channel.codec.downlink.mirrored import Law, MirroredLaw, SetPointRange
from channel.codec.laws import PidConstants
from channel.codec.models.pitch import PitchModel, PitchParameters, pitch_constants, pitch_tick
from receiver.controllers.pid import PAPER_GAINS
from reproduction.bothways import flights
from reproduction.bothways.flights import Result, Wants
from reproduction.bothways.lines import CLEAN, Faults
from transmitter.session.narrow.hypotheses import Settings

TICK_S = 0.01
TICKS = 10
HALF_PERIOD_SAMPLES = 125
LIMITS = (5.0, 5.0)
NO_SLEW = (math.inf, math.inf)
START = (0.0, 0.0)


def tuned_codec() -> Codec:
    """Return the pitch codec of the trial: a sign a sample, a range that adapts, impulses."""
    coder = ZoomCoder(
        ZoomParameters(
            initial_range=0.05,
            minimum_range=0.015,
            decay=0.9,
            window=3,
            gains=((0.6,), (4.0,)),
            impulse=True,
        )
    )
    return Codec(PitchModel(PitchParameters(), TICK_S), coder, TICKS)


def paper_law() -> MirroredPid:
    """Return the paper's PID law as it is mirrored."""
    constants = PidConstants(*PAPER_GAINS.per_tick(TICK_S), (0.5, -0.5), True)
    return MirroredPid((MirroredLoop(constants, 0, 1),), LIMITS, START, TICK_S)


def mirrored(layout: Layout, queue: int, lead_ticks: int = 0, bits: int = 9) -> TwoWay:
    """Return the state machine with the law in it."""
    ranges = (SetPointRange(0, -2.0, 2.0),)
    scheme = MirroredLaw(paper_law(), ranges, 1, bits, queue, layout)
    return TwoWay(tuned_codec(), scheme, layout, lead_ticks, START, LIMITS, NO_SLEW)


def coded(layout: Layout, direction: CodedDirection, lead_ticks: int = 0) -> TwoWay:
    """Return the state machine with coded commands: the difference of the motors, which is the push."""
    scheme = CodedCommands(START, (direction,))
    return TwoWay(tuned_codec(), scheme, layout, lead_ticks, START, LIMITS, NO_SLEW)


def square(tick: int) -> float:
    """Return the paper's set-point."""
    odd = tick // (TICKS * HALF_PERIOD_SAMPLES) % 2
    return -math.pi / 2 if odd else math.pi / 2


class Pitch:
    """The plant, and what it has shown."""

    def __init__(self, seed: int, noise: float, mismatch: float) -> None:
        true = PitchParameters()
        scale = 1.0 + mismatch
        self._constants = pitch_constants(
            PitchParameters(
                true.rate_damping_per_s * scale,
                true.stiffness_per_s2 * scale,
                true.torque_gain_rad_per_v_s2 * scale,
                true.equilibrium_rad,
                true.motor_lag_s,
            ),
            TICK_S,
        )
        self._random = Random(f"plant {seed}")
        self._deviation = math.sqrt(noise / TICK_S)
        self.state: Vector = (0.0, 0.0, 0.0, 0.0)

    @property
    def measured(self) -> Vector:
        return self.state[:1]

    @property
    def true(self) -> Vector:
        return self.state[:1]

    def step(self, command: Vector) -> None:
        torque = self._random.gauss(0.0, self._deviation)
        self.state = pitch_tick(self.state, command, (0.0, torque), self._constants)


def targets(tick: int) -> Vector:
    return (square(tick),)


class NarrowFlight(flights.NarrowFlight):
    """One flight of the pitch axis; `round_trip` in samples."""

    plant: Pitch

    def __init__(
        self,
        machine: TwoWay,
        wanted: Wants,
        seed: int,
        faults: Faults = CLEAN,
        *,
        round_trip: int = 0,
        noise: float = 2e-3,
        mismatch: float = 0.1,
        settings: Settings | None = None,
        keep: bool = False,
    ) -> None:
        pitch = Pitch(seed, noise, mismatch)
        super().__init__(
            machine,
            wanted,
            pitch,
            targets,
            seed,
            faults,
            round_trip=round_trip,
            settings=settings,
            keep=keep,
        )


def full(
    codec: Codec,
    law: Law,
    seed: int,
    samples: int,
    faults: Faults = CLEAN,
    *,
    round_trip: int = 0,
    noise: float = 2e-3,
    mismatch: float = 0.1,
) -> Result:
    """Fly the pitch axis with exact commands and echoes, and the command lead of the round trip."""
    pitch = Pitch(seed, noise, mismatch)
    return flights.full(codec, law, pitch, targets, START, seed, samples, faults, round_trip=round_trip)
