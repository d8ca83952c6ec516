"""Chua's chaotic circuit followed over 20 bit/s: own model, own plant, no controller at work.

x' = p (y - f(x)),  y' = x - y + z,  z' = -q y;  x is measured.    python examples/chua.py
"""

from tenbaud import fly
from tenbaud.coders import Vector, ZoomCoder, ZoomParameters

P, Q, M0, M1 = 9.0, 100.0 / 7.0, -1.0 / 7.0, 2.0 / 7.0
TICK_S = 0.005


def slope(state: Vector, held: Vector) -> Vector:
    x, y, z = state
    current = M1 * x + 0.5 * (M0 - M1) * (abs(x + 1.0) - abs(x - 1.0))  # f(x)
    return (P * (y - current) + held[0], x - y + z + held[1], -Q * y)


def advance(state: Vector, held: Vector) -> Vector:
    # Midpoint rule, in plain arithmetic: both ends get the same bits.
    middle = tuple(s + 0.5 * TICK_S * d for s, d in zip(state, slope(state, held), strict=True))
    return tuple(s + TICK_S * d for s, d in zip(state, slope(middle, held), strict=True))


class Model:  # what both codecs predict with; volts do nothing to the circuit
    state_size, correction_size, input_size = 3, 2, 2

    def initial(self) -> Vector:
        return (0.0, 0.0, 0.0)

    def measured(self, state: Vector) -> Vector:
        return state[:1]

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        return advance(state, held)


class Plant:  # the circuit itself, which starts elsewhere
    state: Vector = (0.3, 0.1, -0.2)
    measured = state[:1]

    def advance(self, volts: Vector) -> None:
        self.state = advance(self.state, (0.0, 0.0))
        self.measured = self.state[:1]


if __name__ == "__main__":
    settings = {
        "channel.rate_baud": 20.0,
        "timing.tick_s": TICK_S,
        "timing.symbol_period_s": 0.05,
        "duration_s": 60.0,
    }
    coder = ZoomCoder(ZoomParameters(gains=((8.0,), (0.0,)), decay=0.9, window=3))
    run = fly("paper-20baud", settings=settings, model=Model(), coder=coder, plant=Plant())
    share = abs(run.error_coded[run.time_s > 20.0]).max() / abs(run.output_1).max()
    print(
        f"{run.summary['coder_bits_up']:g} bits; error after 20 s at most {share:.1%} of the largest x"
    )
