"""The usual loop beside a flight: the same plant, reference and law over 1000 bit/s, on a clean line.

Its ten-bit words come every tick and are never lost, so neither frames nor a second copy of the codec
are needed; a test compares with the flight of both sessions, bit by bit.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np

from channel.codec.codec import Vector
from channel.codec.lead import fly_sample
from channel.protocol.limits import from_steps, to_steps
from tenbaud.build.controllers import build_controller
from tenbaud.build.flight import Agreement, agree
from tenbaud.build.rig import build_plant
from tenbaud.build.signals import build_encoders, safe_command
from tenbaud.config.load import load_config
from tenbaud.recording.table import Series
from transmitter.metrics.scores import ErrorMeter
from transmitter.rigs.simulated import SimulatedRig

PRESET = "usual-1000baud"
CARRIED = {"duration_s", "limits", "receiver"}
"""Settings that the usual loop takes from the flight."""
TICKS_MAX = 30_000
"""A longer flight is flown alone: this one would keep it waiting."""


class UsualFlight(NamedTuple):
    """The flown loop."""

    curve: tuple[Series, Series]
    """time in s, and the true output in rad at every tick"""
    figures: dict[str, float]
    """part of the flight's summary"""


def usual_flight(agreement: Agreement) -> UsualFlight | None:
    """Fly the usual loop beside a flight; None where there is none for its plant, clock or law."""
    config = agreement.config
    section = config.transmitter
    usual = load_config(PRESET, None, config.model_dump(include=CARRIED))
    if (
        (section.rig, config.plant_kind, config.receiver.controller) != ("simulated", "pitch", "pid")
        or (agreement.clock, config.timing.tick_s) != ("virtual", usual.timing.tick_s)
        or config.channel.rate_baud >= usual.channel.rate_baud
        or agreement.flight_ticks > TICKS_MAX
    ):
        return None
    return _fly(agree(usual, "virtual"), agreement)


def _fly(usual: Agreement, flight: Agreement) -> UsualFlight:
    codec, terms = usual.codec, usual.terms
    controller = build_controller(usual.config)
    plant = build_plant(flight.config, terms.tick_ns / 1e9)
    encoders = build_encoders(usual.config, usual.signals)
    rig = SimulatedRig(plant, encoders, safe_command(usual.config, usual.signals))
    ticks, window_start = flight.flight_ticks, flight.window_start_tick
    state, hold = codec.initial(), terms.initial_command
    commands = deque([hold] * terms.lead_ticks)
    live: deque[Vector | None] = deque([None] * terms.lead_ticks)
    values: list[float] = []
    tracking, errors = ErrorMeter(), ErrorMeter()

    def decide(tick: int, estimate: Vector) -> Vector:
        nonlocal hold
        wanted = terms.limits.apply(controller.command(tick, estimate), hold)
        hold = from_steps(to_steps(wanted, terms.signals), terms.signals)
        return hold

    for tick in range(ticks):
        reading = rig.read(tick)
        value = plant.measured[0]
        flown = fly_sample(codec, state, codec.encode(state, reading.measured), tuple(commands), decide)
        state = flown.state
        commands.extend(flown.commands)
        live.extend(flown.live)
        rig.write(tick, commands.popleft())
        values.append(value)
        estimate, reference = live.popleft(), controller.references(tick)[0]
        if tick < window_start:
            continue
        if reference is not None:
            tracking.add(reference - value)
        if estimate is not None:
            errors.add(value - codec.model.measured(estimate)[0])
    times = np.arange(len(values), dtype=np.float64) * (terms.tick_ns / 1e9)
    figures = {
        "rate_baud": usual.config.channel.rate_baud,
        "tracking_rms_rad": tracking.rms or 0.0,
        "error_live_rms_rad": errors.rms or 0.0,
    }
    return UsualFlight((times, np.array(values, dtype=np.float64)), figures)
