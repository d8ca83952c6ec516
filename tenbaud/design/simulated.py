"""A system of python-control or scipy as the plant that is flown."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from plant_sim.dynamics import FunctionPlant
from plant_sim.linear import SimulatedLinear
from plant_sim.plant import Plant, PlantContext
from plant_sim.zero_order_hold import continuous
from tenbaud.config.load import config_errors
from tenbaud.design.systems import Matrices, matrices, state_space

SUBSTEP = 0.2
"""longest step of an integration, in time constants of the fastest motion"""
SUBSTEPS_MAX = 100


def system_plant(system: Any, context: PlantContext) -> Plant:
    """Return a plant that starts where the codec's model does, or from the configured outputs.

    ConfigError for a system that is no plant of autonomous states, or not in ticks of the flight.
    """
    system = state_space(system)
    model = context.model
    point = None
    if not hasattr(system, "A") and model.get("operating_state"):
        point = (model["operating_state"], model["operating_command"])
    found = matrices(system, point)
    with config_errors(f"the plant ({type(system).__name__})"):
        if not found.linear:
            return _function_plant(system, found, context)
        A, B = continuous(found.A, found.B, found.dt) if found.dt else (found.A, found.B)
        return SimulatedLinear(context, A.tolist(), B.tolist(), found.C.tolist())


def _function_plant(system: Any, found: Matrices, context: PlantContext) -> FunctionPlant:
    """Return a system that is not linear; ValueError for one that steps otherwise than in ticks."""
    model = context.model
    if found.dt and not math.isclose(found.dt, context.step_s, rel_tol=1e-6):
        raise ValueError(
            f"its dt is {found.dt:g} s and timing.tick_s = {context.step_s:g} s; of a discrete system "
            "that is not linear a step must be a tick"
        )
    substeps = 0
    if not found.dt:
        fastest = float(np.abs(np.linalg.eigvals(found.A)).max())
        substeps = min(max(1, math.ceil(fastest * context.step_s / SUBSTEP)), SUBSTEPS_MAX)
    start = np.array(model.get("start") or found.x0, dtype=float)
    if context.initial:
        rows = found.C[: len(context.initial)]
        start = start + np.linalg.pinv(rows) @ (np.array(context.initial) - rows @ start)
    noise = np.array(model["G"], dtype=float) if model.get("G") else None
    return FunctionPlant(
        context, system.dynamics, system.output, start.tolist(), found.u0.tolist(), substeps, noise
    )
