"""The load of a serial line and its transmission times: the arithmetic behind a refusal.

Up the line goes one byte per symbol; down it one command frame per sample, which is
`(head + CRC) + (1 + W) * echo` bytes before COBS. A line of 8N1 spends ten bits on a byte, and each
direction has its own wire.
"""

from __future__ import annotations

from dataclasses import dataclass

from channel.links.serial.cobs import cobs_encode
from channel.links.serial.wire import SerialWire
from channel.protocol.frames import Commands, Echo
from channel.protocol.terms import Terms
from channel.protocol.wire import encode

LINE_BITS_PER_BYTE = 10


@dataclass(frozen=True, slots=True)
class SerialBudget:
    """Bytes and times of one flight's terms on a line."""

    slots_per_s: float
    samples_per_s: float
    command_bytes: int
    """of one command frame, COBS and both delimiters included"""
    repeats: int

    @property
    def up_bits_per_s(self) -> float:
        """Return the line bits that the symbols need."""
        return self.slots_per_s * LINE_BITS_PER_BYTE

    @property
    def down_bits_per_s(self) -> float:
        """Return the line bits that the command frames need."""
        return self.samples_per_s * self.command_bytes * LINE_BITS_PER_BYTE

    def symbol_ns(self, line_rate_baud: int) -> int:
        """Return how long the line takes for one symbol."""
        return byte_ns(1, line_rate_baud)

    def command_ns(self, line_rate_baud: int) -> int:
        """Return how long the line takes for one command frame."""
        return byte_ns(self.command_bytes, line_rate_baud)

    def check_up(self, line_rate_baud: int) -> None:
        """Raise ValueError, with the arithmetic, where the line cannot carry the symbols."""
        if self.up_bits_per_s > line_rate_baud:
            raise ValueError(
                f"the serial line cannot carry the uplink: {self.slots_per_s:g} symbols/s x 1 byte x "
                f"{LINE_BITS_PER_BYTE} line bits = {self.up_bits_per_s:g} bit/s, but line_rate_baud = "
                f"{line_rate_baud}; raise it, or lengthen symbol_period_s"
            )

    def check_down(self, line_rate_baud: int) -> None:
        """Raise ValueError, with the arithmetic, where the line cannot carry the commands."""
        if self.down_bits_per_s > line_rate_baud:
            raise ValueError(
                f"the serial line cannot carry the downlink: a command frame with {self.repeats} "
                f"repeats (channel.repeats) is {self.command_bytes} bytes, COBS included; x "
                f"{LINE_BITS_PER_BYTE} line bits x {self.samples_per_s:g} samples/s = "
                f"{self.down_bits_per_s:g} bit/s, but the line's rate is {line_rate_baud} baud; raise "
                "it, lower channel.repeats, or take the downlink elsewhere: --downlink zenoh or "
                "--downlink PORT"
            )


def serial_budget(terms: Terms, inputs: int) -> SerialBudget:
    """Return the budget of a flight whose commands have `inputs` values each."""
    steps = (1,) * (terms.ticks_per_sample * inputs)
    echoes = tuple(Echo(sample, 1, 1, steps) for sample in range(terms.repeats + 1))
    # COBS adds a byte for every 254; a frame full of zeros is not shorter.
    content = len(encode(Commands(1, 1, echoes)))
    stuffed = len(cobs_encode(b"\1" * content))
    return SerialBudget(
        slots_per_s=1e9 * terms.symbols_per_word / terms.sample_ns,
        samples_per_s=1e9 / terms.sample_ns,
        command_bytes=stuffed + 2,
        repeats=terms.repeats,
    )


def byte_ns(count: int, line_rate_baud: int) -> int:
    """Return how long a line takes for a number of bytes, rounded up."""
    return -(-count * LINE_BITS_PER_BYTE * 1_000_000_000 // line_rate_baud)


def check_slot_counter(terms: Terms, wire: SerialWire) -> None:
    """Raise ValueError where the counter bits of a symbol byte could not tell slots apart."""
    slot_ns = terms.sample_ns / terms.symbols_per_word
    slots = terms.deadline_allowance_ns / slot_ns
    limit = wire.slot_modulus / 4
    if slots > limit:
        raise ValueError(
            f"deadline_allowance_s = {terms.deadline_allowance_ns / 1e9:g} is {slots:g} slots of "
            f"{slot_ns / 1e6:g} ms, but a symbol byte counts slots modulo {wire.slot_modulus} and can "
            f"be late by {limit:g} at most; keep deadline_allowance_s within "
            f"{limit * slot_ns / 1e9:g} s"
        )
