"""The stream cut back into messages: the same however it is read, and it finds its feet again."""

from __future__ import annotations

import random
from collections import Counter

import pytest

from channel.links.serial.stream import RUN, Deframer
from channel.links.serial.wire import STUFFED_BYTES_MAX, SerialWire, stuff, stuff_notice
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, Commands, Echo, Hello, Symbol
from channel.protocol.wire import encode

WIRE = SerialWire(2)
HELLO = encode(Hello(7, "0.1.0", bytes(range(16)), bytes(range(8))))
COMMANDS = encode(Commands(9, 0, (Echo(4, 1, 2**63, (100, -100) * 10),)))
SEED = 77


def symbol(slot: int) -> bytes:
    return WIRE.encode(Symbol(9, 0, slot, slot * slot % 2))


def symbols(first: int, count: int) -> list[bytes]:
    return [symbol(slot) for slot in range(first, first + count)]


class Ear:
    """A deframer and what came out of it."""

    def __init__(self, wire: SerialWire | None = WIRE) -> None:
        self.dropped: Counter[str] = Counter()
        self.messages: list[bytes] = []
        self.notices: list[bytes] = []
        self.deframer = Deframer(wire, self._drop)

    def hear(self, *pieces: bytes) -> list[bytes]:
        """Return the messages that these bytes bring."""
        before = len(self.messages)
        for piece in pieces:
            for received in self.deframer.feed(piece):
                (self.notices if received.is_notice else self.messages).append(received.message)
        return self.messages[before:]

    def _drop(self, kind: str) -> None:
        self.dropped[kind] += 1


def test_when_all_is_well_then_every_message_comes_and_nothing_is_dropped() -> None:
    ear = Ear()
    row = symbols(0, 20)
    stream = stuff(HELLO) + b"".join(row[:9]) + stuff(COMMANDS) + stuff(HELLO) + b"".join(row[9:])
    assert ear.hear(stream, stuff_notice(b"\2")) == [HELLO, *row[:9], COMMANDS, HELLO, *row[9:]]
    assert ear.notices == [b"\2"]
    assert not ear.dropped


def test_when_symbols_look_like_a_frame_then_inside_one_they_are_not_taken_out() -> None:
    ear = Ear()
    message = b"\x01" + b"".join(symbols(0, RUN - 1)) + b"end"
    assert ear.hear(stuff(message)) == [message]
    assert not ear.dropped


def test_when_a_direction_has_no_symbols_then_loose_bytes_are_garbage() -> None:
    ear = Ear(None)
    assert ear.hear(symbol(3), stuff(COMMANDS), symbol(4)) == [COMMANDS]
    assert ear.dropped == {"check bits": 2}


def test_when_check_bits_are_wrong_or_bit_7_is_missing_then_the_byte_is_dropped() -> None:
    ear = Ear()
    (byte,) = symbol(1)
    assert ear.hear(bytes((byte ^ 1, byte & 0x7F, byte))) == [symbol(1)]
    assert ear.dropped == {"check bits": 1, "garbage byte": 1}


def test_when_a_break_comes_as_a_zero_then_the_next_symbol_is_still_taken() -> None:
    ear = Ear()
    assert ear.hear(symbol(0), b"\0", symbol(1), b"\0\0\0", symbol(2), stuff(HELLO)) == [
        *symbols(0, 3),
        HELLO,
    ]
    assert ear.dropped["stray zero"] > 0


def test_when_a_frame_is_cut_off_then_the_next_one_is_taken() -> None:
    ear = Ear()
    assert ear.hear(stuff(HELLO)[:20], stuff(COMMANDS)) == [COMMANDS]
    assert sum(ear.dropped.values()) == 1


@pytest.mark.parametrize("lost", ["first", "last"])
def test_when_a_delimiter_is_lost_then_at_most_the_neighbour_is_lost_too(lost: str) -> None:
    ear = Ear(None)
    line = stuff(COMMANDS)
    broken = b"\x55" + line[1:] if lost == "first" else line[:-1] + b"\x55"
    came = ear.hear(broken, stuff(COMMANDS), stuff(HELLO))
    assert came in ([COMMANDS, HELLO], [HELLO])
    assert ear.dropped


def test_when_symbols_follow_a_half_frame_then_a_row_of_them_ends_it() -> None:
    ear = Ear()
    row = symbols(0, 3 * RUN)
    assert ear.hear(stuff(HELLO)[:15]) == []
    assert ear.hear(*row) == row[RUN - 1 :]
    assert ear.dropped == {"half frame": 1}


def test_when_a_frame_never_ends_then_it_is_dropped_once_and_the_line_recovers() -> None:
    ear = Ear()
    assert ear.hear(b"\0" + b"\x07" * (3 * STUFFED_BYTES_MAX)) == []
    assert ear.dropped == {"oversize": 1}
    assert ear.hear(b"\0", stuff(HELLO), symbol(0)) == [HELLO, symbol(0)]
    assert ear.hear(b"\0" + b"\x07" * (2 * STUFFED_BYTES_MAX), *symbols(0, RUN)) == [symbol(RUN - 1)]


def test_when_it_is_reset_within_a_frame_then_the_half_frame_is_counted_and_forgotten() -> None:
    ear = Ear()
    ear.hear(stuff(HELLO)[:15])
    ear.deframer.reset()
    assert ear.hear(symbol(0)) == [symbol(0)]
    assert ear.dropped == {"half frame": 1}


def noisy_stream(chooser: random.Random) -> bytes:
    """Frames and symbols with bytes changed, lost, added and frames cut."""
    out = bytearray()
    slot = 0
    for _ in range(60):
        kind = chooser.randrange(8)
        if kind < 4:
            piece = b"".join(symbols(slot, chooser.randrange(1, 9)))
            slot += 5
        elif kind < 6:
            piece = stuff(chooser.choice((HELLO, COMMANDS, encode(Bye(9, Ending.OVER, "done")))))
        elif kind == 6:
            piece = chooser.randbytes(chooser.randrange(1, 30))
        else:
            piece = stuff(COMMANDS)[: chooser.randrange(1, 40)]
        out += bytes(
            byte ^ chooser.randrange(256) if chooser.random() < 0.02 else byte for byte in piece
        )
    return bytes(out)


def test_when_a_noisy_stream_is_cut_anyhow_then_the_same_messages_and_counts_come() -> None:
    chooser = random.Random(SEED)
    messages = 0
    for _ in range(150):
        stream = noisy_stream(chooser)
        whole, single, pieces = Ear(), Ear(), Ear()
        whole.hear(stream)
        single.hear(*(bytes((byte,)) for byte in stream))
        place = 0
        while place < len(stream):
            length = chooser.randrange(1, 50)
            pieces.hear(stream[place : place + length])
            place += length
        assert whole.messages == single.messages == pieces.messages, f"seed {SEED}"
        assert whole.dropped == single.dropped == pieces.dropped
        messages += len(whole.messages)
    assert messages > 10_000


def test_when_noise_stops_then_the_stream_is_whole_again_after_one_frame_and_one_row() -> None:
    chooser = random.Random(SEED + 1)
    for _ in range(300):
        ear = Ear()
        ear.hear(chooser.randbytes(chooser.randrange(1, 400)))
        ear.hear(*symbols(0, RUN))  # ends a half frame if there is one
        after = symbols(RUN, 5)
        assert ear.hear(*after, stuff(HELLO), *after) == [*after, HELLO, *after]
