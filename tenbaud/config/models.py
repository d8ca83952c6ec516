"""The kinds of models: what each one's section may hold, and what is built from it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from channel.codec.codec import ModelContext
from channel.codec.models.hold import HoldModel
from channel.codec.models.pendulum import PendulumModel
from channel.codec.models.pitch import PitchModel, PitchParameters
from tenbaud.config.kinds import Kind
from tenbaud.config.section import KindSection


class PitchModelSection(KindSection):
    """The pitch model (11),(12) that both codecs predict with."""

    kind: Literal["pitch"] = "pitch"
    rate_damping_per_s: Annotated[float, Field(ge=0.0, le=100.0)] = 0.1
    stiffness_per_s2: Annotated[float, Field(ge=-100.0, le=1000.0)] = 0.5
    torque_gain_rad_per_v_s2: Annotated[float, Field(ge=-100.0, le=100.0)] = 0.35
    equilibrium_rad: Annotated[float, Field(ge=-3.2, le=3.2)] = -0.115
    motor_lag_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.08


class HoldModelSection(KindSection):
    """No model: angle and rate stay as the last word set them. For the coder `words`."""

    kind: Literal["hold"] = "hold"


class PendulumModelSection(KindSection):
    """An inverted pendulum, upright at angle 0 and pushed by one motor: unstable."""

    kind: Literal["pendulum"] = "pendulum"
    growth_per_s: Annotated[float, Field(ge=0.1, le=100.0)] = 7.32
    """lambda: errors grow by exp(lambda) a second"""
    damping_per_s: Annotated[float, Field(ge=0.0, le=100.0)] = 0.1
    torque_gain_rad_per_v_s2: Annotated[float, Field(ge=-100.0, le=100.0)] = 4.0


def _pitch(section: PitchModelSection, context: ModelContext) -> PitchModel:
    parameters = PitchParameters(**section.model_dump(exclude={"kind"}))
    return PitchModel(parameters, context.tick_s)


def _hold(section: HoldModelSection, context: ModelContext) -> HoldModel:
    return HoldModel(context.tick_s)


def _pendulum(section: PendulumModelSection, context: ModelContext) -> PendulumModel:
    return PendulumModel(context, **section.model_dump(exclude={"kind"}))


PENDULUM = Kind(PendulumModelSection, _pendulum)
PITCH = Kind(PitchModelSection, _pitch)
HOLD = Kind(HoldModelSection, _hold)
