"""Systems of python-control, and flights of them. It is imported where a test is run, not collected."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from tenbaud import Run, fly

A, B, C = [[0.0, 1.0], [-2.0, -0.5]], [[0.0], [1.0]], [[1.0, 0.0]]
SECONDS = 4.0
NAMED = {
    "states": ["Angle [rad]", "rate (rad/s)"],
    "inputs": ["motor, V"],
    "outputs": ["angle [rad]"],
}
UNDISTURBED = {"transmitter.plant.disturbance": ""}


def flown(system: Any, folder: Path, **given: Any) -> Run:
    settings = {"duration_s": SECONDS, **given.pop("settings", {})}
    return fly(system, settings=settings, out=folder / "run", **given)


def masses() -> Any:
    """Two masses, each on a spring, with a spring between them."""
    import control

    return control.ss(
        [[0, 1, 0, 0], [-3, -1, 1, 0], [0, 0, 0, 1], [1, 0, -3, -1]],
        [[0, 0], [1, 0], [0, 0], [0, 1]],
        [[1, 0, 0, 0], [0, 0, 1, 0]],
        0,
        states=["left", "left_rate", "right", "right_rate"],
    )


def pendulum(gravity: float = 9.81, drift: float = 0.0) -> Any:
    """A pendulum that hangs, with friction; `drift` turns its gravity with time."""
    import control

    def dynamics(t: float, x: Any, u: Any, params: Any) -> list[float]:
        return [x[1], -gravity * math.sin(x[0] + drift * t) - 0.2 * x[1] + u[0]]

    signals = {
        "inputs": ["torque [N m]"],
        "outputs": ["angle [rad]"],
        "states": ["angle [rad]", "rate"],
    }
    return control.nlsys(dynamics, lambda t, x, u, params: x[:1], **signals)
