"""The frames of the compact downlink: bits there and back, whose they are, which command is held."""

from __future__ import annotations

import random
from binascii import crc_hqx
from typing import Any

import pytest

from channel.codec.codec import WIRE_ERASED, Alphabet, Codec
from channel.errors import FrameError
from channel.protocol.compact import PART_SAMPLES, CompactForm
from channel.protocol.frames import Commands, Echo, ShortCommands
from channel.protocol.limits import CommandLimits, from_steps
from channel.protocol.wire import decode, encode
from tests.channel.codec.parts import PAPER_TERMS, pitch_codec, terms

CODEC = pitch_codec()
SESSION, EPOCH = 0x1A2B3C4D, 6


def form(codec: Codec = CODEC, **changes: Any) -> CompactForm:
    return CompactForm(codec, terms(downlink="compact", **changes))


def echo(sample: int, word: int = 1, steps: tuple[int, int] = (1500, -1500), digest: int = 7) -> Echo:
    return Echo(sample, word, digest, steps * 10)


def through(sender: CompactForm, *echoes: Echo, near: int | None = None) -> Commands | None:
    """Return what comes of a frame that went over a line as bytes."""
    message = encode(sender.packed(SESSION, EPOCH, echoes))
    assert len(message) == sender.frame_bytes
    frame = decode(message)
    assert isinstance(frame, ShortCommands)
    near = echoes[-1].sample if near is None else near
    return form().unpacked(frame, SESSION, EPOCH, near)


def test_when_the_papers_echoes_are_packed_then_these_are_the_16_bytes() -> None:
    echoes = (echo(698, 0), echo(699, WIRE_ERASED, (0, 5)), echo(700, 1, (-5000, 5000), 0xABCD))
    message = encode(form().packed(SESSION, EPOCH, echoes))
    assert message.hex(" ") == "ad bc ab cd 08 00 fa 13 e8 7d 25 14 57 80 0d f8"


@pytest.mark.parametrize("near", [-120, -1, 0, 1, 127])
def test_when_a_frame_comes_within_half_a_turn_of_the_clock_then_it_says_what_was_packed(
    near: int,
) -> None:
    echoes = (
        echo(998, 0),
        echo(999, WIRE_ERASED, (0, 5)),
        echo(1000, 1, (-5000, 5000), 0x8100_0001_ABCD),
    )
    got = through(form(), *echoes, near=1000 + near)
    assert got is not None
    assert (got.session, got.epoch) == (SESSION, EPOCH)
    # Of the newest 16 bits of the digest and, 1000 being 8 modulo 16, bits 40 to 42; else none.
    *repeated, newest = got.echoes
    assert newest == echoes[-1]._replace(digest=0x100_0000_ABCD, digest_mask=0x700_0000_FFFF)
    assert repeated == [one._replace(digest=0, digest_mask=0) for one in echoes[:-1]]


def test_when_an_alphabet_is_large_and_a_word_long_then_every_word_and_the_erasure_pass() -> None:
    codec = pitch_codec()
    codec.coder.alphabet = Alphabet((-2, -1, 0, 1, 2), 2)  # type: ignore[misc]
    both = [form(codec), form(codec)]
    for number in (*range(25), WIRE_ERASED):
        frame = both[0].packed(SESSION, EPOCH, (echo(3), echo(4), echo(5, number)))
        got = both[1].unpacked(frame, SESSION, EPOCH, 5)
        assert got is not None
        assert [one.word_number for one in got.echoes] == [1, 1, number]


def test_when_an_epoch_begins_then_missing_echoes_are_of_samples_before_it() -> None:
    got = through(form(), echo(0))
    assert got is not None
    assert [one.sample for one in got.echoes] == [0]
    got = through(form(), echo(40))
    assert got is not None
    assert (got.echoes[-1].sample, got.echoes[-1].steps) == (40, echo(40).steps)


@pytest.mark.parametrize(
    ("session", "epoch"), [(SESSION + 1, EPOCH), (SESSION, EPOCH + 1), (SESSION, EPOCH - 1)]
)
def test_when_session_or_epoch_is_another_then_the_frame_is_nobodys(session: int, epoch: int) -> None:
    frame = form().packed(SESSION, EPOCH, (echo(1),))
    assert form().unpacked(frame, SESSION, EPOCH, 1) is not None
    assert form().unpacked(frame, session, epoch, 1) is None


def test_when_a_frame_has_another_length_or_bits_in_its_padding_then_it_is_nobodys() -> None:
    frame = form().packed(SESSION, EPOCH, (echo(1),))
    for data in (frame.data[:-1], frame.data + b"\0", frame.data[:-1] + b"\1"):
        right = crc_hqx(SESSION.to_bytes(4, "little") + data, 0xFFFF)
        assert form().unpacked(ShortCommands(data, right), SESSION, EPOCH, 1) is None


@pytest.mark.parametrize("session", [SESSION ^ 1 << bit for bit in range(32)])
def test_when_a_frame_is_left_from_another_session_then_it_is_stale_or_fails_the_checksum(
    session: int,
) -> None:
    frame = form().packed(session, EPOCH, (echo(1),))
    assert form().unpacked(frame, SESSION, EPOCH, 1) is None
    if session % 16 != SESSION % 16:
        form().require_whole(frame, SESSION)
        return
    with pytest.raises(FrameError, match="checksum"):
        form().require_whole(frame, SESSION)


@pytest.mark.parametrize("first", [0, 5, 250])
def test_when_sixteen_frames_have_come_then_each_of_a_digests_64_bits_has(first: int) -> None:
    chance = random.Random(3)
    seen = 0
    for sample in range(first, first + PART_SAMPLES):
        digest = chance.getrandbits(64)
        got = through(form(), echo(sample, digest=digest))
        assert got is not None
        newest = got.echoes[-1]
        assert newest.digest == digest & newest.digest_mask
        assert newest.digest_mask.bit_count() == 19
        seen |= newest.digest_mask
    assert seen == 2**64 - 1


def test_when_a_sample_has_many_ticks_then_the_mean_is_held_in_steps_that_pass() -> None:
    sender = form()
    steps = sender.held([(1.0, -1.0), (2.0, -1.0), (2.0, -1.004)] + [(2.0, -1.0)] * 7, (0.0, 0.0))
    # +-5 V in 11 bits: steps of 5 mV.
    assert steps == (1900, -1000)
    assert sender.held([(9.0, -9.0)] * 10, (0.0, 0.0)) == (5000, -5000)
    got = through(sender, echo(1, steps=(1900, -5000)))
    assert got is not None
    assert got.echoes[-1].steps == (1900, -5000) * 10


def test_when_a_held_command_is_held_again_then_it_is_the_same() -> None:
    """A recording is flown again from the commands that were held."""
    sender = form()
    for steps in range(-5000, 5001, 5):
        command = from_steps((steps, -steps), PAPER_TERMS.signals)
        assert sender.held([command] * 10, command) == (steps, -steps)


def test_when_the_change_is_limited_then_a_held_command_moves_by_one_tick_of_it() -> None:
    limits = CommandLimits.of(PAPER_TERMS.signals, 5.0, 0.5)
    assert form(limits=limits).held([(3.0, -3.0)] * 10, (0.0, 0.0)) == (500, -500)


def test_when_a_limit_is_small_then_a_command_keeps_its_own_steps_in_fewer_bits() -> None:
    limits = CommandLimits.of(PAPER_TERMS.signals, 0.1)
    small = form(limits=limits)
    assert small.held([(0.003, -0.1)] * 10, (0.0, 0.0)) == (3, -100)
    assert small.frame_bytes == 1 + (8 + 16 + 3 + 3 * (2 + 2 * 8) + 7) // 8 + 2


def test_when_symbols_are_fast_then_samples_have_more_bits() -> None:
    fast = terms(tick_ns=1_000_000, ticks_per_sample=1, downlink="compact")
    assert fast.history_samples == 250
    sender, receiver = (CompactForm(pitch_codec(ticks_per_sample=1), fast) for _ in range(2))
    frame = sender.packed(1, 0, (Echo(5000, 1, 1, (0, 0)),))
    for near in (4501, 5000, 5499):
        got = receiver.unpacked(frame, 1, 0, near)
        assert got is not None
        assert got.echoes[-1].sample == 5000
