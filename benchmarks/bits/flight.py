"""Golden vectors made again, and flights over fixed inputs: what every place must have the bits of.

    python -I -S benchmarks/bits/flight.py SAMPLES OTHERS

It needs Python and its standard library alone: Debian's for aarch64 and Pyodide run this file.
`flight.c` does the same, draw for draw, with the exported codec. `SAMPLES`: of the paper's codec;
`OTHERS`: of each other one.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

if not __package__:
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from channel.codec.codec import ERASED, Codec, CodecState, Word
from channel.codec.downlink.machine import TwoWay
from channel.errors import CodecDiverged
from tests.golden.regenerate import FOLDER, GENERATORS, GOLDEN_CODECS, render, two_way_machines

CHECKPOINTS = 10
LONGEST = "paper"
CANNOT_STEP = (CodecDiverged, ValueError, ArithmeticError, IndexError)
ODD, MASK = 0x9E3779B97F4A7C15, 0xFFFFFFFFFFFFFFFF


class Noise:
    """Chance that C has too: a linear congruence of 32 bits."""

    def __init__(self) -> None:
        self._value = 1

    def draw(self, count: int) -> int:
        """Return one of 0 ... count - 1."""
        self._value = self._value * 1_664_525 + 1_013_904_223 & 0xFFFFFFFF
        return (self._value >> 8) % count

    def commands(self, codec: Codec) -> list[tuple[float, ...]]:
        """Return the commands of a sample, in steps of 1/1000."""
        inputs = range(codec.model.input_size)
        ticks = range(codec.ticks_per_sample)
        return [tuple([(self.draw(2001) - 1000) / 1000.0 for _ in inputs]) for _ in ticks]


def word_at(codec: Codec, state: CodecState, noise: Noise) -> Word:
    """Return the word for a noisy triangle; of 16 words one is erased, and one is drawn."""
    phase = state.sample % 200
    level = ((phase if phase < 100 else 200 - phase) - 50) / 100.0
    measured = [
        (level if place == 0 else 0.0) + (noise.draw(2001) - 1000) / 50_000.0
        for place in range(len(codec.predicted(state)))
    ]
    kind = noise.draw(16)
    if kind == 0:
        return ERASED
    if kind > 1:
        try:
            return codec.encode(state, tuple(measured))
        except CANNOT_STEP:
            pass
    alphabet = codec.coder.alphabet
    count = range(alphabet.symbols_per_word)
    return tuple([alphabet.symbols[noise.draw(len(alphabet.symbols))] for _ in count])


class OneWay:
    """A codec; its commands are numbers."""

    def __init__(self, codec: Codec) -> None:
        self.codec = codec
        self.digest = codec.digest

    def initial(self, sample: int) -> CodecState:
        return self.codec.initial()._replace(sample=sample)

    def step(self, state: CodecState, noise: Noise) -> CodecState:
        word = word_at(self.codec, state, noise)
        return self.codec.step(state, word, noise.commands(self.codec))


class BothWays:
    """The state machine of a narrow downlink; its commands are symbols."""

    def __init__(self, machine: TwoWay) -> None:
        self.codec = machine.codec
        self.digest = machine.digest
        self._machine = machine

    def initial(self, sample: int) -> Any:
        state = self._machine.initial()
        return state._replace(codec=state.codec._replace(sample=sample))

    def step(self, state: Any, noise: Noise) -> Any:
        word = word_at(self.codec, state.codec, noise)
        symbols = [noise.draw(2) for _ in range(self._machine.commands_in(state))]
        return self._machine.step(state, word, symbols).state


def fly(flown: Any, samples: int) -> list[str]:
    """Fly; return what the digests come to at each checkpoint, and how many samples failed."""
    noise, chain, failed, found = Noise(), 0, 0, []
    state = flown.initial(0)
    for sample in range(samples):
        try:
            state = flown.step(state, noise)
        except CANNOT_STEP:
            failed += 1
            state = flown.initial(sample + 1)
        chain = (chain ^ flown.digest(state)) * ODD & MASK
        if (sample + 1) % (samples // CHECKPOINTS) == 0:
            found.append(f"{chain:016x}")
    return [*found, str(failed)]


def flights(samples: int, others: int) -> dict[str, list[str]]:
    """Fly every golden codec and both ways; return what each came to."""
    codecs = {name: OneWay(codec) for name, codec in GOLDEN_CODECS.items()}
    machines = {f"both ways, {name}": BothWays(one) for name, one in two_way_machines().items()}
    return {
        name: fly(flown, samples if name == LONGEST else others)
        for name, flown in {**codecs, **machines}.items()
    }


def golden() -> dict[str, int]:
    """Make every golden file again; return how many differ: 0 or 1 for each."""
    return {
        name: int(render(make()) != (FOLDER / f"{name}.json").read_text(encoding="utf-8"))
        for name, make in GENERATORS.items()
    }


def report(samples: int, others: int) -> str:
    """Return the lines that each place prints: golden vectors, then flights."""
    lines = [f"golden;{name};{count}" for name, count in golden().items()]
    lines += [f"flight;{name};{';'.join(one)}" for name, one in flights(samples, others).items()]
    return "\n".join([*lines, "end"])


if __name__ == "__main__":
    print(report(int(sys.argv[1]), int(sys.argv[2])))
