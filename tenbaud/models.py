"""Prediction models: both ends compute the plant's next state with them, tick by tick.

A model of your own is a class that fulfils the protocol `Model`. It runs at both ends and must give
both the same bits: `+ - * /`, comparisons, `math.sqrt`, `math.floor`, and `sin`, `cos`, `exp`.
"""

from __future__ import annotations

from channel.codec.codec import Model, ModelContext, Vector
from channel.codec.models.hold import HoldModel
from channel.codec.models.pitch import PitchModel, PitchParameters
from channel.codec.numerics import cos, exp, sin
from channel.codec.signals import InputSignal, Signal, Signals

__all__ = [
    "HoldModel",
    "InputSignal",
    "Model",
    "ModelContext",
    "PitchModel",
    "PitchParameters",
    "Signal",
    "Signals",
    "Vector",
    "cos",
    "exp",
    "sin",
]
