"""A second opinion: the parameters whose simulation fits the record best.

The record is cut into segments. Each starts at the angle and rate that the data show there, is
simulated with (11), (12) under the recorded voltages, and the difference to the recorded angle is
minimised by `scipy.optimize.least_squares`. It shares nothing with the regression (9), (10) but the
data and the model, so that an error in either method shows as a disagreement.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.estimator import Array
from plant_sim.identification.pitch import PitchEstimates, PitchSettings
from plant_sim.identification.record import PitchRecord

BOUNDS = ((-5.0, -50.0, -50.0, -math.pi), (50.0, 500.0, 50.0, math.pi))
"""Bounds for a_w, a_th, k_v and theta_0; a fit beyond them has diverged."""

SEGMENT_S = 5.0
SMOOTHING_S = 0.3
"""Length of the local cubic that gives the rate at a segment's start."""


@dataclass(frozen=True, slots=True)
class CrossCheck:
    """The simulation-error fit."""

    estimates: PitchEstimates
    deviations: PitchEstimates
    residual_rad: float
    """root mean square of the angle's simulation error"""

    def disagreements(self, estimates: PitchEstimates, deviations: PitchEstimates) -> list[str]:
        """Return where other estimates differ by more than both uncertainties and 10 % explain."""
        found = []
        for name in ("rate_damping_per_s", "stiffness_per_s2", "torque_gain_rad_per_v_s2"):
            ours, theirs = getattr(self.estimates, name), getattr(estimates, name)
            spread = math.hypot(getattr(self.deviations, name), getattr(deviations, name))
            allowed = 3.0 * spread + 0.1 * abs(ours)
            if abs(ours - theirs) > allowed:
                found.append(
                    f"{name}: the regression says {theirs:.4g}, the simulation-error fit {ours:.4g}; "
                    "the model does not describe these data well, or something else pushes the body"
                )
        return found


def fit(
    record: PitchRecord,
    start: PitchEstimates,
    *,
    estimate_equilibrium: bool,
    settings: PitchSettings | None = None,
    segment_s: float = SEGMENT_S,
) -> CrossCheck:
    """Fit the model to a record, beginning at the estimates `start`."""
    settings = settings or PitchSettings()
    segments = _segments(record, settings, segment_s)
    guess = np.array(start[: 4 if estimate_equilibrium else 3])

    def residuals(values: Array) -> Array:
        equilibrium = values[3] if estimate_equilibrium else start.equilibrium_rad
        simulated = _simulate(segments, values[0], values[1], values[2], equilibrium)
        # A wild guess of the parameters may fling the body away; keep the numbers finite.
        return np.clip((simulated - segments.angle_rad).ravel(), -10.0, 10.0)

    low, high = (np.array(bound[: len(guess)]) for bound in BOUNDS)
    inside = np.clip(guess, low + 1e-6, high - 1e-6)
    solution = least_squares(
        residuals, inside, bounds=(low, high), x_scale=np.maximum(np.abs(guess), 0.05)
    )
    jacobian: Array = np.asarray(solution.jac, dtype=np.float64)
    covariance = _covariance(jacobian, solution.fun, segments.angle_rad.shape[1])
    deviations = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    equilibrium = solution.x[3] if estimate_equilibrium else start.equilibrium_rad
    return CrossCheck(
        _estimates(solution.x, float(equilibrium)),
        _estimates(deviations, float(deviations[3]) if estimate_equilibrium else 0.0),
        float(np.sqrt(np.mean(solution.fun**2))),
    )


def _estimates(values: Array, equilibrium_rad: float) -> PitchEstimates:
    return PitchEstimates(float(values[0]), float(values[1]), float(values[2]), equilibrium_rad)


def _covariance(jacobian: Array, errors: Array, segments: int) -> Array:
    """Return the parameters' covariance, each segment's errors being one draw."""
    steps = len(errors) // segments
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    scores = (jacobian * errors[:, None]).reshape(steps, segments, -1).sum(axis=0)
    free = max(1, segments - jacobian.shape[1])
    return np.asarray(bread @ (scores.T @ scores) @ bread * (segments / free))


@dataclass(frozen=True, slots=True)
class _Segments:
    """All segments side by side: one column each."""

    step_s: float
    angle_rad: Array
    rate_start: Array
    mu_start: Array
    mu_middle: Array
    mu_end: Array


def _segments(record: PitchRecord, settings: PitchSettings, segment_s: float) -> _Segments:
    h = record.step_s
    steps = max(2, round(segment_s / h))
    count = len(record) // steps
    if count < 4:
        raise IdentificationError(
            f"the record of {record.duration_s:.1f} s holds {count} segments of {segment_s:g} s; the "
            "cross-check needs at least 4"
        )
    limit = settings.volts_max
    volts = np.clip(record.front_volts, -limit, limit) - np.clip(record.rear_volts, -limit, limit)
    lag = settings.motor_lag_s
    whole = math.exp(-h / lag) if lag > 0.0 else 0.0
    half = math.exp(-0.5 * h / lag) if lag > 0.0 else 0.0
    mu = np.empty(len(record) + 1)
    mu[0] = 0.0
    for index, held in enumerate(volts.tolist()):
        mu[index + 1] = held + (mu[index] - held) * whole
    middle = volts + (mu[:-1] - volts) * half
    window = max(5, round(SMOOTHING_S / h) | 1)
    smooth = savgol_filter(record.angle_rad, window, 3)
    rate = savgol_filter(record.angle_rad, window, 3, deriv=1, delta=h)
    used = count * steps
    columns = {
        name: values[:used].reshape(count, steps).T
        for name, values in (("start", mu[:-1]), ("middle", middle), ("end", mu[1:]))
    }
    angle = record.angle_rad[:used].reshape(count, steps).T.copy()
    angle[0] = smooth[:used:steps]
    return _Segments(h, angle, rate[:used:steps], columns["start"], columns["middle"], columns["end"])


def _simulate(
    segments: _Segments, damping: float, stiffness: float, gain: float, equilibrium: float
) -> Array:
    """Return the simulated angles of all segments: (11) by classical Runge-Kutta."""
    h = segments.step_s
    theta, omega = segments.angle_rad[0].copy(), segments.rate_start.copy()
    angles = np.empty_like(segments.angle_rad)
    for index in range(len(angles)):
        angles[index] = theta
        start, middle, end = (
            gain * segments.mu_start[index],
            gain * segments.mu_middle[index],
            gain * segments.mu_end[index],
        )
        k1 = start - damping * omega - stiffness * np.sin(theta - equilibrium)
        w2 = omega + 0.5 * h * k1
        k2 = middle - damping * w2 - stiffness * np.sin(theta + 0.5 * h * omega - equilibrium)
        w3 = omega + 0.5 * h * k2
        k3 = middle - damping * w3 - stiffness * np.sin(theta + 0.5 * h * w2 - equilibrium)
        w4 = omega + h * k3
        k4 = end - damping * w4 - stiffness * np.sin(theta + h * w3 - equilibrium)
        theta = theta + h / 6.0 * (omega + 2.0 * (w2 + w3) + w4)
        omega = omega + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)
    return angles
