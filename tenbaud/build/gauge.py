"""The gap gauge of a flight: its floor, and the estimator of the disturbance's strength."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from channel.codec.models.learned import plant_model
from channel.codec.models.pitch import PitchModel
from channel.line.line import bit_rate
from tenbaud.bounds.closed import double_integrator_floor, double_integrator_rate
from tenbaud.build.flight import Agreement
from tenbaud.build.flight_log import output_steps
from tenbaud.config.kinds import model_kind
from transmitter.metrics.gap import GapGauge, Limit, StrengthMeter

SHARES = (0.4, 0.1)
"""of what the rate has above the smallest: where the floor is worked out, beside the rate itself"""


def build_gauge(agreement: Agreement) -> GapGauge | None:
    """Return the gauge; None for a model that describes no plant, or has no floor.

    The rate is the one that is paid: every slot of the grid, whether its symbol arrives or not. The
    floor of the pitch is that of the double integrator (see `tenbaud.bounds.closed`).
    """
    codec, terms = agreement.codec, agreement.terms
    tick_s = terms.tick_ns / 1e9
    steps = output_steps(agreement.config, agreement.signals)
    if isinstance(codec.model, PitchModel):
        limit = Limit(
            double_integrator_floor(1.0, bit_rate(codec, tick_s)),
            partial(double_integrator_rate, 1.0),
            (1.0,),
        )
        meter = StrengthMeter(codec, tick_s, steps[0])
        return GapGauge(limit, meter, terms.ticks_per_sample, tick_s)
    return None if agreement.parts.model is not None else _of_plant(agreement, steps)


def _of_plant(agreement: Agreement, steps: Sequence[float]) -> GapGauge | None:
    """Return the gauge of a plant that is linear, or linearised at its rest."""
    config, codec = agreement.config, agreement.codec
    kind = model_kind(config.model)
    if kind is None or kind.linear is None:
        return None
    # Here: these take scipy, and so half a second that other flights need not wait.
    import numpy as np

    from plant_sim.zero_order_hold import van_loan
    from tenbaud.bounds.floor import floor
    from tenbaud.bounds.linear import rate_needed, reached
    from tenbaud.bounds.strength import LinearStrength
    from tenbaud.design.described import corrected_part, plant_of

    tick_s = agreement.terms.tick_ns / 1e9
    rate, described = bit_rate(codec, tick_s), plant_of(config.model, tick_s)
    if described is None:
        return None
    try:
        plant = corrected_part(described, plant_model(codec.model).correction_size)
        needed = rate_needed(plant.A)
        model, _ = reached(plant.A, plant.noise, plant.C, plant.weights)
        above = rate - needed
        least = floor(model, rate)
    except ValueError:  # the outputs do not show all that is disturbed, so that no error is least
        return None
    density = next(one for one in plant.densities.tolist() if one > 0.0)
    per_tick = van_loan(plant.A, plant.noise, tick_s)
    meter = LinearStrength(codec, *per_tick, plant.C, np.array(steps), tick_s, density)
    errors, rates = [math.log(least / density)], [math.log(above)]
    for share in SHARES:
        try:
            errors.append(math.log(floor(model, needed + share * above) / density))
        except ValueError:  # so near to the smallest rate the numbers are too large
            break
        rates.append(math.log(share * above))

    def ideal_rate(per_density: float) -> float:
        return needed + math.exp(float(np.interp(math.log(per_density), errors, rates)))

    limit = Limit(least / density, ideal_rate, tuple(plant.weights.tolist()))
    return GapGauge(limit, meter, agreement.terms.ticks_per_sample, tick_s)
