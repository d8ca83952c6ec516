"""An end's identity for the handshake: software, configuration and arithmetic.

The two copies of the codec stay equal only if both ends run the same configuration with the same
arithmetic. Both are compared before the first symbol. The numerics probe is a digest of our sine,
cosine and exponential on fixed arguments and of the configured codec, with a narrow downlink's state
machine, run over fixed inputs: a library or a processor that computes otherwise is found out here, not
in flight.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import blake2b
from struct import pack
from typing import Any

from channel.codec import numerics
from channel.codec.codec import ERASED, Alphabet, Codec, Word
from channel.codec.downlink.machine import TwoWay
from channel.errors import CodecDiverged

RUNG = "channel.downlink"
OF_NARROW = ("downlink.", "channel.downlink_baud")
LEFT_OUT = {RUNG: "full"}
"""Fields of the shared configuration that it leaves out at this value: its digest is that of before."""

PROBE_SAMPLES = 40
PROBE_SAMPLES_BOTH_WAYS = 64
PROBE_POINTS = 200


@dataclass(frozen=True, slots=True)
class Identity:
    """The identity that an end sends to its peer."""

    version: str
    config: str
    """shared part of the configuration, as canonical JSON"""
    numerics_probe: bytes

    @property
    def config_digest(self) -> bytes:
        """Return 16 bytes that stand for the shared configuration."""
        return blake2b(self.config.encode(), digest_size=16).digest()


def numerics_probe(codec: Codec, two_way: TwoWay | None = None) -> bytes:
    """Return 8 bytes that depend on every bit of this machine's codec arithmetic.

    `two_way`: of the state machine of a narrow downlink as well.
    """
    digest = blake2b(digest_size=8)
    for point in range(-PROBE_POINTS, PROBE_POINTS):
        x = point * 0.0537109375
        digest.update(pack("<3d", numerics.sin(x), numerics.cos(x), numerics.exp(x)))
    alphabet = codec.coder.alphabet
    state = codec.initial()
    noise = _noise()
    for sample in range(PROBE_SAMPLES):
        word = _probe_word(alphabet, sample, [next(noise) for _ in range(alphabet.symbols_per_word)])
        commands = []
        for _ in range(codec.ticks_per_sample):
            value = ((next(noise) >> 12) % 9_001 - 4_500) / 1000.0
            signs = (1.0 if index % 2 == 0 else -1.0 for index in range(codec.model.input_size))
            commands.append(tuple(sign * value for sign in signs))
        try:
            state = codec.step(state, word, commands)
        except CodecDiverged:
            # An unstable plant under commands that nobody chose: begin again.
            state = codec.initial()._replace(sample=sample + 1)
        digest.update(codec.pack(state))
    if two_way is not None:
        _run_two_way(two_way, digest)
    return digest.digest()


def _noise() -> Iterator[int]:
    """Return numbers of 31 bits without end, the same on every machine."""
    noise = 1
    while True:
        noise = noise * 1_103_515_245 + 12_345 & 0x7FFFFFFF
        yield noise


def _probe_word(alphabet: Alphabet, sample: int, drawn: list[int]) -> Word:
    symbols = alphabet.symbols
    return ERASED if sample % 7 == 6 else tuple([symbols[(one >> 16) % len(symbols)] for one in drawn])


def _run_two_way(two_way: TwoWay, digest: blake2b) -> None:
    """Run the state machine over fixed words and command symbols."""
    alphabet = two_way.codec.coder.alphabet
    state = two_way.initial()
    noise = _noise()
    for sample in range(PROBE_SAMPLES_BOTH_WAYS):
        word = _probe_word(alphabet, sample, [next(noise) for _ in range(alphabet.symbols_per_word)])
        bits = [next(noise) >> 16 & 1 for _ in range(two_way.commands_in(state))]
        try:
            state = two_way.step(state, word, bits).state
        except (CodecDiverged, ValueError, ArithmeticError):
            first = two_way.initial()
            state = first._replace(codec=first.codec._replace(sample=sample + 1))
        digest.update(two_way.pack(state))


def differing_fields(ours: str, theirs: str) -> list[str]:
    """Return one line for each field in which two shared configurations (JSON) differ."""
    try:
        left, right = _flatten(json.loads(ours)), _flatten(json.loads(theirs))
    except (ValueError, RecursionError):
        return ["the peer's configuration cannot be read"]
    pairs = [
        (name, *(side.get(name, LEFT_OUT.get(name, "(absent)")) for side in (left, right)))
        for name in sorted(left.keys() | right.keys())
    ]
    differing = [one for one in pairs if one[1] != one[2]]
    if any(name == RUNG for name, _, _ in differing):
        # What the narrow one is like says nothing beside that.
        differing = [one for one in differing if not one[0].startswith(OF_NARROW)]
    return [f"{name}: here {here}, there {there}" for name, here, there in differing]


def _flatten(value: Any, prefix: str = "") -> dict[str, Any]:
    if not isinstance(value, dict):
        return {prefix.removesuffix("."): value}
    flat: dict[str, Any] = {}
    for key, item in value.items():
        flat |= _flatten(item, f"{prefix}{key}.")
    return flat
