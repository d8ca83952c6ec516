"""The structure of every coder here: two functions over numbers, and constants for them.

The nodes run these functions as they stand; a study compiles the very same ones (numba), so that each
formula has one text. They therefore keep to what both understand: they read sequences of numbers by
index and write their results by index into sequences that the caller provides (lists here, arrays
there); constants come as one named tuple of numbers and of tuples of numbers; helpers are functions of
the same kind. No strings, objects or exceptions within, and no lists but of numbers to work in, made by
`[0.0] * n` and declared by `allocates`.
"""

from __future__ import annotations

from collections.abc import Callable, MutableSequence, Sequence
from typing import Any, NamedTuple, TypeAlias

from channel.codec.codec import ERASED, Alphabet, Model, Vector, Word

Numbers: TypeAlias = Sequence[float]
Results: TypeAlias = MutableSequence[float]
Symbols: TypeAlias = Sequence[int]
SymbolResults: TypeAlias = MutableSequence[int]


class CoderFunctions(NamedTuple):
    """The arithmetic of one kind of coder."""

    encode: Callable[[Any, Numbers, Numbers, Numbers, SymbolResults], None]
    """(constants, coder, predicted, measurement, symbols): writes the word that is asked for"""
    decode: Callable[[Any, Numbers, Numbers, Symbols, bool, Results, Results], None]
    """(constants, coder, model, symbols, erased, correction, after): writes the correction of the
    first model states and the next coder state; an erased word has the symbol 0 everywhere"""
    allocates: bool = False
    """whether they make lists to work in"""


def readout_of(model: Model) -> list[Vector]:
    """Return, for each output, how much of each corrected state is in it, near the start."""
    start = model.initial()
    moved = [
        tuple([value + (place == at) for place, value in enumerate(start)])
        for at in range(model.correction_size)
    ]
    columns = [model.measured(state) for state in moved]
    return [
        tuple([column[output] - value for column in columns])
        for output, value in enumerate(model.measured(start))
    ]


class FunctionCoder:
    """A `Coder` made of functions. Kinds derive from it and say what is named below."""

    functions: CoderFunctions
    constants: Any
    """the named tuple that the functions take first"""
    alphabet: Alphabet
    impulse: bool
    uses_rates: bool = False
    correction_size: int
    """model states that a correction is for"""

    def initial(self) -> Vector:
        return ()

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        symbols = [0] * self.alphabet.symbols_per_word
        self.functions.encode(self.constants, coder, predicted, measurement, symbols)
        return tuple(symbols)

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        correction = [0.0] * self.correction_size
        after = [0.0] * len(coder)
        if word is ERASED:
            nothing = (0,) * self.alphabet.symbols_per_word
            self.functions.decode(self.constants, coder, state, nothing, True, correction, after)
        else:
            self.functions.decode(self.constants, coder, state, word, False, correction, after)
        return tuple(correction), tuple(after)
