"""Prediction models: what both ends compute the plant's next state with, tick by tick.

A model of your own is a class that fulfils the protocol `Model`. It runs at both ends and must give
both the same bits: `+ - * /`, comparisons, `math.sqrt`, `math.floor`, and `sin`, `cos`, `exp`.
"""

from __future__ import annotations

from channel.codec.codec import Model, ModelContext, Vector
from channel.codec.models.hold import HoldModel
from channel.codec.models.pitch import PitchModel, PitchParameters
from channel.codec.numerics import cos, exp, sin

__all__ = [
    "HoldModel",
    "Model",
    "ModelContext",
    "PitchModel",
    "PitchParameters",
    "Vector",
    "cos",
    "exp",
    "sin",
]
