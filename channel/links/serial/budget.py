"""The load of a serial line and its transmission times: the arithmetic behind a refusal.

Up the line goes one byte per symbol; down it one command frame per sample, which is
`(head + CRC) + (1 + W) * echo` bytes before COBS, or what the compact downlink makes of it. A line of
8N1 spends ten bits on a byte, and each direction has its own wire.
"""

from __future__ import annotations

import math
from dataclasses import replace

from channel.codec.codec import Codec
from channel.links.serial.cobs import cobs_encode
from channel.links.serial.wire import SerialWire
from channel.protocol.compact import CompactForm
from channel.protocol.frames import Commands, Echo
from channel.protocol.terms import Terms
from channel.protocol.wire import encode

LINE_BITS_PER_BYTE = 10

USUAL_RATES_BAUD = (110, 300, 600, 1200, 2400, 4800, 9600, 19_200, 38_400, 57_600, 115_200, 230_400)
"""of serial ports"""


def message_bytes(terms: Terms, codec: Codec) -> int:
    """Return the bytes of a command frame, without a line's framing."""
    if terms.downlink == "compact":
        return CompactForm(codec, terms).frame_bytes
    steps = (1,) * (terms.ticks_per_sample * codec.model.input_size)
    echoes = tuple(Echo(sample, 1, 1, steps) for sample in range(terms.repeats + 1))
    return len(encode(Commands(1, 1, echoes)))


def command_bytes(terms: Terms, codec: Codec) -> int:
    """Return the bytes of a command frame, COBS and delimiters included."""
    # COBS adds a byte for every 254; a frame full of zeros is not shorter.
    content = message_bytes(terms, codec)
    return len(cobs_encode(b"\1" * content)) + 2


def up_bits_per_s(terms: Terms) -> float:
    """Return the line bits of the symbols."""
    return 1e9 * terms.symbols_per_word / terms.sample_ns * LINE_BITS_PER_BYTE


def down_bits_per_s(terms: Terms, codec: Codec) -> float:
    """Return the line bits of the command frames."""
    return 1e9 / terms.sample_ns * command_bytes(terms, codec) * LINE_BITS_PER_BYTE


def least_rate_baud(terms: Terms, codec: Codec) -> int:
    """Return the slowest line that carries both directions."""
    return math.ceil(max(up_bits_per_s(terms), down_bits_per_s(terms, codec)) - 1e-6)


def usual_rate_baud(least: int) -> int:
    """Return the rate that ports have and that is no less; the least itself beyond them."""
    return next((rate for rate in USUAL_RATES_BAUD if rate >= least), least)


def check_up(terms: Terms, line_rate_baud: int) -> None:
    """Raise ValueError, with the arithmetic, where the line cannot carry the symbols."""
    slots_per_s = 1e9 * terms.symbols_per_word / terms.sample_ns
    bits_per_s = up_bits_per_s(terms)
    if bits_per_s > line_rate_baud:
        raise ValueError(
            f"the serial line cannot carry the uplink: {slots_per_s:g} symbols/s x 1 byte x "
            f"{LINE_BITS_PER_BYTE} line bits = {bits_per_s:g} bit/s, but line_rate_baud = "
            f"{line_rate_baud}; raise it, or lengthen symbol_period_s"
        )


def check_down(terms: Terms, codec: Codec, line_rate_baud: int) -> None:
    """Raise ValueError, with the arithmetic, where the line cannot carry the command frames."""
    bits_per_s = down_bits_per_s(terms, codec)
    if bits_per_s <= line_rate_baud:
        return
    short = least_rate_baud(replace(terms, downlink="compact"), codec)
    hint = ""
    if terms.downlink == "full":
        hint = f'set channel.downlink = "compact" at both ends, which needs {short} baud, '
    raise ValueError(
        f"the serial line cannot carry the downlink: a command frame with {terms.repeats} "
        f"repeats (channel.repeats) is {command_bytes(terms, codec)} bytes, COBS included; x "
        f"{LINE_BITS_PER_BYTE} line bits x {1e9 / terms.sample_ns:g} samples/s = {bits_per_s:g} bit/s, "
        f"but the line's rate is {line_rate_baud} baud; raise it, {hint}lower channel.repeats, or take "
        "the downlink elsewhere: --downlink zenoh or --downlink PORT"
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
