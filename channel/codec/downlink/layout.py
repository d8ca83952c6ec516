"""Which symbols of a sample carry commands or set-points, and which carry hash bits.

Down symbols are bits. Both ends must know what each one means, so its kind follows from the shared state
alone. With two or more symbols a sample the first few are command symbols and the others hash symbols.
With one symbol a sample the two take turns: while no word is being sent, every `command_period`-th sample
has a command symbol; within a word, samples of a command symbol and of a hash symbol alternate.
"""

from __future__ import annotations

from dataclasses import dataclass

SYMBOLS_MAX = 32
"""Down symbols a sample; their hash bits are different bits of one digest of 64."""


@dataclass(frozen=True, slots=True)
class Layout:
    """The symbols of each sample; ValueError for a layout without hash symbols, or without commands."""

    symbols_per_sample: int
    command_symbols: int = 1
    """of two symbols a sample or more: how many are command symbols"""
    command_period: int = 1
    """of one symbol a sample: every such sample has a command symbol while no word is being sent"""

    def __post_init__(self) -> None:
        count, commands = self.symbols_per_sample, self.command_symbols
        if not 1 <= count <= SYMBOLS_MAX:
            raise ValueError(f"a sample has 1 to {SYMBOLS_MAX} down symbols, got {count}")
        if count == 1 and not (commands == 1 and self.command_period >= 2):
            raise ValueError(
                f"with one down symbol a sample, command_period is {self.command_period}; it must be at "
                "least 2, so that hash symbols are sent too"
            )
        if count > 1 and not (1 <= commands < count and self.command_period == 1):
            raise ValueError(
                f"of {count} down symbols a sample {commands} are command symbols, and command_period is "
                f"{self.command_period}; there must be 1 to {count - 1} of them in every sample"
            )

    def commands_in(self, sample: int, word_age: int) -> int:
        """Return how many symbols of a sample, its first ones, are command symbols.

        `word_age`: samples since the word that is being sent began; 0: none is.
        """
        if self.symbols_per_sample > 1:
            return self.command_symbols
        if word_age:
            return 0 if word_age & 1 else 1
        return 0 if sample % self.command_period else 1  # integers

    def word_samples(self, symbols: int) -> int:
        """Return in how many samples a word of this many symbols is sent, its first one included."""
        if self.symbols_per_sample == 1:
            return 2 * symbols - 1
        return -(-symbols // self.command_symbols)  # integers

    def check_rate(self, downlink_baud: float, sample_ns: int) -> None:
        """Raise ValueError, with the numbers, where a line of this rate does not carry the layout."""
        needed = self.symbols_per_sample * 1e9 / sample_ns
        if needed > downlink_baud * (1.0 + 1e-9):
            raise ValueError(
                f"{self.symbols_per_sample} down symbol(s) every {sample_ns / 1e9:g} s ask for "
                f"{needed:g} symbols/s, but the line carries downlink_baud = {downlink_baud:g}; choose a "
                f"layout of at most {int(downlink_baud * sample_ns / 1e9 + 1e-9)} symbol(s) a sample, "
                "lengthen symbol_period_s or raise downlink_baud"
            )
