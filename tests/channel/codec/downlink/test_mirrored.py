"""Set-point words: what they say, and when it takes effect."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from channel.codec.codec import Vector
from channel.codec.downlink.laws import MirroredFeedback
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.mirrored import MirroredLaw, SetPointRange
from channel.codec.laws import FeedbackLaw

LAW = MirroredFeedback(
    FeedbackLaw((0.0,), ((0.0, 0.0),), ((1.0, 10.0),), ((0.0, 0.0),)), (100.0,), 0.01
)
"""Commands the first output's set-point and ten times the second's."""
ONE = (SetPointRange(0, -2.0, 2.0),)
TWO = (SetPointRange(0, -2.0, 2.0), SetPointRange(1, -1.0, 3.0, 1.0))


def flown(
    scheme: MirroredLaw, layout: Layout, source: Callable[[int], Vector], samples: int
) -> list[float]:
    """Return the command of each sample, when the receiver wants `source(sample)` in each."""
    down, found = scheme.initial(), []
    for sample in range(samples):
        for _ in range(layout.commands_in(sample, scheme.word_age(down))):
            symbol = scheme.encode(down, lambda ago, now=sample: source(max(0, now - ago)), ())
            down = scheme.take(down, symbol)
        down = scheme.settle(down)
        command, down = scheme.command(down, (0.0, 0.0), (0.0, 0.0))
        found.append(command[0])
    return found


def test_a_set_point_known_ahead_takes_effect_at_its_exact_sample() -> None:
    layout, queue = Layout(2), 12
    scheme = MirroredLaw(LAW, ONE, 2, 9, queue, layout)
    assert scheme.queue_needed <= queue
    commands = flown(scheme, layout, lambda sample: (1.0 if sample + queue >= 25 else 0.0, 0.0), 40)
    assert commands[:25] == [0.0] * 25
    assert commands[25:] == [pytest.approx(1.0, abs=scheme.quantum(0))] * 15


@pytest.mark.parametrize("change", range(24, 33))
@pytest.mark.parametrize(("layout", "queue"), [(Layout(1, 1, 8), 32), (Layout(2, 1, 4), 15)])
def test_a_change_between_two_command_symbols_keeps_its_exact_sample(
    layout: Layout, queue: int, change: int
) -> None:
    scheme = MirroredLaw(LAW, ONE, 2, 9, queue, layout)
    assert scheme.queue_needed == queue
    at = change + queue
    commands = flown(scheme, layout, lambda sample: (-1.2 if sample >= change else 0.0, 0.0), at + 9)
    assert commands[:at] == [0.0] * at
    assert commands[at:] == [pytest.approx(-1.2, abs=scheme.quantum(0))] * 9


def test_a_live_set_point_without_a_queue_moves_bit_by_bit() -> None:
    scheme = MirroredLaw(LAW, ONE, 2, 4, 0, Layout(2))
    commands = flown(scheme, Layout(2), lambda sample: (1.3, 0.0), 6)
    assert commands == [0.0, 1.0, 1.5, 1.25, 1.375, 1.375]


def test_a_queue_too_short_for_exact_times_spends_no_bits_on_them() -> None:
    short, enough = (MirroredLaw(LAW, ONE, 2, 9, queue, Layout(2, 1, 4)) for queue in (14, 15))
    assert (short.word_symbols, enough.word_symbols) == (10, 12)
    commands = flown(short, Layout(2, 1, 4), lambda sample: (1.0 if sample > 4 else 0.0, 0.0), 30)
    assert commands[8 + 14 :] == [pytest.approx(1.0, abs=short.quantum(0))] * 8


def test_several_set_points_say_which_they_are_for() -> None:
    scheme = MirroredLaw(LAW, TWO, 2, 9, 16, Layout(2))
    assert scheme.word_symbols == 11
    commands = flown(scheme, Layout(2), lambda sample: (-1.0, 2.5), 60)
    assert commands[0] == 10.0
    assert commands[-1] == pytest.approx(-1.0 + 25.0, abs=0.1)


def test_a_set_point_is_frozen_while_its_word_is_sent() -> None:
    scheme = MirroredLaw(LAW, ONE, 2, 9, 12, Layout(2))
    commands = flown(scheme, Layout(2), lambda sample: (1.0 if sample < 5 else -1.0, 0.0), 12 + 9)
    assert commands[12:17] == [pytest.approx(1.0, abs=scheme.quantum(0))] * 5


@pytest.mark.parametrize("wanted", [-9.0, 9.0])
def test_a_set_point_outside_the_range_of_its_words_is_held_to_it(wanted: float) -> None:
    scheme = MirroredLaw(LAW, ONE, 2, 9, 12, Layout(2))
    commands = flown(scheme, Layout(2), lambda sample: (wanted, 0.0), 12 + 9 + 4)
    nearest = math.copysign(2.0, wanted)
    assert commands[-1] == pytest.approx(nearest, abs=scheme.quantum(0))


@pytest.mark.parametrize(
    ("ranges", "bits", "queue"),
    [
        (ONE, 0, 12),
        (ONE, 25, 12),
        (ONE, 9, -1),
        ((), 9, 12),
        ((SetPointRange(0, 1.0, 2.0),), 9, 12),
        ((SetPointRange(2, -1.0, 1.0),), 9, 12),
        ((*ONE, *ONE), 9, 12),
    ],
)
def test_words_that_cannot_be_are_refused(
    ranges: tuple[SetPointRange, ...], bits: int, queue: int
) -> None:
    with pytest.raises(ValueError, match="output"):
        MirroredLaw(LAW, ranges, 2, bits, queue, Layout(2))


def test_a_state_from_a_line_is_one_that_a_word_can_be_in() -> None:
    scheme = MirroredLaw(LAW, TWO, 2, 9, 20, Layout(2, 1, 4))
    down = scheme.initial()
    assert scheme.is_state(down)
    for symbol in (1, 1, 0, 1):
        down = scheme.settle(scheme.take(down, symbol))
        assert scheme.is_state(down)
    assert not scheme.is_state(down[:-1])
    assert not scheme.is_state((*down[:4], 0.5, *down[5:]))
    assert not scheme.is_state((*down[:5], 99.0, *down[6:]))
