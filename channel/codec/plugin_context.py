"""The context that a model or a coder from outside gets when it is built."""

from __future__ import annotations

from dataclasses import dataclass

from channel.codec.codec import Model


@dataclass(frozen=True, slots=True)
class ModelContext:
    """For a prediction model."""

    tick_s: float
    """h: what one call of `tick` advances by"""
    symbol_period_s: float
    """T_s"""


@dataclass(frozen=True, slots=True)
class CoderContext:
    """For a coder."""

    tick_s: float
    symbol_period_s: float
    """T_s: one word per this time"""
    model: Model
    """the model that it corrects"""
