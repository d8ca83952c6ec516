"""Chua's chaotic circuit followed over 20 bit/s: own model, own plant, no controller at work.

x' = p (y - f(x)),  y' = x - y + z,  z' = -q y;  x is measured.    python examples/chua.py
"""

import numpy as np

from tenbaud import fly

P, Q, M0, M1 = 9.0, 100.0 / 7.0, -1.0 / 7.0, 2.0 / 7.0
Vector = tuple[float, ...]


def slope(state: Vector, held: Vector) -> Vector:
    x, y, z = state
    outer = x - 1.0 if x > 1.0 else (x + 1.0 if x < -1.0 else 0.0)
    current = M0 * (x - outer) + M1 * outer  # f(x), piece by piece
    return (P * (y - current) + held[0], x - y + z + held[1], -Q * y)


def advance(state: Vector, held: Vector, step_s: float) -> Vector:
    """Midpoint rule, in plain arithmetic: both ends get the same bits."""
    middle = tuple(s + 0.5 * step_s * d for s, d in zip(state, slope(state, held), strict=True))
    return tuple(s + step_s * d for s, d in zip(state, slope(middle, held), strict=True))


class Model:  # what both codecs predict with; volts do nothing to the circuit
    state_size, correction_size, input_size = 3, 2, 2

    def __init__(self, context) -> None:
        self.step_s = context.tick_s

    def initial(self) -> Vector:
        return (0.0, 0.0, 0.0)

    def measured(self, state: Vector) -> Vector:
        return state[:1]

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        return advance(state, held, self.step_s)


class Plant:  # the circuit itself, which starts elsewhere
    def __init__(self, context) -> None:
        self.measured_rad, self.state, self.step_s = (0.3,), (0.3, 0.1, -0.2), context.step_s

    def advance(self, volts: Vector) -> None:
        self.state = advance(self.state, (0.0, 0.0), self.step_s)
        self.measured_rad = self.state[:1]


if __name__ == "__main__":
    settings = {"model.kind": "chua:Model", "transmitter.plant.kind": "chua:Plant", "duration_s": 60.0}
    settings |= {"channel.rate_baud": 20.0, "timing.tick_s": 0.005, "timing.symbol_period_s": 0.05}
    settings |= {"coder.gains": [8.0, 0.0], "coder.decay": 0.9, "coder.window_signs": 3}
    run = fly("paper-20baud", settings=settings)
    share = np.abs(run.error_coded[run.time_s > 20.0]).max() / np.abs(run.pitch).max()
    print(
        f"{run.summary['coder_bits_up']:g} bits; error after 20 s at most {share:.1%} of the largest x"
    )
