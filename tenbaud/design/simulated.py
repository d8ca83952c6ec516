"""A system of python-control or scipy as the plant that is flown."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from plant_sim.dynamics import FunctionPlant
from plant_sim.linear import SimulatedLinear
from plant_sim.plant import Plant, PlantContext
from tenbaud.design.systems import matrices

SUBSTEP = 0.2
"""longest step of an integration, in time constants of the fastest motion"""
SUBSTEPS_MAX = 100


def system_plant(system: Any, context: PlantContext) -> Plant:
    """Return a plant that starts where the codec's model does, or from the configured outputs.

    ConfigError for a system that is no plant of autonomous states.
    """
    model = context.model
    point = None
    if not hasattr(system, "A") and model.get("operating_state"):
        point = (model["operating_state"], model["operating_command"])
    found = matrices(system, point)
    if found.linear and not found.dt:
        return SimulatedLinear(context, found.A.tolist(), found.B.tolist(), found.C.tolist())
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
