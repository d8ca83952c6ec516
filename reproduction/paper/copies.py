"""Two copies of one codec over a line that flips bits: what the echo is for."""

from __future__ import annotations

import random
from dataclasses import dataclass

import numpy as np

from channel.codec.codec import CodecState
from plant_sim.disturbance import WhiteTorque
from plant_sim.pitch import PitchPlant
from tenbaud.build.codec import build_codec
from tenbaud.build.rig import nominal_plant
from tenbaud.config.load import load_config
from tenbaud.recording.envelope import Series

DURATION_S = 60.0
FLIPPED = 0.05
FIRST_FLIP_S = 5.0
SEED = 3


@dataclass(frozen=True, slots=True)
class CopiesApart:
    """One value per sample."""

    times_s: Series
    error_rad: Series
    """of the receiver's estimate"""
    apart_rad: Series
    """between the angles of the two copies"""
    flipped_s: list[float]


def fly_copies(echo: bool) -> CopiesApart:
    """Let two copies follow a swinging body whose commands both know, with 5 % of the bits flipped.

    With `echo` the transmitter's copy consumes what the receiver consumed, without it what it sent.
    """
    config = load_config("paper-10baud", None, {"coder": {"window_signs": 3}})
    codec = build_codec(config)
    tick_s, ticks = config.timing.tick_s, codec.ticks_per_sample
    plant = PitchPlant(nominal_plant(config), tick_s, disturbance=WhiteTorque(2e-3, tick_s, SEED))
    chance = random.Random(SEED)
    sender = receiver = codec.initial()
    rows: list[tuple[float, float, float]] = []
    flipped = []
    for sample in range(round(DURATION_S / (ticks * tick_s))):
        time_s = sample * ticks * tick_s
        rows.append((time_s, plant.angle_rad - receiver.model[0], _apart(sender, receiver)))
        sent = codec.encode(sender, plant.measured)
        received = sent
        if chance.random() < FLIPPED and time_s >= FIRST_FLIP_S:
            received = tuple(-symbol for symbol in sent)
            flipped.append(time_s)
        volts = 1.5 if (time_s // 6.0) % 2 else -1.5
        commands = [(volts / 2, -volts / 2)] * ticks
        for command in commands:
            plant.advance(command)
        sender = codec.step(sender, received if echo else sent, commands)
        receiver = codec.step(receiver, received, commands)
    times, errors, apart = (np.array(column) for column in zip(*rows, strict=True))
    return CopiesApart(times, errors, apart, flipped)


def _apart(one: CodecState, other: CodecState) -> float:
    return abs(one.model[0] - other.model[0])
