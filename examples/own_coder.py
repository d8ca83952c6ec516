"""A coder of your own: `bits` bits of the estimation error, over a range that adjusts itself.

It runs at both ends and must give both the same bits, so it keeps to + - * /, comparisons and whole
numbers: no numpy, no `math.sin`.    python examples/own_coder.py
"""

import numpy as np

from tenbaud import fly
from tenbaud.coders import ERASED, Alphabet, Vector, Word


class Cells:
    """Cuts the range into 2^bits cells; an error in an outer cell widens it, any other narrows it."""

    impulse = True  # a correction is added to the state at once
    uses_rates = False  # it looks at angles alone

    def __init__(self, bits: int, gain: float = 0.9, rate: float = 1.0):
        self.bits, self.cells = bits, 1 << bits
        self.gains = (gain, rate)  # of the correction: angle, rate (1/s)
        self.alphabet = Alphabet((0, 1), bits)

    def initial(self) -> Vector:
        return (0.5,)  # half the width of all cells, in rad

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        share = (measurement[0] - predicted[0]) / coder[0]  # -1 ... 1 within the cells
        cell = int((share + 1.0) / 2.0 * self.cells) if share > -1.0 else 0
        cell = min(cell, self.cells - 1)
        return tuple(cell >> place & 1 for place in range(self.bits))

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        if word is ERASED:
            return (0.0, 0.0), (coder[0] * 1.2,)
        cell = sum(bit << place for place, bit in enumerate(word))
        error = coder[0] * ((2 * cell + 1) / self.cells - 1.0)
        width = coder[0] * (1.6 if cell in (0, self.cells - 1) else 0.7)
        return (self.gains[0] * error, self.gains[1] * error), (max(width, 0.004),)

    def ranges(self, coder: Vector) -> Vector:
        return coder


if __name__ == "__main__":
    for bits in (2, 3, 4):  # all at 20 bit/s: more bits per word, fewer words
        settings = {"channel.rate_baud": 20.0, "timing.symbol_period_s": bits / 20.0}
        settings |= {"transmitter.plant.mismatch": 0.1, "duration_s": 60.0}
        run = fly("tuned-20baud", settings=settings, coder=Cells(bits))
        print(f"{bits} bits per word: rms error {np.sqrt(np.mean(run.error_coded**2)):.4f} rad")
