"""Reads a symbols file, as `tenbaud.replay.pack` writes it."""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from channel.codec.codec import ERASED, Vector
from tenbaud.build.flight import Agreement
from tenbaud.config.deprecated import with_current_names
from tenbaud.config.schema import FlightConfig
from tenbaud.recording.errors import RecordingError
from tenbaud.replay.pack import LENGTH, MAGIC, Epoch, width_of
from tenbaud.replay.record import agree_again, check_epoch


@dataclass(frozen=True, slots=True)
class Unpacked:
    """The contents of a symbols file."""

    agreement: Agreement
    epochs: list[Epoch]
    steps: tuple[tuple[int, float], ...]
    last_digest: str


_DAMAGED = (
    *(ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError),
    *(struct.error, zlib.error),
)
HEAD_BYTES_MAX = 16 << 20
NUMBER_MAX = 1 << 53


def unpack(path: Path, *, allow_code: bool = False) -> Unpacked:
    """Read a symbols file; RecordingError for an invalid or incomplete file.

    CodeNotAllowed if its configuration names classes from outside, unless `allow_code` permits them.
    """
    try:
        data = path.read_bytes()
        head_at = len(MAGIC) + LENGTH.size
        if not data.startswith(MAGIC):
            raise ValueError("it begins otherwise")
        (length,) = LENGTH.unpack_from(data, len(MAGIC))
        head: dict[str, Any] = json.loads(_unpacked_head(data[head_at : head_at + length]))
        config = FlightConfig.model_validate(with_current_names(head["config"], "", warn=False))
        agreement = agree_again(config, head["clock"], allow_code)
        epochs = _epochs(head["epochs"], data[head_at + length :], agreement)
        steps = tuple((int(tick), float(angle)) for tick, angle in head["set_points"])
        for epoch in epochs:
            check_epoch(epoch, agreement, str(path))
        return Unpacked(agreement, epochs, steps, str(head["last_digest"]))
    except (*_DAMAGED, OSError) as error:
        raise RecordingError(f"{path} is no symbols file of a flight: {error}.") from error


def _unpacked_head(packed: bytes) -> bytes:
    head = zlib.decompressobj().decompress(packed, HEAD_BYTES_MAX + 1)
    if len(head) > HEAD_BYTES_MAX:
        raise ValueError(f"its head unpacks to more than {HEAD_BYTES_MAX} bytes")
    return head


def _epochs(described: list[list[Any]], data: bytes, agreement: Agreement) -> list[Epoch]:
    alphabet = agreement.codec.coder.alphabet
    count, width = alphabet.symbols_per_word, width_of(alphabet)
    for number, first, words, hold, _ in described:
        if not all(type(one) in (int, float) and abs(one) < NUMBER_MAX for one in hold):
            raise ValueError("the held command of an epoch is no list of numbers")
        if not all(type(one) is int and 0 <= one < NUMBER_MAX for one in (number, first, words)):
            raise ValueError("an epoch has no number, first sample and length")
    total = sum(row[2] for row in described)
    # Of an alphabet of one symbol any number of words fits into no byte at all.
    if total > 8 * len(data):
        raise ValueError(f"{total} words cannot be in {len(data)} bytes")
    size = -(-total * count * width // 8)
    erasures_size = -(-total // 8)
    each = agreement.terms.down_symbols
    down_size = -(-total * each // 8)
    if len(data) - down_size not in (size, size + erasures_size):
        raise ValueError(f"{total} words need {size + down_size} bytes, {len(data)} are there")
    digits = _from_bits(data[:size], width, total * count)
    erasures, bits = data[size : len(data) - down_size], data[len(data) - down_size :]
    erased = _from_bits(erasures, 1, total) if erasures else [0] * total
    down = _from_bits(bits, 1, total * each) if each else []
    epochs, at = [], 0
    for number, first, words, hold, start in described:
        epoch = _epoch(agreement, number, first, tuple(hold), start)
        if each:
            rows = range(at * each, (at + words) * each, each)
            epoch.symbols = [tuple(down[row : row + each]) for row in rows]
        for index in range(at, at + words):
            word = tuple(
                alphabet.symbols[digit] for digit in digits[index * count : (index + 1) * count]
            )
            epoch.words.append(ERASED if erased[index] else word)
        at += words
        epochs.append(epoch)
    return epochs


def _epoch(agreement: Agreement, number: int, first: int, hold: Vector, start: str | None) -> Epoch:
    """Return an epoch without its words."""
    codec, machine = agreement.codec, agreement.two_way
    if machine is None:
        state = codec.initial()._replace(sample=first)
        if start is not None:
            state = codec.unpack(bytes.fromhex(start))
        return Epoch(number, state, hold)
    both = machine.initial(first) if start is None else machine.unpack(bytes.fromhex(start))
    return Epoch(number, both.codec, hold, two_way=both)


def _from_bits(data: bytes, width: int, count: int) -> list[int]:
    text = format(int.from_bytes(data, "little"), f"0{count * width}b")
    end = len(text)
    return [int(text[end - (index + 1) * width : end - index * width], 2) for index in range(count)]
