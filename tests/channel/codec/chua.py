"""Chua's circuit as a second model of the codec: three states, no inputs, `x` is measured.

    x' = p (y - f(x)),  y' = x - y + z,  z' = -q y,  f(x) = m1 x + (m0 - m1) (|x + 1| - |x - 1|) / 2

With the usual numbers it is the double scroll: a chaotic plant without any command, so that only
symbols can keep an estimate near it. Time has no unit in the equations; here it is seconds.
"""

from __future__ import annotations

from channel.codec.codec import Vector
from channel.codec.coders.zoom import ZoomParameters

P = 9.0
Q = 100.0 / 7.0
M0 = -1.0 / 7.0
M1 = 2.0 / 7.0


def slope(state: Vector, held: Vector) -> Vector:
    x, y, z = state
    outer = x - 1.0 if x > 1.0 else (x + 1.0 if x < -1.0 else 0.0)
    current = M0 * (x - outer) + M1 * outer  # f(x), piece by piece
    return (P * (y - current) + held[0], x - y + z + held[1], -Q * y + held[2])


def shifted(state: Vector, change: Vector, share: float) -> Vector:
    return (
        state[0] + share * change[0],
        state[1] + share * change[1],
        state[2] + share * change[2],
    )


def advance(state: Vector, held: Vector, step_s: float) -> Vector:
    """One classical Runge-Kutta step."""
    first = slope(state, held)
    second = slope(shifted(state, first, 0.5 * step_s), held)
    third = slope(shifted(state, second, 0.5 * step_s), held)
    fourth = slope(shifted(state, third, step_s), held)
    total = tuple(first[axis] + 2.0 * (second[axis] + third[axis]) + fourth[axis] for axis in range(3))
    return shifted(state, total, step_s / 6.0)


class ChuaModel:
    """Chua's circuit as the codec's `Model`."""

    state_size = 3
    correction_size = 3
    input_size = 0

    def __init__(self, tick_s: float) -> None:
        self.tick_s = tick_s

    def initial(self) -> Vector:
        return (0.0, 0.0, 0.0)

    def measured(self, state: Vector) -> Vector:
        return state[:1]

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        return advance(state, held, self.tick_s)


class ChuaPlant:
    """The circuit itself, as a `Plant` that takes no voltage."""

    def __init__(self, tick_s: float, initial: Vector = (0.3, 0.1, -0.2)) -> None:
        self.state = initial
        self._tick_s = tick_s

    @property
    def measured(self) -> Vector:
        return self.state[:1]

    def advance(self, volts: Vector) -> None:
        self.state = advance(self.state, (0.0, 0.0, 0.0), self._tick_s)


CHUA_TICK_S = 0.005
CHUA_TICKS_PER_SAMPLE = 10
"""One symbol every 0.05 s: 20 bit/s."""
CHUA_ZOOM = ZoomParameters(
    initial_range=0.5,
    minimum_range=0.05,
    decay=0.9,
    window=3,
    gains=((8.0,), (0.0,), (0.0,)),
)
