"""A whole flight in as many bits as were sent: its words, packed.

The configuration, known to both ends in advance, is in the head of the file. What a rejoin sent
down the link, the start states of later epochs, stands there too, and set-points given by hand.

    "tenbaud symbols 1" and a line feed | head length u32 | head, JSON in zlib | symbols |
    erasures | down

A symbol takes the smallest whole number of bits that its alphabet needs, the first one the lowest
bits; an erased word counts as the alphabet's first symbols. The erasures are one bit per word, and
left out when there is none. With a narrow downlink its symbols follow, a bit each.
"""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from channel.codec.codec import ERASED, Alphabet, CodecState, Vector, Word
from channel.codec.downlink.machine import TwoWayState
from receiver.controllers.references import Reference

if TYPE_CHECKING:
    # Packing imports on bare Python: the page of the documentation does it in the browser.
    from tenbaud.build.flight import Agreement

MAGIC = b"tenbaud symbols 1\n"
LENGTH = struct.Struct("<I")


@dataclass(slots=True)
class Epoch:
    """A stretch of samples that begins from a common state, and the words consumed in it."""

    number: int
    start: CodecState
    hold: Vector
    words: list[Word] = field(default_factory=list)
    two_way: TwoWayState | None = None
    """of a narrow downlink: X that it starts from"""
    symbols: list[tuple[int, ...]] = field(default_factory=list)
    """of a narrow downlink: those sent down in each sample"""


@dataclass(frozen=True, slots=True)
class Packed:
    """A flight as bytes, and the sizes of its parts."""

    head: bytes
    symbols: bytes
    erasures: bytes
    down: bytes
    start_bytes: int
    """of the head: start states of epochs after the first, before compression"""

    @property
    def data(self) -> bytes:
        """The whole file."""
        return (
            MAGIC + LENGTH.pack(len(self.head)) + self.head + self.symbols + self.erasures + self.down
        )


def pack(
    agreement: Agreement, epochs: list[Epoch], steps: tuple[tuple[int, float], ...], last_digest: str
) -> Packed:
    """Return the flight as bytes."""
    codec = agreement.codec
    starts = [_start_hex(agreement, epoch) for epoch in epochs]
    head = {
        "config": agreement.config.model_dump(mode="json"),
        "clock": agreement.clock,
        "epochs": [
            [epoch.number, epoch.start.sample, len(epoch.words), list(epoch.hold), start]
            for epoch, start in zip(epochs, starts, strict=True)
        ],
        "set_points": [list(step) for step in steps],
        "last_digest": last_digest,
    }
    words = [word for epoch in epochs for word in epoch.words]
    alphabet = codec.coder.alphabet
    width = width_of(alphabet)
    symbols = [
        _digit(alphabet, word, place) for word in words for place in range(alphabet.symbols_per_word)
    ]
    erased = [int(word is ERASED) for word in words]
    return Packed(
        zlib.compress(json.dumps(head).encode(), 9),
        _to_bits(symbols, width),
        _to_bits(erased, 1) if any(erased) else b"",
        _to_bits([one for epoch in epochs for sent in epoch.symbols for one in sent], 1),
        sum(len(start) // 2 for start in starts if start is not None),
    )


def _start_hex(agreement: Agreement, epoch: Epoch) -> str | None:
    """Return the start state of an epoch as text, None where it is the initial one."""
    codec, machine, sample = agreement.codec, agreement.two_way, epoch.start.sample
    if machine is not None and epoch.two_way is not None:
        both = epoch.two_way
        return None if both == machine.initial(sample) else machine.pack(both).hex()
    initial: CodecState = codec.initial()._replace(sample=sample)
    return None if epoch.start == initial else codec.pack(epoch.start).hex()


def add_step(
    steps: list[tuple[int, float]], tick: int, value: float | None, configured: Reference
) -> None:
    """Add the set-point of a tick to `steps` where it changes, from the first one given by hand on."""
    if value is None or (steps and steps[-1][1] == value):
        return
    if steps or value != configured.value(tick):
        steps.append((tick, value))


def width_of(alphabet: Alphabet) -> int:
    """Return how many bits one symbol takes."""
    return (len(alphabet.symbols) - 1).bit_length()


def _digit(alphabet: Alphabet, word: Word, place: int) -> int:
    return 0 if word is ERASED else alphabet.symbol_number(word[place])


def _to_bits(values: list[int], width: int) -> bytes:
    # By way of text: shifting a number of a million bits a million times takes minutes.
    text = "".join(format(value, f"0{width}b") for value in reversed(values))
    return int(text or "0", 2).to_bytes(-(-len(values) * width // 8), "little")
