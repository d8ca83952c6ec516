"""The pitch model (11), (12) as a structure.

    theta'' = -a_w theta' - a_th sin(theta - theta_0) + k_v mu                       (11)
    T_m vbar_i' + vbar_i = v_i,   mu = vbar_front - vbar_rear                        (12)

The bias theta_0 is measured beforehand in a quiescent stretch, as in the paper. Where there is none, or
where it is not to be trusted (a body leaning on something on the ground), it can be estimated with the
others: a_th sin(theta - theta_0) = c sin(theta) - d cos(theta) is linear in c = a_th cos(theta_0) and
d = a_th sin(theta_0).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d

from plant_sim.identification.filters import Array
from plant_sim.identification.record import Record
from plant_sim.identification.structures import Equation, Parameter, Term

COSINE, SINE = "a_th cos(theta_0)", "a_th sin(theta_0)"
QUIET_S = 2.0


@dataclass(frozen=True)
class PitchStructure:
    """The pitch model; `equilibrium_rad` is theta_0, or None to estimate it with the others."""

    equilibrium_rad: float | None = None
    volts_max: float = math.inf
    """where each motor saturates: commands beyond it have no further effect"""
    without: frozenset[str] = frozenset()
    kind: str = "pitch"
    order: int = 2

    @property
    def equations(self) -> tuple[Equation, ...]:
        """Return (11)."""
        pulls: tuple[Term, ...] = (Term("a_th", 1, 0, -1.0),)
        if self.equilibrium_rad is None:
            pulls = (Term(COSINE, 1, 0, -1.0), Term(SINE, 2, 0))
        terms = (Term("a_w", 0, 1, -1.0), *pulls, Term("k_v", 1 + len(pulls), 0))
        return (Equation(0, 2, tuple(term for term in terms if term.name not in self.without)),)

    def signals(self, outputs: Array) -> Array:
        """Return theta and sin(theta - theta_0), or theta, its sine and its cosine."""
        angle = outputs[:, :1]
        if self.equilibrium_rad is not None:
            return np.hstack((angle, np.sin(angle - self.equilibrium_rad)))
        return np.hstack((angle, np.sin(angle), np.cos(angle)))

    def acting(self, inputs: Array) -> Array:
        """Return v_front - v_rear, each as far as its motor follows; a single input is v_front."""
        volts = np.clip(inputs, -self.volts_max, self.volts_max)
        return volts[:, :1] - volts[:, 1:2] if inputs.shape[1] > 1 else volts

    def constants(self, values: Mapping[str, float]) -> tuple[float, float, float, float]:
        """Return a_w, a_th, k_v and theta_0."""
        damping, gain = values.get("a_w", 0.0), values.get("k_v", 0.0)
        if self.equilibrium_rad is not None:
            return damping, values.get("a_th", 0.0), gain, self.equilibrium_rad
        cosine, sine = values.get(COSINE, 0.0), values.get(SINE, 0.0)
        return damping, math.hypot(cosine, sine), gain, math.atan2(sine, cosine)

    def parameters(self, values: Mapping[str, float], covariance: Array) -> list[Parameter]:
        """Return the fields of the model's section; 0 is the error of a theta_0 that was given."""
        found = self.constants(values)
        order = list(values)
        turn = np.zeros((4, len(order)))
        for row, name in ((0, "a_w"), (1, "a_th"), (2, "k_v")):
            if name in values:
                turn[row, order.index(name)] = 1.0
        if self.equilibrium_rad is None and COSINE in values:
            # To first order, by the derivatives of size and angle.
            stiffness, angle = max(found[1], 1e-12), found[3]
            for name, along, across in (
                (COSINE, math.cos(angle), -math.sin(angle)),
                (SINE, math.sin(angle), math.cos(angle)),
            ):
                turn[1, order.index(name)], turn[3, order.index(name)] = along, across / stiffness
        with np.errstate(invalid="ignore"):
            spread = np.sqrt(np.maximum(np.diag(turn @ covariance @ turn.T), 0.0))
        spread = np.where(np.isnan(spread), math.inf, spread)
        fields = (
            ("rate_damping_per_s", "a_w", "1/s"),
            ("stiffness_per_s2", "a_th", "1/s^2"),
            ("torque_gain_rad_per_v_s2", "k_v", "rad/(V s^2)"),
            ("equilibrium_rad", "theta_0", "rad"),
        )
        return [
            Parameter(*field, value, float(deviation))
            for field, value, deviation in zip(fields, found, spread, strict=True)
        ]


@dataclass(frozen=True, slots=True)
class QuietStretch:
    """The angle of the body at rest with its motors off."""

    start_s: float
    end_s: float
    angle_rad: float
    """mean angle there: theta_0"""


def quiescent_angle(
    record: Record, *, volts: float = 0.05, spread_rad: float = 0.02, seconds: float = QUIET_S
) -> QuietStretch | None:
    """Return the longest stretch in which the body rests and the motors pull equally; None if none.

    It rests while its angle stays within `spread_rad` over `seconds` and the voltages differ by at
    most `volts`.
    """
    steps = max(2, round(seconds / record.step_s))
    if len(record) < steps:
        return None
    difference = np.abs(PitchStructure().acting(record.inputs)[:, 0])
    angle = record.outputs[:, 0]
    quiet = (_largest(angle, steps) + _largest(-angle, steps) <= spread_rad) & (
        _largest(difference, steps) <= volts
    )
    edges = np.flatnonzero(np.diff(np.concatenate(([False], quiet, [False])).astype(np.int8)))
    if not len(edges):
        return None
    starts, ends = edges[::2], edges[1::2]
    best = int(np.argmax(ends - starts))
    start, end = int(starts[best]), int(ends[best]) - 1 + steps
    mean = float(angle[start:end].mean())
    return QuietStretch(start * record.step_s, end * record.step_s, mean)


def _largest(values: Array, steps: int) -> Array:
    """Return the largest value of each whole window, by its first sample."""
    first = steps // 2
    whole = maximum_filter1d(values, steps)
    return np.asarray(whole[first : first + len(values) - steps + 1])
