"""Which symbols of a sample carry commands or set-points, and which carry hash bits.

Down symbols are bits. Both ends must know what each one means, so its kind follows from shared state
alone. While no word is being sent, every `command_period`-th sample begins with command symbols, and
all others are hash symbols. Within a word every sample begins with command symbols, or, with one
symbol a sample, every second one: the others have the hash symbol.
"""

from __future__ import annotations

from dataclasses import dataclass

from channel.codec.codec import Alphabet

SYMBOLS_MAX = 32
"""Down symbols a sample; their hash bits are different bits of one digest of 64."""


DOWN_ALPHABET = Alphabet((0, 1), 1)


@dataclass(frozen=True, slots=True)
class Layout:
    """The symbols of each sample; ValueError for a layout without hash symbols, or without commands."""

    symbols_per_sample: int
    command_symbols: int = 1
    """of a sample that has any"""
    command_period: int = 1
    """samples from one with command symbols to the next, while no word is being sent"""

    def __post_init__(self) -> None:
        count, commands = self.symbols_per_sample, self.command_symbols
        if not 1 <= count <= SYMBOLS_MAX or self.command_period < 1:
            raise ValueError(
                f"a sample has 1 to {SYMBOLS_MAX} down symbols and command_period is at least 1, got "
                f"{count} and {self.command_period}"
            )
        if not 1 <= commands <= count:
            raise ValueError(f"of {count} down symbols a sample {commands} cannot be command symbols")
        if commands == count and (count > 1 or self.command_period < 2):
            raise ValueError(
                f"all {count} down symbol(s) of a sample are command symbols, with command_period = "
                f"{self.command_period}; leave one to hash bits, or, of one symbol, every second sample"
            )

    def commands_in(self, sample: int, word_age: int) -> int:
        """Return how many symbols of a sample, its first ones, are command symbols.

        `word_age`: samples since the word that is being sent began; 0: none is.
        """
        if word_age == 0:
            free = sample % self.command_period  # integers
        else:
            free = word_age & 1 if self.symbols_per_sample == 1 else 0
        return 0 if free else self.command_symbols

    def word_samples(self, symbols: int) -> int:
        """Return in how many samples a word of this many symbols is sent, its first one included."""
        if self.symbols_per_sample == 1:
            return 2 * symbols - 1
        return -(-symbols // self.command_symbols)  # integers

    def check_rate(self, downlink_baud: float, sample_ns: int) -> None:
        """Raise ValueError, with the numbers, where a line of this rate does not carry the layout."""
        needed = self.symbols_per_sample * 1e9 / sample_ns
        if needed > downlink_baud * (1.0 + 1e-9):
            carried = int(1e-9 * downlink_baud * sample_ns + 1e-9)
            fewer = f"choose a layout of at most {carried} a sample, " if carried else ""
            raise ValueError(
                f"{self.symbols_per_sample} down symbol(s) every {sample_ns / 1e9:g} s ask for "
                f"{needed:g} symbols/s, but the line carries downlink_baud = {downlink_baud:g}; {fewer}"
                "lengthen symbol_period_s or raise downlink_baud"
            )


def symbols_carried(downlink_baud: float, sample_ns: int) -> int:
    """Return how many down symbols a sample may have on a line of this rate, at least 1."""
    carried = int(1e-9 * downlink_baud * sample_ns * (1.0 + 1e-9))
    if carried < 1:
        return 1
    return carried if carried < SYMBOLS_MAX else SYMBOLS_MAX
