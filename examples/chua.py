"""Chua's chaotic circuit followed over 20 bit/s: own model, own plant, no controller at work.

x' = p (y - f(x)),  y' = x - y + z,  z' = -q y;  x is measured.    python examples/chua.py
"""

from tenbaud import fly

P, Q, M0, M1 = 9.0, 100.0 / 7.0, -1.0 / 7.0, 2.0 / 7.0


def slope(state, held):
    x, y, z = state
    current = M1 * x + 0.5 * (M0 - M1) * (abs(x + 1.0) - abs(x - 1.0))  # f(x)
    return (P * (y - current) + held[0], x - y + z + held[1], -Q * y)


def advance(state, held, step_s):
    # Midpoint rule, in plain arithmetic: both ends get the same bits.
    middle = tuple(s + 0.5 * step_s * d for s, d in zip(state, slope(state, held), strict=True))
    return tuple(s + step_s * d for s, d in zip(state, slope(middle, held), strict=True))


class Model:  # what both codecs predict with; volts do nothing to the circuit
    state_size, correction_size, input_size = 3, 2, 2

    def __init__(self, context):
        self.step_s = context.tick_s

    def initial(self):
        return (0.0, 0.0, 0.0)

    def measured(self, state):
        return state[:1]

    def tick(self, state, command, held):
        return advance(state, held, self.step_s)


class Plant:  # the circuit itself, which starts elsewhere
    state = (0.3, 0.1, -0.2)
    measured_rad = state[:1]

    def __init__(self, context):
        self.step_s = context.step_s

    def advance(self, volts):
        self.state = advance(self.state, (0.0, 0.0), self.step_s)
        self.measured_rad = self.state[:1]


if __name__ == "__main__":
    settings = {"model.kind": "chua:Model", "transmitter.plant.kind": "chua:Plant", "duration_s": 60.0}
    settings |= {"channel.rate_baud": 20.0, "timing.tick_s": 0.005, "timing.symbol_period_s": 0.05}
    settings |= {"coder.gains": [8.0, 0.0], "coder.decay": 0.9, "coder.window_signs": 3}
    run = fly("paper-20baud", settings=settings)
    share = abs(run.error_coded[run.time_s > 20.0]).max() / abs(run.pitch).max()
    print(
        f"{run.summary['coder_bits_up']:g} bits; error after 20 s at most {share:.1%} of the largest x"
    )
