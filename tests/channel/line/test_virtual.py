"""The envelopes of the virtual clock."""

from __future__ import annotations

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from channel.errors import FrameError
from channel.line.slots import Departure
from channel.line.virtual import (
    MAGIC,
    Reply,
    Step,
    decode_reply,
    decode_step,
    encode_reply,
    encode_step,
    is_envelope,
)
from channel.protocol import wire
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye

SEED = 20240616
fixed = settings(derandomize=True, database=None, deadline=None, max_examples=200)
numbers = st.integers(0, 2**32 - 1)
times = st.integers(0, 2**63 - 1)
departures = st.lists(st.builds(Departure, times, st.binary()), max_size=5)
messages = st.lists(st.binary(max_size=300), max_size=5)


@fixed
@given(numbers, st.integers(-(2**63), 2**63 - 1), st.none() | st.binary(min_size=1, max_size=300))
def test_when_a_step_is_encoded_then_decoding_gives_it_back(
    number: int, time_ns: int, data: bytes | None
) -> None:
    step = Step(number, time_ns, data)
    encoded = encode_step(step)
    assert is_envelope(encoded)
    assert decode_step(encoded) == step


@fixed
@given(
    numbers, st.none() | times, messages, st.lists(st.builds(Departure, times, st.binary()), max_size=5)
)
def test_when_a_reply_is_encoded_then_decoding_gives_it_back(
    number: int, deadline_ns: int | None, frames: list[bytes], later: list[Departure]
) -> None:
    reply = Reply(number, deadline_ns, tuple(frames), tuple(later))
    encoded = encode_reply(reply)
    assert is_envelope(encoded)
    assert decode_reply(encoded) == reply


def test_when_a_frame_as_long_as_any_travels_in_an_envelope_then_it_comes_back() -> None:
    longest = bytes(wire.FRAME_BYTES_MAX)
    assert decode_step(encode_step(Step(1, 2, longest))).data == longest
    assert decode_reply(encode_reply(Reply(1, None, (longest,)))).frames == (longest,)


def test_when_a_plain_frame_comes_then_it_is_no_envelope() -> None:
    data = wire.encode(Bye(1, Ending.OVER, "done"))
    assert wire.WIRE_VERSION != MAGIC
    assert not is_envelope(data)
    assert not is_envelope(b"")
    for decode in (decode_step, decode_reply):
        with pytest.raises(FrameError, match="not an envelope"):
            decode(data)


def test_when_step_and_reply_are_mixed_up_then_it_is_noticed() -> None:
    with pytest.raises(FrameError):
        decode_reply(encode_step(Step(1, 2, b"x")))
    with pytest.raises(FrameError):
        decode_step(encode_reply(Reply(1, None, ())))


def test_when_an_envelope_is_truncated_then_it_is_refused() -> None:
    step = encode_step(Step(1, 2, None))
    for length in range(len(step)):
        with pytest.raises(FrameError):
            decode_step(step[:length])
    frames = (b"abc", b"defgh")
    reply = encode_reply(Reply(1, 9, frames))
    whole = {len(step), len(step) + 5, len(reply)}  # a cut between frames is another reply
    for length in set(range(len(reply))) - whole:
        with pytest.raises(FrameError):
            decode_reply(reply[:length])


def test_when_bytes_are_garbage_then_nothing_but_frame_error_is_raised() -> None:
    chooser = random.Random(SEED)
    refused = 0
    for _ in range(20_000):
        data = chooser.randbytes(chooser.randrange(0, 60))
        if chooser.random() < 0.8:
            data = bytes((MAGIC, chooser.choice((1, 2)))) + data
        for decode in (decode_step, decode_reply):
            try:
                decode(data)
            except FrameError:
                refused += 1
    assert 1000 < refused < 40_000, f"seed {SEED}"
