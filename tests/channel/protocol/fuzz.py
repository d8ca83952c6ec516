"""Bytes that are nearly frames, or not at all, for every decoder that reads what comes from a line."""

from __future__ import annotations

import contextlib
import random
from binascii import crc_hqx

from channel.errors import FrameError
from channel.line.virtual import Reply, Step, decode_reply, decode_step, encode_reply, encode_step
from channel.protocol import wire
from channel.protocol.wire import CRC_START
from tests.golden.regenerate import example_frames

SEEDS = [wire.encode(frame) for frame in example_frames()]
ENVELOPES = [
    encode_step(Step(7, -5, SEEDS[4])),
    encode_reply(Reply(7, 10**12, (SEEDS[6], SEEDS[2]))),
]


def mutated(chance: random.Random, data: bytes) -> bytes:
    """Return a message changed at one to four places: bits, bytes, length, a piece of another."""
    changed = bytearray(data)
    for _ in range(chance.randrange(1, 5)):
        place = chance.randrange(len(changed) + 1)
        match chance.randrange(6):
            case 0 if changed:
                changed[place % len(changed)] ^= 1 << chance.randrange(8)
            case 1 if changed:
                changed[place % len(changed)] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
            case 2:
                del changed[place:]
            case 3:
                changed[place:place] = chance.randbytes(chance.randrange(1, 9))
            case 4:
                other = chance.choice(SEEDS)
                changed[place:] = other[chance.randrange(len(other)) :]
            case _:
                del changed[place : place + chance.randrange(1, 9)]
    return bytes(changed)


def checked(data: bytes) -> bytes:
    """Return a message with a check that is right, so that its inside is read."""
    body = data[:-2]
    return body + crc_hqx(body, CRC_START).to_bytes(2, "little")


def feed(data: bytes) -> bool:
    """Give bytes to the decoders; return whether they were a frame. Only FrameError may come out.

    A frame that is accepted must be one that can be sent again, to the same bytes.
    """
    for decode in (decode_step, decode_reply):
        with contextlib.suppress(FrameError):
            decode(data)
    try:
        frame = wire.decode(data)
    except FrameError:
        return False
    if frame.__class__.__name__ != "ForeignVersion" and wire.encode(frame) != data:
        # Zero fields that belong to no session are not read back; everything else is.
        again = wire.decode(wire.encode(frame))
        assert again == frame, (data.hex(), frame)
    return True


def fuzz_all(inputs: int, seed: int) -> dict[str, int]:
    """Feed `inputs` inputs, whole and in growing pieces; return how many there were of which kind."""
    chance = random.Random(seed)
    accepted = pieces = 0
    while pieces < inputs:
        data = mutated(chance, chance.choice(SEEDS + ENVELOPES))
        if chance.random() < 0.7:
            data = checked(data)
        accepted += feed(data)
        pieces += 1
        if chance.random() < 0.02:
            # Byte by byte: a line that breaks off anywhere.
            for end in range(len(data)):
                feed(data[:end])
            pieces += len(data)
    return {"inputs": pieces, "accepted": accepted}
