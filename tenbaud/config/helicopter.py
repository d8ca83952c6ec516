"""The model `helicopter`: its section of the configuration, and the plant that it describes."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from channel.codec.codec import ModelContext
from channel.codec.models.helicopter import (
    HELICOPTER_SIGNALS,
    LINEAR_UP_V,
    HelicopterModel,
    HelicopterParameters,
    force_of,
    hover_volts,
)
from channel.codec.models.learned_helicopter import LearnedHelicopterModel
from tenbaud.config.kinds import Kind
from tenbaud.config.models import LinearModelSection, ModelSection, freshness
from tenbaud.config.section import NotNegative, Positive

LAG_LEAST_S = 1e-3
"""in the description of motors that do not lag"""


class HelicopterModelSection(ModelSection):
    """Travel, elevation and pitch of a helicopter on an arm; defaults are the LAAS benchmark's.

    A thrust is the acceleration by a force of 1: that of a rotor at 5 V.
    """

    kind: Literal["helicopter"] = "helicopter"
    travel_damping_per_s: NotNegative = 0.273724
    travel_thrust_rad_per_s2: NotNegative = 0.257485
    elevation_weight_rad_per_s2: NotNegative = 2.355588
    elevation_tilt_rad_per_s2: NotNegative = 0.798994
    """weight that turns with the pitch"""
    elevation_damping_per_s: NotNegative = 0.053735
    elevation_thrust_rad_per_s2: Positive = 0.564962
    pitch_weight_rad_per_s2: NotNegative = 0.858663
    pitch_damping_per_s: NotNegative = 0.048169
    pitch_thrust_rad_per_s2: Positive = 7.339993
    force_up: Positive = 0.1111
    """force of a rotor at 1 V; it grows with the square up to there, in proportion beyond"""
    force_down: NotNegative = 0.012054
    """the same at -0.5 V, without its sign"""
    elevation_low_rad: Annotated[float, Field(ge=-1.5, le=-0.001)] = -0.4886921905584123
    """stops of elevation and, to either side, pitch"""
    elevation_high_rad: Annotated[float, Field(ge=0.001, le=1.5)] = 0.5235987755982988
    pitch_stop_rad: Annotated[float, Field(ge=0.001, le=1.5)] = 0.5585053606381855
    travel_stop_rad: Annotated[float, Field(ge=0.01, le=1e6)] = math.pi
    """to either side; a rig with a slip ring has none: give a large number"""
    motor_lag_s: Annotated[float, Field(ge=0.0, le=10.0)] = 0.08
    hover_rad: Annotated[float, Field(ge=0.001, le=1.5)] = 0.17453292519943295
    """elevation at which both ends begin, and at which design and floor take the plant for linear"""
    densities: tuple[NotNegative, NotNegative, NotNegative] = (2e-4, 2e-4, 2e-3)
    """q of the disturbance of travel, elevation and pitch, in rad^2/s^3"""
    weights: tuple[NotNegative, NotNegative, NotNegative] = (1.0, 1.0, 1.0)
    """of the squared error of each angle"""
    learns: bool = False
    """whether errors of damping, weight and thrust, and a force on each axis, are states that the coder
    `learning` corrects"""

    @model_validator(mode="after")
    def _hovering(self) -> HelicopterModelSection:
        if not 0.0 < self.hover_rad < self.elevation_high_rad:
            raise ValueError(
                f"hover_rad = {self.hover_rad:g} must lie above 0 and below the stop, "
                f"elevation_high_rad = {self.elevation_high_rad:g}"
            )
        return self

    @property
    def stops(self) -> dict[str, tuple[float, float]]:
        """Return the range of each output."""
        travel, pitch = self.travel_stop_rad, self.pitch_stop_rad
        elevation = self.elevation_low_rad, self.elevation_high_rad
        return {"travel": (-travel, travel), "elevation": elevation, "pitch": (-pitch, pitch)}

    @property
    def parameters(self) -> HelicopterParameters:
        """Return the parameters of the equations."""
        values = self.model_dump(include=set(HelicopterParameters._fields))
        return HelicopterParameters(**values)


def _build(
    section: HelicopterModelSection, context: ModelContext
) -> HelicopterModel | LearnedHelicopterModel:
    hover_rad, lag_s = section.hover_rad, section.motor_lag_s
    model = HelicopterModel(section.parameters, hover_rad, lag_s, context.tick_s, section.start)
    return LearnedHelicopterModel(model, freshness(context)) if section.learns else model


def _linear(section: HelicopterModelSection) -> LinearModelSection:
    """Return the plant in hover, in volts; its motors' lag follows from the commands alone."""
    p, hover = section.parameters, section.hover_rad
    volts = hover_volts(p, hover)
    lift = 2.0 * force_of(volts, p.force_up, p.force_down)
    slope = 2.0 * p.force_up * min(volts, LINEAR_UP_V)
    rate = 1.0 / max(section.motor_lag_s, LAG_LEAST_S)
    weight = p.elevation_weight_rad_per_s2 + p.elevation_tilt_rad_per_s2
    rise, turn = slope * p.elevation_thrust_rad_per_s2, slope * p.pitch_thrust_rad_per_s2
    A = [[0.0] * 8 for _ in range(8)]
    for axis in range(3):
        A[axis][3 + axis] = 1.0
    A[3][2:4] = -p.travel_thrust_rad_per_s2 * math.cos(hover) * lift, -p.travel_damping_per_s
    A[4][1], A[4][4] = -weight * math.cos(hover), -p.elevation_damping_per_s
    A[4][6:] = rise, rise
    A[5][2], A[5][5] = -p.pitch_weight_rad_per_s2 * math.cos(hover), -p.pitch_damping_per_s
    A[5][6:] = turn, -turn
    A[6][6] = A[7][7] = -rate
    rows = range(8)
    names = HELICOPTER_SIGNALS
    return LinearModelSection(
        A=A,
        B=[[rate * (row == 6), rate * (row == 7)] for row in rows],
        C=[[1.0 * (row == axis) for row in rows] for axis in range(3)],
        G=[[1.0 * (row == 3 + axis) for axis in range(3)] for row in rows],
        corrected=6,
        densities=section.densities,
        weights=section.weights,
        operating_state=(0.0, hover, 0.0, 0.0, 0.0, 0.0, volts, volts),
        operating_command=(volts, volts),
        states=[one.name for one in names.states],
        state_units=[one.unit for one in names.states],
        inputs=[one.name for one in names.inputs],
        input_units=[one.unit for one in names.inputs],
    )


HELICOPTER = Kind(
    HelicopterModelSection,
    _build,
    plant="helicopter",
    linear=_linear,
    may_grow=lambda _section: False,
)
