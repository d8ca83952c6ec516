"""The codec: coder plus observer, one state machine, equal copies at both ends. Read this first.

The sensor node and the controller node each run one copy of this class. It does not know on which
end it is. Per sample it takes one *word* (for the paper, one sign) or an erasure, then the commands
of the sample's ticks, and nothing else: no clock, no arrival time, no setting that changes in
flight. From equal inputs equal states follow, to the last bit, and a 64-bit digest of the state
proves it sample by sample.

Three rules keep it so:

* **Role-free.** All differences between the ends are in their sessions, never here.
* **Restricted arithmetic.** Python floats with `+ - * /`, comparisons, `math.sqrt`, `math.floor`,
  integers, and the `sin`, `cos`, `exp` of `channel.codec.numerics`. The C library's functions differ
  between two processors in the last bit, and on a marginal plant one bit is enough in the end:
  nothing on the link pulls the copies together again. A test walks the syntax tree of this file.
* **Decisions from symbols.** The meaning of a word follows from symbols, which are integers, and not
  from comparisons of two floats that each end computed; the limits of a range are the exception, and
  give the same result on either side of the limit.

One sample `k`, its ticks `kN ... (k+1)N - 1`:

    encode   transmitter only: the word for the measurement, given the prediction
    open     both: the word (or ERASED) becomes a correction, and the coder adapts its range
    tick     both, N times: the model advances by one tick under a command and the held correction
    close    both: the state after the sample, of which the digest is computed

A coder declares an alphabet (for the paper: -1 and +1) and how many symbols make the word of one
sample. An erasure (the receiver saw no whole word in time) is distinct from every symbol, a paid
silence included.

Two parts plug in: a prediction `Model` (any states, inputs, measured axes) and a `Coder` (any
alphabet, any symbols per word, any correction). The paper's are `models.pitch` and `coders.zoom`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import MutableSequence, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import Final, NamedTuple, Protocol, TypeAlias

from channel.errors import CodecDiverged

Vector = tuple[float, ...]

STATE_MAX = 5e4
"""A state beyond this has diverged; angles stay within what `numerics.sin` takes."""

Word: TypeAlias = tuple[int, ...] | None
"""One sample's symbols in the order in which they were sent, or `ERASED`."""

ERASED: Final = None
"""No whole word arrived in time."""

WIRE_ERASED: Final = 0xFFFF
"""An erasure as a frame carries it; word numbers stay below."""

SYMBOLS_MAX: Final = 256
"""A frame has one byte for a symbol."""


class Alphabet:
    """The symbols of a coder, and the numbering of its words on the wire.

    A word of `b` symbols from an alphabet of `A` has a number in `0 ... A**b - 1`, its first symbol
    the least significant digit.
    """

    def __init__(self, symbols: tuple[int, ...], symbols_per_word: int) -> None:
        if not 2 <= len(symbols) <= SYMBOLS_MAX or len(set(symbols)) != len(symbols):
            raise ValueError(
                f"an alphabet needs 2 to {SYMBOLS_MAX} distinct symbols, got {len(symbols)}"
            )
        words = 1
        for _ in range(symbols_per_word):
            words *= len(symbols)
        if symbols_per_word < 1 or words > WIRE_ERASED:
            raise ValueError(
                f"{symbols_per_word} symbols of {len(symbols)} kinds make {words} words; "
                f"a word must have at least one symbol and at most {WIRE_ERASED} kinds of words"
            )
        self.symbols = symbols
        self.symbols_per_word = symbols_per_word
        self._digit = {symbol: digit for digit, symbol in enumerate(symbols)}
        self.words = words
        """how many kinds of words there are"""

    def symbol_number(self, symbol: int) -> int:
        """Return the digit that stands for one symbol; ValueError for a foreign one."""
        if symbol not in self._digit:
            raise ValueError(f"symbol {symbol} is not in the alphabet {self.symbols}")
        return self._digit[symbol]

    def symbol(self, number: int) -> int | None:
        return self.symbols[number] if 0 <= number < len(self.symbols) else None

    def word_number(self, word: Word) -> int:
        """Return the wire number of a word, `WIRE_ERASED` for an erasure."""
        if word is ERASED:
            return WIRE_ERASED
        if len(word) != self.symbols_per_word:
            raise ValueError(f"a word has {self.symbols_per_word} symbols, got {word}")
        number = 0
        for symbol in reversed(word):
            number = number * len(self.symbols) + self.symbol_number(symbol)
        return number

    def has_word(self, number: int) -> bool:
        return 0 <= number < self.words or number == WIRE_ERASED

    def word(self, number: int) -> Word:
        """Return the word with this wire number; ValueError when there is none."""
        if number == WIRE_ERASED:
            return ERASED
        if not 0 <= number < self.words:
            raise ValueError(f"word number {number} is outside 0 ... {self.words - 1}")
        digits = []
        for _ in range(self.symbols_per_word):
            number, digit = divmod(number, len(self.symbols))  # integers
            digits.append(self.symbols[digit])
        return tuple(digits)


class Model(Protocol):
    """Predicts the plant, one tick at a time.

    `state_size` states, of which the first `correction_size` take corrections; `input_size` command
    values per tick. Every method is pure.
    """

    state_size: int
    correction_size: int
    input_size: int

    def initial(self) -> Vector:
        """Return the state that both ends start from."""

    def measured(self, state: Vector) -> Vector:
        """Return the predicted measurements, one per measured axis."""

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        """Advance by one tick under a held command and a held correction (added to the derivative)."""


class Coder(Protocol):
    """Gives the word for a measurement and the meaning of a word. Every method is pure."""

    alphabet: Alphabet
    impulse: bool
    """True: the correction is added to the state once. False: held over the sample, as in (22)."""
    uses_rates: bool
    """True: words are formed from all corrected states: angles, then rates; not from angles alone."""

    def initial(self) -> Vector:
        """Return the coder state that both ends start from."""

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        """Return the word for a measurement, given the predicted one (transmitter only)."""

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        """Return (correction of the first model states, next coder state) for a word or ERASED."""

    def ranges(self, coder: Vector) -> Vector:
        """Return the range `M` of each measured axis, for display."""

    # A coder may have `is_state(coder: Vector) -> bool` too: whether it can be in a state that came
    # over a line. Without it, any finite one is taken. And `about(coder, word, correction)`: which
    # output each symbol of a word was about. Without it, they are about the outputs in turn.


class CodecState(NamedTuple):
    """The whole state of a copy of the codec, between two samples."""

    sample: int
    """Index of the next sample: that many words have been consumed."""
    model: Vector
    """Observer state at the first tick of that sample, before its word."""
    coder: Vector
    """Coder state, such as the range and the last signs."""


class OpenSample(NamedTuple):
    """A sample whose word has been consumed and whose ticks have not."""

    model: Vector
    """Observer state at the first tick, an impulse correction included."""
    held: Vector
    """Correction to hold over the sample's ticks."""
    coder: Vector
    """Coder state for the next sample."""


def add_correction(model: MutableSequence[float], correction: Sequence[float]) -> None:
    """Add an impulse correction to the first model states."""
    for axis in range(len(correction)):
        model[axis] = model[axis] + correction[axis]


def is_estimate(model: Sequence[float]) -> bool:
    """Return whether a model state is finite and within `STATE_MAX`."""
    for value in model:  # noqa: SIM110 (compiled by the studies, and faster than `all`)
        if not -STATE_MAX < value < STATE_MAX:
            return False
    return True


def is_coder_state(coder: Coder, state: Vector) -> bool:
    """Return whether this finite state is valid for a coder; True if the coder has no check."""
    check = getattr(coder, "is_state", None)
    return check is None or bool(check(state))


class Codec:
    """The state machine; immutable, so that one object serves any number of copies.

    `ticks_per_sample` is `N`, the ticks of one symbol period `T_s = N h`.
    """

    def __init__(self, model: Model, coder: Coder, ticks_per_sample: int) -> None:
        if ticks_per_sample < 1:
            raise ValueError(f"a sample has at least one tick, got {ticks_per_sample}")
        self.model = model
        self.coder = coder
        self.ticks_per_sample = ticks_per_sample
        # A coder from outside that has never heard of rates does without.
        self.uses_rates: bool = getattr(coder, "uses_rates", False)
        self.nothing_held: Vector = (0.0,) * model.correction_size
        self._layout = struct.Struct(f"<q{model.state_size + len(coder.initial())}d")

    def initial(self) -> CodecState:
        """Return the common state before sample 0."""
        return CodecState(0, self.model.initial(), self.coder.initial())

    def encode(self, state: CodecState, measurement: Vector) -> tuple[int, ...]:
        """Return the word for a measurement at the sample's first tick (20).

        For a coder that uses rates, the measurement holds one value per corrected state.
        """
        return self.coder.encode(state.coder, self.predicted(state), measurement)

    def predicted(self, state: CodecState) -> Vector:
        """Return the prediction of a measurement: angles, or all corrected states."""
        if self.uses_rates:
            return state.model[: self.model.correction_size]
        return self.model.measured(state.model)

    def open(self, state: CodecState, word: Word) -> OpenSample:
        """Consume the word of `state.sample`."""
        correction, coder = self.coder.decode(state.coder, state.model, word)
        if not self.coder.impulse:
            return OpenSample(state.model, correction, coder)
        corrected = list(state.model)
        add_correction(corrected, correction)
        return OpenSample(tuple(corrected), self.nothing_held, coder)

    def close(self, state: CodecState, opened: OpenSample, model: Vector) -> CodecState:
        """Return the state after the sample, `model` being the observer state after its last tick.

        Raises CodecDiverged when a state is not finite or beyond `STATE_MAX`.
        """
        if not is_estimate(model):
            raise CodecDiverged(
                f"the estimate diverged at sample {state.sample}: model state {model}; "
                "check the model's parameters and the units of the measurement"
            )
        return CodecState(state.sample + 1, model, opened.coder)

    def about(self, state: CodecState, word: Word, opened: Vector) -> tuple[int, ...] | None:
        """Return the index of the output that each symbol of a word codes; None for ERASED.

        `opened` is the model state after the word's correction. It follows from shared state, and no
        state depends on it: it is for display. None also if the coder fails to give one.
        """
        if word is ERASED:
            return None
        find = getattr(self.coder, "about", None)
        if find is None:
            return self._in_turn
        size = self.model.correction_size
        pairs = zip(opened[:size], state.model[:size], strict=True)
        correction = [after - before for after, before in pairs]
        try:
            found = tuple([int(place) for place in find(state.coder, word, correction)])
        except Exception:  # a coder from outside may fail in any way
            return None
        is_whole = len(found) == len(word) and all(0 <= place < self._outputs for place in found)
        return found if is_whole else None

    @cached_property
    def _outputs(self) -> int:
        return len(self.model.measured(self.model.initial()))

    @cached_property
    def _in_turn(self) -> tuple[int, ...]:
        count = self.coder.alphabet.symbols_per_word
        return tuple([place * self._outputs // count for place in range(count)])  # integers

    def step(self, state: CodecState, word: Word, commands: Sequence[Vector]) -> CodecState:
        """Run one whole sample: its word, then the commands of its `N` ticks."""
        return self.trace(state, word, commands)[0]

    def trace(
        self, state: CodecState, word: Word, commands: Sequence[Vector]
    ) -> tuple[CodecState, list[Vector]]:
        """Run one whole sample; return the state after it and the model state at each of its ticks."""
        if len(commands) != self.ticks_per_sample:
            raise ValueError(f"a sample has {self.ticks_per_sample} ticks, got {len(commands)}")
        opened = self.open(state, word)
        tick = self.model.tick
        model = opened.model
        held = opened.held
        states = []
        for command in commands:
            states.append(model)
            model = tick(model, command, held)
        return self.close(state, opened, model), states

    def pack(self, state: CodecState) -> bytes:
        """Return the canonical bytes of a state: index, model, coder; little-endian, no minus zero."""
        values = [value + 0.0 for value in state.model + state.coder]
        return self._layout.pack(state.sample, *values)

    def unpack(self, data: bytes) -> CodecState:
        """Return the state with these canonical bytes; ValueError if they are not of this codec."""
        if len(data) != self._layout.size:
            raise ValueError(f"a state of this codec has {self._layout.size} bytes, got {len(data)}")
        sample, *values = self._layout.unpack(data)
        if sample < 0 or not all(math.isfinite(value) for value in values):
            raise ValueError("the state has a negative index or a value that is not finite")
        size = self.model.state_size
        return CodecState(sample, tuple(values[:size]), tuple(values[size:]))

    def digest(self, state: CodecState) -> int:
        """Return the 64-bit digest of a state."""
        return int.from_bytes(blake2b(self.pack(state), digest_size=8).digest(), "little")


@dataclass(frozen=True, slots=True)
class ModelContext:
    """For a prediction model."""

    tick_s: float
    """h: the step of one call of `tick`"""
    symbol_period_s: float
    """T_s"""


@dataclass(frozen=True, slots=True)
class CoderContext:
    """For a coder."""

    tick_s: float
    symbol_period_s: float
    """T_s: one word per this time"""
    model: Model
    """the model that it corrects"""
