"""Frames as bytes: round trip, pinned bytes, refusals of what cannot be encoded."""

from __future__ import annotations

import json
from binascii import crc_hqx
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from channel.errors import FrameError
from channel.protocol import wire
from channel.protocol.endings import Ending
from channel.protocol.frames import (
    Bye,
    Commands,
    Desync,
    DownSymbol,
    Echo,
    ForeignVersion,
    Frame,
    Hello,
    Refuse,
    Symbol,
    Welcome,
)
from tests.golden.regenerate import example_frames

GOLDEN = json.loads(
    (Path(__file__).resolve().parents[2] / "golden" / "frames.json").read_text(encoding="utf-8")
)["frames"]

u8 = st.integers(0, 2**8 - 1)
u16 = st.integers(0, 2**16 - 1)
u32 = st.integers(0, 2**32 - 1)
u64 = st.integers(0, 2**64 - 1)
texts = st.text(max_size=200)
endings = u8.map(Ending)
"""those of later versions too"""
sixteen_bytes = st.binary(min_size=16, max_size=16)
eight_bytes = st.binary(min_size=8, max_size=8)


@st.composite
def commands(draw: st.DrawFn) -> Commands:
    last = draw(u32)
    count = draw(st.integers(1, min(last + 1, 20)))
    volts = draw(st.integers(0, 30))
    echoes = [
        Echo(
            last + 1 - count + index,
            draw(u16),
            draw(u64),
            tuple(draw(st.lists(st.integers(-32768, 32767), min_size=volts, max_size=volts))),
        )
        for index in range(count)
    ]
    return Commands(draw(u32), draw(u16), tuple(echoes))


frames = st.one_of(
    st.builds(Hello, u32, texts, sixteen_bytes, eight_bytes),
    st.builds(Welcome, u32, u16, u32, u32),
    st.builds(Refuse, u32, endings, texts, texts),
    st.builds(Symbol, u32, u16, u32, u8),
    st.builds(DownSymbol, u32, u16, u32, u8),
    commands(),
    st.builds(Desync, u32, u16, u32, u64, u64, st.binary(max_size=300)),
    st.builds(Bye, u32, endings, texts),
)


@settings(derandomize=True, database=None, deadline=None, max_examples=400)
@given(frame=frames)
def test_when_a_frame_is_encoded_then_decoding_gives_it_back(frame: Frame) -> None:
    assert wire.decode(wire.encode(frame)) == frame


def test_when_the_examples_are_encoded_then_the_bytes_are_as_written() -> None:
    frames_now = [[type(frame).__name__, wire.encode(frame).hex()] for frame in example_frames()]
    assert frames_now == GOLDEN


def test_when_the_pinned_bytes_are_decoded_then_they_are_the_examples() -> None:
    assert [wire.decode(bytes.fromhex(data)) for _, data in GOLDEN] == example_frames()
    assert {kind for kind, _ in GOLDEN} == {
        "Hello", "Welcome", "Refuse", "Symbol", "Commands", "Desync", "Bye", "Unknown", "Claim",
        "DownSymbol",
    }  # fmt: skip


def test_when_an_ending_is_of_a_later_version_then_its_number_is_kept() -> None:
    frame = wire.decode(wire.encode(Bye(1, Ending(200), "for people")))
    assert isinstance(frame, Bye)
    assert (frame.ending.value, frame.ending.name) == (200, "UNKNOWN_200")
    assert frame.ending not in list(Ending)


def test_when_a_symbol_is_encoded_then_it_takes_fifteen_bytes_in_the_stated_order() -> None:
    data = wire.encode(Symbol(0x01020304, 5, 6, 1))
    assert data[:-2] == bytes.fromhex("02 04 04030201 0500 06000000 01")
    assert int.from_bytes(data[-2:], "little") == crc_hqx(data[:-2], 0xFFFF)


def test_when_the_checksum_is_computed_then_it_is_ccitt_false() -> None:
    assert crc_hqx(b"123456789", wire.CRC_START) == 0x29B1


@pytest.mark.parametrize("version", [0, 1, 0xF5, 255])
def test_when_a_frame_is_of_another_version_then_it_is_reported_and_not_read(
    version: int,
) -> None:
    message = bytes((version,)) + b"whatever follows, 20 bytes or so"
    data = message + crc_hqx(message, 0xFFFF).to_bytes(2, "little")
    assert wire.decode(data) == ForeignVersion(version)
    with pytest.raises(FrameError, match="checksum"):
        wire.decode(data[:-1] + bytes((data[-1] ^ 1,)))


@pytest.mark.parametrize(
    "frame",
    [
        Symbol(2**32, 0, 0, 0),
        Symbol(0, 2**16, 0, 0),
        Symbol(0, 0, 2**32, 0),
        Symbol(0, 0, 0, 256),
        Symbol(0, 0, -1, 0),
        Welcome(0, 0, 2**32, 0),
        Bye(0, Ending.OVER, "x" * 70_000),
        Bye(0, Ending.OVER, "x" * 16_383),
        Bye(0, Ending.OVER, "\ud800"),
        Commands(0, 0, (Echo(0, 0, 0, (32768,)),)),
        Commands(0, 0, (Echo(0, 0, 2**64, ()),)),
        Commands(0, 0, tuple(Echo(sample, 0, 0, ()) for sample in range(256))),
        Desync(0, 0, 0, 0, 0, bytes(17_000)),
        ForeignVersion(2),
    ],
    ids=lambda frame: type(frame).__name__,
)
def test_when_values_fit_no_frame_then_encoding_refuses(frame: Frame) -> None:
    with pytest.raises(ValueError):
        wire.encode(frame)


@pytest.mark.parametrize(
    "frame",
    [
        pytest.param(Commands(0, 0, ()), id="no echo: IndexError"),
        pytest.param(
            Commands(0, 0, (Echo(3, 0, 0, ()), Echo(5, 0, 0, ()))), id="a gap: silently renumbered"
        ),
        pytest.param(
            Commands(0, 0, (Echo(3, 0, 0, (1,)), Echo(4, 0, 0, (1, 2, 3)))), id="unequal: misread"
        ),
        pytest.param(Hello(0, "", bytes(15), bytes(8)), id="short digest: silently padded"),
        pytest.param(Hello(0, "", bytes(17), bytes(8)), id="long digest: silently cut"),
    ],
)
def test_when_a_frame_would_not_come_back_as_it_is_then_encoding_refuses(frame: Frame) -> None:
    with pytest.raises(ValueError):
        wire.encode(frame)


def test_when_the_longest_frame_is_encoded_then_it_is_decoded_and_one_byte_more_is_not() -> None:
    room = wire.FRAME_BYTES_MAX - len(wire.encode(Bye(0, Ending.OVER, "")))
    longest = Bye(0, Ending.OVER, "x" * room)
    assert wire.decode(wire.encode(longest)) == longest
    with pytest.raises(ValueError, match="at most 16384 bytes"):
        wire.encode(Bye(0, Ending.OVER, "x" * (room + 1)))
