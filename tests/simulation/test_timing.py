"""Arrival times carry nothing: only whether a symbol was in time, which is a third symbol."""

from __future__ import annotations

import random

import pytest

from channel.protocol.frames import Commands, Symbol
from receiver.controllers.pid import PAPER_GAINS, Pid
from receiver.session.schedule import EARLY_SAMPLES
from receiver.session.session import ReceiverSession
from tests.channel.codec.parts import TICK_S, pitch_codec, terms
from tests.receiver.session.sessions import IDENTITY, SESSION, hello
from tests.simulation.flight import REFERENCE

PERIOD_NS = 100_000_000
ALLOWANCE_NS = 40_000_000
SYMBOLS = 300
CODEC = pitch_codec()


def states(arrivals: list[int | None]) -> tuple[list[tuple[int, int]], int]:
    """Receive a fixed symbol sequence at these times (None: never); return echoes and erasures."""
    session = ReceiverSession(
        CODEC,
        terms(lead_ticks=13, deadline_allowance_ns=ALLOWANCE_NS),
        Pid(PAPER_GAINS, REFERENCE, TICK_S),
        IDENTITY,
        SESSION,
    )
    session.on_frame(hello(), 0)
    chooser = random.Random(5)
    frames = []
    order = []
    for slot, arrival in enumerate(arrivals):
        number = chooser.randrange(2)
        if arrival is not None:
            order.append((arrival, Symbol(SESSION, 0, slot, number)))
    for now_ns, symbol in sorted(order, key=lambda pair: pair[0]):
        frames += session.on_deadline(now_ns - 1)
        frames += session.on_frame(symbol, now_ns)
    echoes = [frame.echoes[-1] for frame in frames if isinstance(frame, Commands)]
    return [(echo.word_number, echo.digest) for echo in echoes], session.counts["erasures"]


def even(jitter_ns: int, seed: int = 1) -> list[int]:
    chooser = random.Random(seed)
    return [slot * PERIOD_NS + chooser.randrange(jitter_ns + 1) for slot in range(SYMBOLS)]


@pytest.mark.parametrize(
    "arrivals",
    [
        even(ALLOWANCE_NS // 2, 2),
        even(ALLOWANCE_NS // 2, 3),
        [slot * PERIOD_NS + slot * 10_000 for slot in range(SYMBOLS)],
        [slot * PERIOD_NS + (slot % 2) * ALLOWANCE_NS for slot in range(SYMBOLS)],
        [max(0, slot - EARLY_SAMPLES) * PERIOD_NS for slot in range(SYMBOLS)],
    ],
    ids=["jitter", "other jitter", "slow clock", "every other at the deadline", "all early"],
)
def test_when_symbols_come_at_other_times_within_their_deadlines_then_the_states_are_the_same(
    arrivals: list[int | None],
) -> None:
    expected, none = states(list(even(0)))
    assert none == 0
    assert len(expected) == SYMBOLS
    assert states(arrivals) == (expected, 0)


def test_when_a_deadline_is_missed_then_it_is_the_third_symbol_and_is_counted() -> None:
    arrivals: list[int | None] = list(even(0))
    late: list[int | None] = list(arrivals)
    late[100] = 100 * PERIOD_NS + ALLOWANCE_NS + 2
    never: list[int | None] = list(arrivals)
    never[100] = None
    expected, _ = states(list(arrivals))
    echoes, erasures = states(late)
    assert erasures == 1
    assert echoes[:100] == expected[:100]
    assert echoes[100][0] == 0xFFFF
    assert echoes[100:] != expected[100:]
    # How late it was, or that it came at all, is not seen either.
    assert states(never) == (echoes, 1)
