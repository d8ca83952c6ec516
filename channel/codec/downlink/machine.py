"""The two-way state machine: the codec, and with it all that follows from what went down.

Its state X is the codec's state, the commands that are decided and not yet flown, the last command,
and the state of the command scheme. Its inputs are, for each sample, the up word that the receiver
consumed and the command symbols that it sent. The receiver's X is the truth; the transmitter finds
out what X is (`transmitter.session.narrow`). One sample `k`:

    1. hash symbols are read from the digest of X as it stands, each of them inverted if the word of
       sample `k` is erased
    2. the codec consumes the word
    3. command symbols are consumed, and settle what is commanded
    4. the codec flies its N ticks, and the commands of ticks kN + D ... (k+1)N + D - 1 are decided on
       the model's prediction, as with every other downlink (`channel.codec.lead`)

The command symbols come first within a sample, and hash symbols after them. The first hash symbol of
a sample does not say a bit of X: it says the bit *owed* in X, and the parity of the sample's command
symbols. What is owed is a bit of the state before the last sample that had a hash symbol, and the
parity of that sample's inputs (word and command symbols); of samples without a hash symbol since, the
parity of their command symbols and of [the word is erased]. The second hash symbol of a sample, where
it has one, says a bit of X and the parity of the word. Two copies that differ in one input alone
therefore differ in a hash symbol of the same sample or the next for certain, where a bit of the digest
tells them apart by chance.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Sequence
from hashlib import blake2b
from typing import NamedTuple

from channel.codec.codec import ERASED, Codec, CodecState, Vector, Word, is_coder_state
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.scheme import Scheme
from channel.codec.lead import fly_sample

Wanted = Callable[[int, Vector], Vector]
"""(tick, predicted model state) -> what is wanted there: a command, or set-points."""


class TwoWayState(NamedTuple):
    """X between two samples."""

    codec: CodecState
    commands: tuple[Vector, ...]
    """of the next D ticks"""
    hold: Vector
    """the last command decided"""
    down: Vector
    """of the command scheme"""
    owed: float = 0.0
    """0 or 1: what the next sample's first hash symbol says beside its command symbols"""

    @property
    def sample(self) -> int:
        """Return the index of the next sample."""
        return self.codec.sample


class TwoWaySample(NamedTuple):
    """One sample that was flown."""

    state: TwoWayState
    """after it"""
    commands: list[Vector]
    """of ticks kN + D ... (k+1)N + D - 1"""
    live: list[Vector]
    """the predicted model states that they rest on"""
    coded: list[Vector]
    """the codec's model states at ticks kN ... (k+1)N - 1"""


class TwoWay:
    """The state machine; immutable, so that one object serves any number of copies.

    ValueError for limits that do not fit the model's inputs.
    """

    def __init__(
        self,
        codec: Codec,
        scheme: Scheme,
        layout: Layout,
        lead_ticks: int,
        initial_command: Vector,
        command_max: Vector,
        slew_per_tick: Vector,
    ) -> None:
        inputs = codec.model.input_size
        if lead_ticks < 0 or not inputs == len(initial_command) == len(command_max) == len(
            slew_per_tick
        ):
            raise ValueError(
                f"the plant has {inputs} input(s) and the command lead is {lead_ticks}; got "
                f"{len(initial_command)} first command(s), {len(command_max)} limit(s) and "
                f"{len(slew_per_tick)} slew limit(s)"
            )
        self.codec = codec
        self.scheme = scheme
        self.layout = layout
        self.lead_ticks = lead_ticks
        self.initial_command = initial_command
        self._command_max = command_max
        self._slew = slew_per_tick
        first = self.initial()
        self._sizes = (len(first.codec.model), len(first.codec.coder), inputs, len(first.down))
        floats = len(first.codec.model) + len(first.codec.coder) + len(first.down)
        self._layout = struct.Struct(f"<q{floats + inputs * (lead_ticks + 1) + 1}d")
        self.numbers = floats + codec.ticks_per_sample * len(first.codec.model)
        """that a sample works on, a measure of its cost that is the same on every machine"""

    def initial(self, sample: int = 0) -> TwoWayState:
        """Return the common state of a flight that begins with this sample."""
        command = self.initial_command
        known = (command,) * self.lead_ticks
        codec = self.codec.initial()._replace(sample=sample)
        return TwoWayState(codec, known, command, self.scheme.initial())

    def commands_in(self, state: TwoWayState) -> int:
        """Return how many of the next sample's symbols are command symbols."""
        return self.layout.commands_in(state.codec.sample, self.scheme.word_age(state.down))

    def hashed(self, state: TwoWayState, digest: int) -> int:
        """Return the bits of the next sample's hash symbols, the first one lowest.

        The parity of the command symbols inverts the first of them, that of the word the second, and an
        erased word all.
        """
        return digest >> 1 << 1 | int(state.owed)

    def hash_symbols(
        self, state: TwoWayState, digest: int, commands: Sequence[int | None], word: Word
    ) -> tuple[int, ...]:
        """Return a sample's hash symbols: of the state before it, its digest, and its inputs."""
        erased = 1 if word is ERASED else 0
        bits = self.hashed(state, digest) ^ parity(commands) ^ self.word_parity(word) << 1
        count = self.layout.symbols_per_sample - len(commands)
        return tuple([bits >> place & 1 ^ erased for place in range(count)])

    def fly(
        self, state: TwoWayState, word: Word, wanted: Wanted
    ) -> tuple[TwoWaySample, tuple[int, ...]]:
        """Fly a sample at the receiver; return it and all its symbols, in the order of their slots."""
        sent: list[int] = []
        count = self.commands_in(state)
        scheme = self.scheme

        def chosen(tick: int, live: Vector, down: Vector) -> Vector:
            now = wanted(tick, live) if count or scheme.asks_every_tick else ()

            def ago(samples: int) -> Vector:
                before = tick - samples * self.codec.ticks_per_sample
                return now if samples == 0 else wanted(before if before > 0 else 0, live)

            for _ in range(count):
                symbol = scheme.encode(down, ago, live)
                sent.append(symbol)
                down = scheme.take(down, symbol)
            return down

        digest = self.digest(state)
        ask = wanted if scheme.asks_every_tick else None
        flown = self._flown(state, digest, word, sent, chosen, ask)
        return flown, (*sent, *self.hash_symbols(state, digest, sent, word))

    def step(
        self,
        state: TwoWayState,
        word: Word,
        symbols: Sequence[int | None],
        digest: int | None = None,
    ) -> TwoWaySample:
        """Fly a sample with these command symbols; None: not known, so predict without it.

        `digest`: the state's, where it is known already.
        """
        scheme = self.scheme

        def given(tick: int, live: Vector, down: Vector) -> Vector:
            for symbol in symbols:
                down = scheme.guess(down) if symbol is None else scheme.take(down, symbol)
            return down

        digest = self.digest(state) if digest is None else digest
        return self._flown(state, digest, word, symbols, given, None)

    def _flown(
        self,
        state: TwoWayState,
        digest: int,
        word: Word,
        symbols: Sequence[int | None],
        consume: Callable[[int, Vector, Vector], Vector],
        ask: Wanted | None,
    ) -> TwoWaySample:
        """Fly a sample; `consume`, called at the first tick decided, takes the command symbols.

        It returns the scheme's state after them; `symbols` has them by then. `ask` is a controller that
        wants to see every tick.
        """
        scheme, measured = self.scheme, self.codec.model.measured
        largest, slew = self._command_max, self._slew
        down, hold = state.down, state.hold
        first = True

        def decide(tick: int, live: Vector) -> Vector:
            nonlocal down, hold, first
            if first:
                down = scheme.settle(consume(tick, live, down))
                first = False
            elif ask is not None:
                ask(tick, live)
            command, down = scheme.command(down, measured(live), live)
            hold = limited_all(command, hold, largest, slew)
            return hold

        flown = fly_sample(self.codec, state.codec, word, state.commands, decide)
        known = (*state.commands, *flown.commands)[self.codec.ticks_per_sample :]
        owed = self._owed(state, digest, word, symbols)
        after = TwoWayState(flown.state, known, hold, down, owed)
        return TwoWaySample(after, flown.commands, flown.live, flown.coded)

    def outlook(
        self, state: TwoWayState, digest: int, word: Word, symbols: Sequence[int | None]
    ) -> TwoWayState:
        """Return what a sample leads to as far as it is known without flying it.

        Its `down` and `owed` tell what the next sample's symbols mean, and its first hash symbol.
        """
        scheme, down = self.scheme, state.down
        for symbol in symbols:
            down = scheme.guess(down) if symbol is None else scheme.take(down, symbol)
        after = CodecState(state.codec.sample + 1, (), ())
        owed = self._owed(state, digest, word, symbols)
        return TwoWayState(after, (), (), scheme.settle(down), owed)

    def _owed(
        self, state: TwoWayState, digest: int, word: Word, symbols: Sequence[int | None]
    ) -> float:
        """Return the bit that is owed after a sample."""
        bit = parity(symbols)
        if len(symbols) == self.layout.symbols_per_sample:
            # Nothing has said yet whether the word came.
            return float(bit ^ int(state.owed) ^ (1 if word is ERASED else 0))
        return float(bit ^ self.word_parity(word) ^ digest & 1)

    def word_parity(self, word: Word) -> int:
        """Return the parity of the digits of a word; 0 for one that is erased."""
        odd, alphabet = 0, self.codec.coder.alphabet
        for symbol in word or ():
            odd ^= alphabet.symbol_number(symbol) & 1
        return odd

    def pack(self, state: TwoWayState) -> bytes:
        """Return the canonical bytes of a state, little-endian, no minus zero."""
        values = [*state.codec.model, *state.codec.coder, *state.down, state.owed, *state.hold]
        for command in state.commands:
            values += command
        return self._layout.pack(state.codec.sample, *[value + 0.0 for value in values])

    def unpack(self, data: bytes) -> TwoWayState:
        """Return the state with these canonical bytes; ValueError if they are not of this machine."""
        if len(data) != self._layout.size:
            raise ValueError(
                f"a state of this flight has {self._layout.size} bytes, got {len(data)}; both ends "
                "need the same downlink"
            )
        sample, *values = self._layout.unpack(data)
        if sample < 0 or not all(math.isfinite(value) for value in values):
            raise ValueError("the state has a negative index or a value that is not finite")
        model, coder, inputs, down = self._sizes
        parts, at = [], 0
        for size in (model, coder, down, 1, *[inputs] * (self.lead_ticks + 1)):
            parts.append(tuple(values[at : at + size]))
            at += size
        codec = CodecState(sample, parts[0], parts[1])
        possible = is_coder_state(self.codec.coder, codec.coder) and self.scheme.is_state(parts[2])
        if not possible or parts[3] not in ((0.0,), (1.0,)):
            raise ValueError("the state is none that this coder and command scheme can be in")
        return TwoWayState(codec, tuple(parts[5:]), parts[4], parts[2], parts[3][0])

    def digest(self, state: TwoWayState) -> int:
        """Return the 64-bit digest of a state."""
        return int.from_bytes(blake2b(self.pack(state), digest_size=8).digest(), "little")


def parity(symbols: Sequence[int | None]) -> int:
    """Return whether an odd number of the symbols is 1."""
    ones = 0
    for symbol in symbols:
        ones ^= 1 if symbol else 0
    return ones


def limited_all(command: Vector, before: Vector, largest: Vector, slew: Vector) -> Vector:
    """Return each input within its limit, and within one slew step of the one before."""
    after = list(command)
    for place in range(len(after)):
        value = after[place]
        most = largest[place]
        value = most if value > most else value
        value = -most if value < -most else value
        high, low = before[place] + slew[place], before[place] - slew[place]
        value = high if value > high else value
        after[place] = low if value < low else value
    return tuple(after)
