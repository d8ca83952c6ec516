"""Parts that many tests put together: the paper's codec, its terms, an identity."""

from __future__ import annotations

import json
from dataclasses import replace

from channel.codec.codec import Codec, Vector
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.models.pitch import PITCH_SIGNALS, PitchModel, PitchParameters
from channel.protocol.identity import Identity, numerics_probe
from channel.protocol.limits import CommandLimits
from channel.protocol.terms import Terms

TICK_S = 0.01
TICK_NS = 10_000_000
PAPER = ZoomParameters()
THREE_SIGNS = ZoomParameters(window=3)
IMPULSE = ZoomParameters(window=3, gains=((0.4,), (0.6,)), impulse=True)


def pitch_codec(
    zoom: ZoomParameters = PAPER, ticks_per_sample: int = 10, tick_s: float = TICK_S
) -> Codec:
    return Codec(PitchModel(PitchParameters(), tick_s), ZoomCoder(zoom), ticks_per_sample)


PAPER_TERMS = Terms(
    tick_ns=TICK_NS,
    ticks_per_sample=10,
    symbols_per_word=1,
    lead_ticks=0,
    rate_baud=10.0,
    delivery="start",
    deadline_allowance_ns=20_000_000,
    downlink_budget_ns=10_000_000,
    repeats=2,
    initial_command=(0.0, 0.0),
    limits=CommandLimits.of(PITCH_SIGNALS, 5.0),
    signals=PITCH_SIGNALS,
)


def terms(**changes: object) -> Terms:
    """Return the paper's terms with some of them changed."""
    return replace(PAPER_TERMS, **changes)  # type: ignore[arg-type]


def identity_of(codec: Codec, config: object = None, version: str = "1.0") -> Identity:
    return Identity(version, json.dumps(config or {"rate_baud": 10.0}), numerics_probe(codec))


class ConstantController:
    """Commands the same voltages for ever, and notes what it was asked."""

    def __init__(self, *volts: float) -> None:
        self.volts = volts
        self.asked: list[tuple[int, Vector]] = []

    def command(self, tick: int, state: Vector) -> Vector:
        self.asked.append((tick, state))
        return self.volts

    def references(self, tick: int) -> tuple[float | None, ...]:
        return (None,)
