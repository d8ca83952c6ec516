"""The gap gauge of a flight, where its codec has one."""

from __future__ import annotations

import math

from channel.codec.models.pitch import PitchModel
from plant_sim.encoder import Encoder
from tenbaud.bounds.closed import double_integrator_floor, double_integrator_rate
from tenbaud.build.flight import Agreement
from tenbaud.build.signals import build_encoders
from transmitter.metrics.gap import GapGauge, Limit, StrengthMeter


def build_gauge(agreement: Agreement) -> GapGauge | None:
    """Return the gauge; None for a model that does not predict what its commands do.

    The floor is that of the double integrator (see `tenbaud.bounds.closed`) at the rate that is paid:
    every slot of the grid, whether its symbol arrives or not.
    """
    codec, terms, config = agreement.codec, agreement.terms, agreement.config
    if not isinstance(codec.model, PitchModel):
        return None
    tick_s = terms.tick_ns / 1e9
    alphabet = codec.coder.alphabet
    bits = alphabet.symbols_per_word * math.log2(len(alphabet.symbols))
    rate_bit_s = bits / (terms.sample_ns / 1e9)
    limit = Limit(
        double_integrator_floor(1.0, rate_bit_s),
        lambda per_density: double_integrator_rate(1.0, per_density),
    )
    encoder = build_encoders(config, agreement.signals)[0]
    step_rad = encoder.turn / encoder.counts_per_turn if isinstance(encoder, Encoder) else 0.0
    strength = StrengthMeter(codec, tick_s, step_rad)
    return GapGauge(limit, strength, terms.ticks_per_sample, tick_s)
