"""The command frame of the compact downlink: the same echo in few bits.

    10 | epoch 2 | session 4 | sample 8 or more | digest 16 | 3 more | W + 1 echoes | zeros | CRC-16

Bits in order, the highest first, and zeros up to a whole byte. An echo, the newest first, is a word's
number (an erasure is the one after the last word) and one command for each input, held over all ticks
of the sample. Session, epoch and sample are what remains of them after division by 16, by 4 and by 2 to
the power of the sample's bits; the sample is the one nearest to where the transmitter's clock stands.
Before the first sample of an epoch echoes are zeros. The CRC covers all 32 bits of the session, which
are not sent, and then the frame.

A command is a number of *held steps* of its input: the steps of a full frame, or as many of them
together as make the input's limit fit `HELD_BITS`. So both codecs use exactly what came. From sample to
sample it changes by one tick's slew at most: it changes at one tick, and the guard beside the motors
allows no more.

Of the newest sample's digest the low 16 bits are here and three of the others: those of sample `k`
begin at bit `16 + 3 (k mod 16)`. So two states that differ stay unseen for `n` samples with a
probability of 2^(-19 n), and a difference in any one bit of the digests for 15 samples at most.
"""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Sequence

from channel.codec.codec import WIRE_ERASED, Codec, Vector
from channel.errors import FrameError
from channel.protocol.frames import Commands, Echo, ShortCommands
from channel.protocol.limits import steps_held, to_steps
from channel.protocol.terms import Terms
from channel.protocol.wire import CRC_START, SHORT_MARK

DIGEST_BITS = 16
PART_BITS = 3
PART_SAMPLES = 16
"""In this many samples each of a digest's 64 bits goes down."""
EPOCH_BITS, SESSION_BITS = 2, 4
SAMPLE_BITS_MIN = 8


class CompactForm:
    """Packs and unpacks the command frames of one flight."""

    def __init__(self, codec: Codec, terms: Terms) -> None:
        self._terms = terms
        self._words = codec.coder.alphabet.words
        self._word_bits = self._words.bit_length()
        # Echoes are taken from one history behind the clock to two before it.
        self._sample_bits = max(SAMPLE_BITS_MIN, (4 * terms.history_samples - 1).bit_length())
        largest = to_steps(terms.limits.command_max, terms.signals)
        self._per_held = steps_held(terms.limits, terms.signals)
        """steps of a full frame in one held step, for each input"""
        self._largest = tuple([a // b for a, b in zip(largest, self._per_held, strict=True)])
        self._command_bits = tuple([(2 * one).bit_length() for one in self._largest])
        self._echoes = terms.repeats + 1
        echo_bits = self._word_bits + sum(self._command_bits)
        bits = self._sample_bits + DIGEST_BITS + PART_BITS + self._echoes * echo_bits
        self._padding = -bits % 8
        self._bytes = 1 + (bits + self._padding) // 8

    @property
    def frame_bytes(self) -> int:
        """Return the bytes of a frame, checksum included."""
        return self._bytes + 2

    def held(self, commands: Sequence[Vector], before: Vector) -> tuple[int, ...]:
        """Return the steps of the command that is held in place of those of a sample's ticks.

        It is their mean, within the limits against the command that was held before.
        """
        count = len(commands)
        mean = tuple([sum(values) / count for values in zip(*commands, strict=True)])
        limited = self._terms.limits.apply(mean, before)
        steps = []
        for value, unit, per, most in zip(
            limited, self._terms.signals.steps_per_unit, self._per_held, self._largest, strict=True
        ):
            steps.append(per * max(-most, min(most, round(value * unit / per))))
        return tuple(steps)

    def packed(self, session: int, epoch: int, echoes: Sequence[Echo]) -> ShortCommands:
        """Return the frame of echoes, of which the last is new."""
        newest = echoes[-1]
        bits = newest.sample % (1 << self._sample_bits)
        bits = bits << DIGEST_BITS | newest.digest % (1 << DIGEST_BITS)
        bits = bits << PART_BITS | (newest.digest >> _part_of(newest.sample)) % (1 << PART_BITS)
        inputs = len(self._per_held)
        missing = self._echoes - len(echoes)
        for echo in reversed(echoes):
            word = self._words if echo.word_number == WIRE_ERASED else echo.word_number
            bits = bits << self._word_bits | word
            for steps, per, most, width in zip(
                echo.steps[:inputs], self._per_held, self._largest, self._command_bits, strict=True
            ):
                bits = bits << width | steps // per + most
        bits <<= missing * (self._word_bits + sum(self._command_bits)) + self._padding
        head = SHORT_MARK | epoch % 4 << SESSION_BITS | session % 16
        data = bytes((head,)) + bits.to_bytes(self._bytes - 1, "big")
        return ShortCommands(data, _checksum(session, data))

    def require_whole(self, frame: ShortCommands, session: int) -> None:
        """Raise FrameError for a damaged frame; one that names another session is taken for whole."""
        if len(frame.data) != self._bytes:
            raise FrameError(f"compact commands of {len(frame.data)} bytes and not {self._bytes}")
        ours = frame.data[0] % (1 << SESSION_BITS) == session % (1 << SESSION_BITS)
        if ours and frame.checksum != _checksum(session, frame.data):
            raise FrameError("checksum")

    def unpacked(
        self, frame: ShortCommands, session: int, epoch: int, near_sample: int
    ) -> Commands | None:
        """Return what a frame says; None where it is of another session, epoch or flight.

        `near_sample` is the one that the transmitter's clock stands in.
        """
        head = SHORT_MARK | epoch % 4 << SESSION_BITS | session % 16
        if len(frame.data) != self._bytes or frame.data[0] != head:
            return None
        if frame.checksum != _checksum(session, frame.data):
            return None
        bits = _Bits(int.from_bytes(frame.data[1:], "big"))
        if bits.take(self._padding):
            return None
        echoes = [self._echo(bits) for _ in range(self._echoes)]
        part = bits.take(PART_BITS)
        digest = bits.take(DIGEST_BITS)
        modulus = 1 << self._sample_bits
        ahead = (bits.take(self._sample_bits) - near_sample + modulus // 2) % modulus - modulus // 2
        newest = near_sample + ahead
        if newest < 0:
            return None
        known = [
            Echo(sample, number, 0, steps * self._terms.ticks_per_sample, 0)
            for sample, (number, steps) in enumerate(echoes[:-1], newest - self._echoes + 1)
            if sample >= 0
        ]
        number, steps = echoes[-1]
        shift = _part_of(newest)
        mask = (1 << DIGEST_BITS) - 1 | (1 << PART_BITS) - 1 << shift
        new = Echo(newest, number, digest | part << shift, steps * self._terms.ticks_per_sample, mask)
        return Commands(session, epoch, (*known, new))

    def _echo(self, bits: _Bits) -> tuple[int, tuple[int, ...]]:
        """Take an echo; return its word's number and the command's steps."""
        widths = zip(
            reversed(self._command_bits), reversed(self._per_held), reversed(self._largest), strict=True
        )
        steps = [per * (bits.take(width) - most) for width, per, most in widths]
        number = bits.take(self._word_bits)
        return WIRE_ERASED if number == self._words else number, tuple(reversed(steps))


class _Bits:
    """A number whose lowest bits are taken first."""

    def __init__(self, value: int) -> None:
        self._value = value

    def take(self, count: int) -> int:
        taken = self._value % (1 << count)
        self._value >>= count
        return taken


def _checksum(session: int, data: bytes) -> int:
    return crc_hqx(data, crc_hqx(session.to_bytes(4, "little"), CRC_START))


def _part_of(sample: int) -> int:
    """Return the place of the lowest of the three more bits of a sample's digest."""
    return DIGEST_BITS + PART_BITS * (sample % PART_SAMPLES)
