"""The load of a serial line and its transmission times: the arithmetic behind a refusal.

Up the line goes one byte per symbol; down it one command frame per sample, which is
`(head + CRC) + (1 + W) * echo` bytes before COBS, or what the compact downlink makes of it, or one byte
per symbol of the narrow downlink. A line of 8N1 spends ten bits on a byte, and each direction has its
own wire. Control frames are few, and symbols that they hold up too long are lost; none is budgeted.
"""

from __future__ import annotations

import math
from dataclasses import replace

from channel.codec.codec import Codec
from channel.links.serial.cobs import cobs_encode
from channel.links.serial.wire import SerialWire
from channel.protocol.compact import CompactForm
from channel.protocol.frames import Commands, Echo
from channel.protocol.terms import SlotGrid, Terms
from channel.protocol.wire import encode

LINE_BITS_PER_BYTE = 10


def message_bytes(terms: Terms, codec: Codec) -> int:
    """Return the bytes of a command frame, without a line's framing."""
    if terms.downlink == "compact":
        return CompactForm(codec, terms).frame_bytes
    steps = (1,) * (terms.ticks_per_sample * codec.model.input_size)
    echoes = tuple(Echo(sample, 1, 1, steps) for sample in range(terms.repeats + 1))
    return len(encode(Commands(1, 1, echoes)))


def command_bytes(terms: Terms, codec: Codec) -> int:
    """Return the bytes of a command frame, COBS and delimiters included; 1 for a down symbol."""
    if terms.is_narrow:
        return 1
    # COBS adds a byte for every 254; a frame full of zeros is not shorter.
    content = message_bytes(terms, codec)
    return len(cobs_encode(b"\1" * content)) + 2


def down_bits_per_s(terms: Terms, codec: Codec) -> float:
    """Return the line bits of the command frames, or of the down symbols."""
    if terms.is_narrow:
        return symbol_bits_per_s(terms.down_grid)
    return 1e9 / terms.sample_ns * command_bytes(terms, codec) * LINE_BITS_PER_BYTE


def symbol_bits_per_s(grid: SlotGrid) -> float:
    """Return the line bits of the symbols of a direction."""
    return 1e9 * grid.slots / grid.sample_ns * LINE_BITS_PER_BYTE


def least_rate_baud(terms: Terms, codec: Codec) -> int:
    """Return the slowest line that carries both directions."""
    bits_per_s = max(symbol_bits_per_s(terms.up_grid), down_bits_per_s(terms, codec))
    return math.ceil(bits_per_s - 1e-6)


def check_up(terms: Terms, line_rate_baud: int) -> None:
    """Raise ValueError, with the arithmetic, where the line cannot carry the symbols."""
    _check_symbols("uplink", terms.up_grid, line_rate_baud, "lengthen symbol_period_s")


def _check_symbols(direction: str, grid: SlotGrid, line_rate_baud: int, remedy: str) -> None:
    bits_per_s = symbol_bits_per_s(grid)
    if bits_per_s > line_rate_baud:
        raise ValueError(
            f"the serial line cannot carry the {direction}: {bits_per_s / LINE_BITS_PER_BYTE:g} "
            f"symbols/s x 1 byte x {LINE_BITS_PER_BYTE} line bits = {bits_per_s:g} bit/s, but "
            f"line_rate_baud = {line_rate_baud}; raise it, or {remedy}"
        )


def check_down(terms: Terms, codec: Codec, line_rate_baud: int) -> None:
    """Raise ValueError, with the arithmetic, where the line cannot carry the downlink."""
    if terms.is_narrow:
        _check_symbols("downlink", terms.down_grid, line_rate_baud, "lower channel.downlink_baud")
        return
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
    _check_counter("deadline_allowance_s", terms.up_grid, wire.slot_modulus)
    if terms.is_narrow:
        _check_counter("downlink_budget_s", terms.down_grid, wire.slot_modulus)


def _check_counter(setting: str, grid: SlotGrid, modulus: int) -> None:
    slots = grid.allowance_ns / grid.length_ns
    limit = modulus / 4
    if slots > limit:
        raise ValueError(
            f"{setting} = {grid.allowance_ns / 1e9:g} is {slots:g} slots of "
            f"{grid.length_ns / 1e6:g} ms, but a symbol byte counts slots modulo {modulus} and can be "
            f"late by {limit:g} at most; keep {setting} within {limit * grid.length_ns / 1e9:g} s"
        )
