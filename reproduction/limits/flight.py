"""One flight for the page: the nodes' own parts, joined without the protocol around them.

Codec, rate observer, encoder, plant and controller are those that a flight in memory has at command
lead 0, in the same order; a test holds that the errors are the same to the last bit. Without frames,
digests and rows it takes a third of the time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

from channel.codec.codec import Vector
from channel.errors import CodecDiverged
from channel.protocol.limits import from_steps, to_steps
from reproduction.limits.candidates import CANDIDATES, PRESETS
from tenbaud.build.controllers import build_controller
from tenbaud.build.ends import build_observer
from tenbaud.build.flight import Agreement, agree
from tenbaud.build.rig import build_plant
from tenbaud.build.signals import build_encoders
from tenbaud.config.load import load_config

FINE_COUNTS = 10_000_000
RIG_COUNTS = 4096
SETTLE_S = 10.0
"""left out at the beginning of a flight without a reference"""
PERIOD_S = 25.0


@dataclass(frozen=True, slots=True)
class Case:
    """A flight of the page."""

    candidate: str
    """a candidate's key, or a preset's name"""
    rate_bit_s: float
    density: float
    seed: int
    seconds: float
    closed_loop: bool = False
    counts: int = FINE_COUNTS

    @property
    def cell(self) -> tuple[str, float, float, bool, int]:
        """Return what is averaged over: everything but the seed."""
        return (self.candidate, self.rate_bit_s, self.density, self.closed_loop, self.counts)


class Errors(NamedTuple):
    """Mean squares, in rad^2; not finite when the estimate was lost."""

    estimation: float
    """of the codec's angle"""
    tracking: float
    """of the distance from the reference"""


def configuration(case: Case) -> Agreement:
    """Return what both ends agree on for a case."""
    receiver: dict[str, Any] = {} if case.closed_loop else {"pid": IDLE}
    overrides: dict[str, Any] = {
        "seed": case.seed,
        "duration_s": case.seconds,
        "timing": {"lead_ticks": 0},
        "channel": {"delivery": "start"},
        "transmitter": {
            "encoders": {"counts_per_turn": case.counts},
            "plant": {"disturbance": f"q={case.density!r}"},
        },
        "receiver": receiver,
        "link": {"kind": "memory"},
    }
    if case.candidate in PRESETS:
        return agree(load_config(case.candidate, None, overrides), "virtual")
    candidate = next(one for one in CANDIDATES if one.key == case.candidate)
    tick_s = tick_of(case.rate_bit_s)
    density = case.density if candidate.knows_q else None
    overrides["timing"] |= {"tick_s": tick_s, "symbol_period_s": 1.0 / case.rate_bit_s}
    overrides["channel"]["rate_baud"] = case.rate_bit_s
    overrides["coder"] = candidate.section(case.rate_bit_s, case.density)
    overrides["transmitter"]["rate_observer_bandwidth_rad_s"] = observer_bandwidth(
        density, case.counts, tick_s
    )
    return agree(load_config("paper-10baud", None, overrides), "virtual")


def tick_of(rate_bit_s: float) -> float:
    """Return the control tick, in s: the paper's, or five to a bit where that would be too few."""
    return 0.01 if rate_bit_s <= 20.0 else 0.2 / rate_bit_s


IDLE = {"proportional": 0.0, "integral": 0.0, "derivative": 0.0}


def observer_bandwidth(density: float | None, counts: int, tick_s: float) -> float:
    """Return the bandwidth of the steady Kalman filter of the rate, (q / r)^(1/4), in rad/s.

    r is the encoder's rounding as white noise, `width^2 / 12 * tick`. A coder that does not know q has
    the configuration's default, unless the encoder is so fine that there is nothing to smooth.
    """
    if density is None and counts <= RIG_COUNTS:
        return 30.0
    rounding = (math.tau / counts) ** 2 / 12.0 * tick_s
    return min(10_000.0, float(((density or 2e-3) / rounding) ** 0.25))


def fly(case: Case) -> Errors:
    """Fly a case."""
    return fly_agreement(configuration(case), PERIOD_S if case.closed_loop else SETTLE_S)


def fly_agreement(agreement: Agreement, start_s: float) -> Errors:
    """Fly what is agreed on, at command lead 0; errors count from `start_s` on.

    A word of several symbols is taken to be there at its sample's first tick, which flatters it.
    """
    config, codec, terms = agreement.config, agreement.codec, agreement.terms
    plant = build_plant(config, terms.tick_ns / 1e9)
    (encoder,) = build_encoders(config, terms.signals)
    controller = build_controller(config)
    observer = build_observer(agreement)
    limits = terms.limits
    first = round(start_s * 1e9) // terms.tick_ns
    count = codec.ticks_per_sample
    state = codec.initial()
    volts = terms.initial_command
    estimation = tracking = 0.0
    used = 0
    for tick in range(agreement.flight_ticks):
        true = plant.measured[0]
        seen: Vector = (encoder.read(true)[1],)
        if observer is not None:
            seen = observer.look(tick, seen, volts)
        if tick % count == 0:
            opened = codec.open(state, codec.encode(state, seen))
            model = opened.model
        if tick >= first:
            error = true - codec.model.measured(model)[0]
            estimation += error * error
            distance = ((*controller.references(tick), None)[0] or 0.0) - true
            tracking += distance * distance
            used += 1
        wanted = limits.apply(controller.command(tick, model), volts)
        volts = from_steps(to_steps(wanted, terms.signals), terms.signals)
        model = codec.model.tick(model, volts, opened.held)
        plant.advance(volts)
        if tick % count == count - 1:
            try:
                state = codec.close(state, opened, model)
            except CodecDiverged:
                return Errors(math.inf, math.inf)
    return Errors(estimation / used, tracking / used)
