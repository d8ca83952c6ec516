"""Simulated plants. A plant takes volts and has true angles.

A plant of your own is a class that fulfils the protocol `Plant`. It is free to use any arithmetic.
"""

from __future__ import annotations

from plant_sim.disturbance import Disturbance, parse_disturbance
from plant_sim.pitch import PitchParameters, PitchPlant
from plant_sim.plant import Plant, PlantContext

__all__ = ["Disturbance", "PitchParameters", "PitchPlant", "Plant", "PlantContext", "parse_disturbance"]
