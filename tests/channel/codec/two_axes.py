"""A model of two axes: two double integrators, two measured angles, two commands, four corrections."""

from __future__ import annotations

from channel.codec.codec import Vector
from channel.codec.coders.zoom import ZoomParameters

TWO_AXES_ZOOM = ZoomParameters(
    initial_range=0.5,
    minimum_range=0.02,
    decay=0.9,
    window=3,
    gains=((4.0, 0.0), (0.0, 4.0), (6.0, 0.0), (0.0, 6.0)),
)


class TwoAxes:
    """States (angle a, angle b, rate a, rate b); a command is one acceleration per axis."""

    state_size = 4
    correction_size = 4
    input_size = 2

    def __init__(self, tick_s: float) -> None:
        self.tick_s = tick_s

    def initial(self) -> Vector:
        return (0.0, 0.0, 0.0, 0.0)

    def measured(self, state: Vector) -> Vector:
        return state[:2]

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        h = self.tick_s
        a, b, rate_a, rate_b = state
        push_a, push_b = command[0] + held[2], command[1] + held[3]
        return (
            a + h * (rate_a + held[0]) + 0.5 * h * h * push_a,
            b + h * (rate_b + held[1]) + 0.5 * h * h * push_b,
            rate_a + h * push_a,
            rate_b + h * push_b,
        )


class TwoAxesPlant:
    """The two integrators themselves, as a `Plant`."""

    def __init__(self, tick_s: float, initial: Vector) -> None:
        self.state = initial
        self._model = TwoAxes(tick_s)

    @property
    def measured(self) -> Vector:
        return self.state[:2]

    def advance(self, volts: Vector) -> None:
        self.state = self._model.tick(self.state, volts, (0.0, 0.0, 0.0, 0.0))
