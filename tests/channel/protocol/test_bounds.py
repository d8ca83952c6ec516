"""What a frame may hold: everything else is dropped and counted, by name, before it is kept."""

from __future__ import annotations

import struct
from collections import Counter
from dataclasses import replace
from typing import Any

import pytest

from channel.codec.codec import STATE_MAX, WIRE_ERASED, is_coder_state
from channel.protocol import wire
from channel.protocol.bounds import (
    COUNTER,
    COUNTER_MAX,
    TEXT_CHARACTERS_MAX,
    Bounds,
    shown,
    within_text_bounds,
)
from channel.protocol.endings import Ending
from channel.protocol.events import Dropped, Event, EventKind
from channel.protocol.frames import Bye, Commands, Desync, Echo, Hello, Refuse, Symbol, Welcome
from tests.channel.codec.parts import pitch_codec, terms
from tests.golden.regenerate import GOLDEN_CODECS

CODEC = pitch_codec()
TERMS = terms()
SAMPLE = 100
REACH = 2 * TERMS.history_samples
VOLTS = (5000, -5000) * 10


def bounds(**changes: Any) -> Bounds:
    return Bounds(CODEC, terms(**changes), Counter(), lambda _kind, _text: None)


def welcome(**changes: Any) -> Welcome:
    return replace(Welcome(7, 1, SAMPLE, 5, 1, (1000, -1000), packed()), **changes)


def packed(sample: int = SAMPLE, **changes: float) -> bytes:
    state = CODEC.initial()
    values = [*state.model, *state.coder]
    for place, value in changes.items():
        values[int(place[1:])] = value
    return struct.pack(f"<q{len(values)}d", sample, *values)


def echo(sample: int = SAMPLE, **changes: Any) -> Echo:
    return Echo(sample, 1, 0, VOLTS)._replace(**changes)


def test_when_frames_are_what_the_other_end_sends_then_they_are_within_bounds() -> None:
    ours = bounds()
    assert ours.of_welcome(welcome(), SAMPLE) is None
    assert ours.of_welcome(Welcome(7, 0, 0, 5), None) is None
    assert ours.of_commands(Commands(7, 1, (echo(98), echo(99), echo(100))), SAMPLE, 98, 101) is None
    assert ours.of_symbol(Symbol(7, 1, SAMPLE, 1)) is None
    assert ours.of_hello(Hello(5, "1", bytes(16), bytes(8), sample=SAMPLE)) is None
    assert ours.of_report(Desync(7, 1, 99, 1, 2, packed()), 1, SAMPLE) is None
    assert ours.of_report(Desync(7, 1, 99, 1, 2, b""), 1, SAMPLE) is None


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"session": 0}, "without a number"),
        ({"hold_steps": (1, 2, 3)}, "3 inputs"),
        ({"hold_steps": (5001, 0)}, "beyond"),
        ({"first_sample": SAMPLE + REACH + 1}, "a start at sample"),
        ({"first_sample": 2**31}, "a start at sample"),
        ({"state": packed(a0=1e36)}, "not a state of this codec"),
        ({"state": packed(a1=STATE_MAX)}, "not a state of this codec"),
        ({"state": packed(a2=float("nan"))}, "not finite"),
        ({"state": packed(a4=-0.1)}, "not a state of this codec"),
        ({"state": packed(a4=1e9)}, "not a state of this codec"),
        ({"state": packed(a5=0.5)}, "not a state of this codec"),
        ({"state": packed(sample=SAMPLE + 1)}, "a state of sample 101"),
        ({"state": packed(sample=-1)}, "negative"),
        ({"state": b"\0" * 7}, "bytes"),
    ],
)
def test_when_an_answer_is_out_of_bounds_then_the_error_names_it(
    changes: dict[str, Any], text: str
) -> None:
    problem = bounds().of_welcome(welcome(**changes), SAMPLE)
    assert problem is not None
    assert text in problem


def test_when_the_first_answer_comes_then_only_the_counters_bound_its_start() -> None:
    far = 2**31
    assert bounds().of_welcome(Welcome(7, 0, far, 5), None) is None
    assert bounds().of_welcome(Welcome(7, 0, far + 1, 5), None) is not None
    # Where such a flight asks for another start, a receiver that knows nothing still follows.
    asked = Hello(5, "1", bytes(16), bytes(8), 1, 7, 0, far + 10**6)
    assert bounds().of_hello(asked) is None
    words = bounds(symbols_per_word=10)
    assert words.of_welcome(Welcome(7, 0, far, 5), None) is not None
    slow = bounds(tick_ns=10**9, rate_baud=0.1)
    assert slow.sample_max * slow._terms.sample_ns <= 2**63


@pytest.mark.parametrize(
    ("echoes", "text"),
    [
        (tuple(echo(97 + index) for index in range(4)), "4 echoes"),
        ((echo(SAMPLE + REACH + 1, word_number=WIRE_ERASED),), "during sample 100"),
        ((echo(steps=VOLTS[:-1]),), "19 values"),
        ((echo(steps=()),), "0 values"),
        ((echo(steps=(5001, *VOLTS[1:])),), "beyond"),
        ((echo(steps=(-32768, *VOLTS[1:])),), "beyond"),
        ((echo(word_number=2),), "no word"),
        ((echo(101),), "has not been sent"),
    ],
)
def test_when_commands_are_out_of_bounds_then_the_error_names_it(
    echoes: tuple[Echo, ...], text: str
) -> None:
    problem = bounds().of_commands(Commands(7, 1, echoes), SAMPLE, 90, 101)
    assert problem is not None
    assert text in problem


def test_when_symbols_requests_and_reports_are_out_of_bounds_then_it_is_reported() -> None:
    ours = bounds()
    assert ours.of_symbol(Symbol(7, 1, SAMPLE, 2)) is not None
    assert ours.of_symbol(Symbol(7, 1, 2**32 - 1, 1)) is not None
    assert ours.of_hello(Hello(5, "1", bytes(16), bytes(8), sample=COUNTER_MAX + 1)) is not None
    for report in (
        Desync(7, 2, 99, 1, 2, b""),
        Desync(7, 1, SAMPLE, 1, 2, b""),
        Desync(7, 1, 2**31, 1, 2, b""),
        Desync(7, 1, 99, 1, 2, b"\0"),
    ):
        assert ours.of_report(report, 1, SAMPLE) is not None
    assert ours.of_report(Desync(7, 1, 99, 1, 2, b""), 1, 100 + REACH) is not None


def test_when_a_frame_is_dropped_then_it_is_counted_and_reported() -> None:
    counts: Counter[str] = Counter()
    told: list[Event] = []
    ours = Bounds(CODEC, TERMS, counts, told.append)
    assert not ours.drops(None)
    assert ours.drops("too much")
    assert counts == {COUNTER: 1}
    assert told == [Event(EventKind.STALE, cause=Dropped.OUT_OF_BOUNDS, detail="too much")]


@pytest.mark.parametrize("name", GOLDEN_CODECS)
def test_when_a_coder_flies_then_all_its_states_are_within_its_bounds(name: str) -> None:
    codec = GOLDEN_CODECS[name]
    symbols = codec.coder.alphabet.symbols
    state = codec.initial()
    volts = (0.0,) * codec.model.input_size
    for sample in range(200):
        symbol = symbols[sample * sample // 3 % len(symbols)]
        word = None if sample % 7 == 3 else (symbol,) * codec.coder.alphabet.symbols_per_word
        state = codec.step(state, word, [volts] * codec.ticks_per_sample)
        assert is_coder_state(codec.coder, state.coder)


@pytest.mark.parametrize(
    ("name", "coder"),
    [
        ("paper", (-1.0, 0.0)),
        ("paper", (0.5, 2.0)),
        ("time-based zooming", (-0.1,)),
        ("history of three signs", (0.1, 4.0)),
        ("history of three signs", (0.1, 0.5)),
        ("history of three signs", (0.1, -1.0)),
        ("history of three signs", (5.0, 1.0)),
        ("words of ten bits", (0.0, -1.0)),
        ("words of ten bits", (0.0, 0.5)),
        ("words of ten bits", (99.0, 1.0)),
    ],
)
def test_when_a_coder_cannot_be_in_a_state_then_it_says_so(name: str, coder: tuple[float, ...]) -> None:
    assert not is_coder_state(GOLDEN_CODECS[name].coder, coder)


def test_when_a_text_would_steer_a_terminal_or_fill_a_frame_then_it_is_cut_and_made_harmless() -> None:
    assert shown("the line\nis cut: 3 \u00b5s") == "the line\nis cut: 3 \u00b5s"
    assert shown("\x1b]0;mine\x07 \u202e") == "?]0;mine? ?"
    long = within_text_bounds(Bye(7, Ending.OVER, "\U0001f681" * 4000))
    assert isinstance(long, Bye)
    assert len(long.text) == TEXT_CHARACTERS_MAX
    # A receiver that has ended quotes the reason to whoever asks.
    wire.encode(Refuse(5, Ending.ALREADY_ENDED, long.text, ""))
    refuse = within_text_bounds(Refuse(5, Ending.BUSY, "\x9b2J", "{}"))
    assert refuse == Refuse(5, Ending.BUSY, "?2J", "{}")
