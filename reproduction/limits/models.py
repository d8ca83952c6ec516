"""The linear models whose floors the page of limits shows."""

from __future__ import annotations

import math

import numpy as np

from tenbaud.bounds.linear import LinearModel, linear_model


def integrators(count: int, density: float) -> LinearModel:
    """Return a chain of integrators behind white noise of this density, its last one observed.

    One: the Wiener process. Two: an angle under white torque of `density` rad^2/s^3.
    """
    a = np.diag(np.ones(count - 1), 1)
    q = np.zeros((count, count))
    q[-1, -1] = density
    return linear_model(a, q, np.eye(count)[0])


def pitch(
    density_rad2_s3: float,
    *,
    rate_damping_per_s: float = 0.1,
    stiffness_per_s2: float = 0.5,
    angle_from_rest_rad: float = 0.0,
) -> LinearModel:
    """Return (2) linearised at an angle, under white torque; the lagging voltages are known, not noisy.

    theta'' = -a_w theta' - a_th cos(theta - theta_0) theta + w
    """
    stiffness = stiffness_per_s2 * math.cos(angle_from_rest_rad)
    return linear_model(
        [[0.0, 1.0], [-stiffness, -rate_damping_per_s]],
        [[0.0, 0.0], [0.0, density_rad2_s3]],
        [1.0, 0.0],
    )
