"""Moments of a flight as pictures of the plant: the helicopter in space, or the pendulum.

The page draws the helicopter by the same lines (`tenbaud/view/static/pose.js`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from channel.codec.signals import Signals
from tenbaud.recording.envelope import Curve
from tenbaud.recording.style import LINE_A, LINE_B

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Lines = list[npt.NDArray[np.float64]]
"""Of each line its points, a row each."""

AZIMUTH, TILT = -0.5, 0.6
LENGTH, SPAN, RADIUS, MAST, WEIGHT = 1.0, 0.42, 0.24, 0.09, -0.55
MOMENTS = 6
RADIANS = {"": 1.0, "rad": 1.0, "deg": np.pi / 180.0}
"""of a unit of the angles that are drawn"""


def has_poses(plant: Signals) -> bool:
    """Return whether there are poses of a plant here: of its picture, from outputs that are angles."""
    return (plant.picture, len(plant.outputs)) in _LINES and all(
        one.unit in RADIANS for one in plant.outputs
    )


def draw_poses(panel: Axes, plant: Signals, true: Sequence[Curve], estimated: Sequence[Curve]) -> None:
    """Draw moments of a flight from left to right, at their times; each output has its curves."""
    lines_of, frame = _LINES[plant.picture, len(plant.outputs)]
    scales = [RADIANS[one.unit] for one in plant.outputs]
    begin_s, end_s = true[0][0][[0, -1]]
    panel.axis("off")
    width = 1.0 / MOMENTS
    for number in range(MOMENTS):
        share = (number + 0.5) * width
        time_s = begin_s + share * (end_s - begin_s)
        one = panel.inset_axes((share - 0.5 * width, 0.0, width, 1.0))
        one.set(xlim=frame[:2], ylim=frame[2:], aspect="equal")
        one.axis("off")
        for curves, color, size in ((true, LINE_A, 2.6), (estimated, LINE_B, 1.0)):
            angles = np.array([value_at(curve, time_s) for curve in curves]) * scales
            if np.isfinite(angles).all():
                for line in lines_of(*angles):
                    one.plot(line[:, 0], line[:, 1], color=color, linewidth=size, clip_on=False)
        one.set_title(f"{time_s:.0f} s", fontsize=8, y=-0.12)
    for color, size, label in ((LINE_A, 2.6, "true"), (LINE_B, 1.0, "estimate")):
        panel.plot([], [], color=color, linewidth=size, label=label)


def value_at(curve: Curve, time_s: float) -> float:
    """Return the last value of a curve by that time; NaN in a gap, before and after it."""
    times_s, values = curve
    place = int(np.searchsorted(times_s, time_s, side="right")) - 1
    return float(values[place]) if place >= 0 and time_s <= times_s[-1] else float("nan")


def helicopter_lines(travel: float, elevation: float, pitch: float) -> Lines:
    """Return arm, counterweight, body, rotors and post as seen from above and the side."""
    turns = np.linspace(0.0, 2.0 * np.pi, 25)
    rotors = [
        np.column_stack(
            (LENGTH + RADIUS * np.cos(turns), place + RADIUS * np.sin(turns), np.full(25, MAST))
        )
        for place in (-SPAN, SPAN)
    ]
    weight = [[WEIGHT, y, z] for y, z in ((-0.1, -0.06), (0.1, -0.06), (0.1, 0.06), (-0.1, 0.06))]
    moving = [
        np.array([[WEIGHT, 0.0, 0.0], [LENGTH, 0.0, 0.0]]),
        np.array([*weight, weight[0]]),
        np.array([[LENGTH, y, z] for y, z in ((-SPAN, MAST), (-SPAN, 0), (SPAN, 0), (SPAN, MAST))]),
        *rotors,
    ]
    whole = _about(0, 1, travel) @ _about(0, 2, elevation) @ _about(1, 2, pitch)
    lines = [line @ whole.T for line in moving]
    lines.append(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -0.8]]))
    right = np.array([np.cos(AZIMUTH), -np.sin(AZIMUTH), 0.0])
    away = np.array([np.sin(AZIMUTH), np.cos(AZIMUTH), 0.0])
    up = np.array([0.0, 0.0, np.cos(TILT)]) + np.sin(TILT) * away
    return [line @ np.column_stack((right, up)) for line in lines]


def pendulum_lines(angle: float) -> Lines:
    """Return the rod, its bob and its stand."""
    tip = np.array([-np.sin(angle), np.cos(angle)])
    turns = np.linspace(0.0, 2.0 * np.pi, 13)
    bob = tip + 0.07 * np.column_stack((np.cos(turns), np.sin(turns)))
    return [np.array([[0.0, 0.0], tip]), bob, np.array([[-0.3, 0.0], [0.3, 0.0]])]


def _about(one: int, other: int, angle: float) -> npt.NDArray[np.float64]:
    """Return the rotation that turns an axis towards another one."""
    turn = np.eye(3)
    turn[[one, other], [one, other]] = np.cos(angle)
    turn[other, one], turn[one, other] = np.sin(angle), -np.sin(angle)
    return turn


_LINES: dict[tuple[str, int], tuple[Callable[..., Lines], tuple[float, float, float, float]]] = {
    ("helicopter", 3): (helicopter_lines, (-0.75, 1.3, -0.75, 0.75)),
    ("pendulum", 1): (pendulum_lines, (-1.1, 1.1, -0.1, 1.2)),
}
"""Picture and number of outputs to the lines of a pose, and what is seen of the plane."""
