"""A clean line."""

from __future__ import annotations

from channel.line.line import Delivery, Line


def test_when_a_line_is_clean_then_messages_arrive_whole_after_the_delay_of_their_kind() -> None:
    line = Line(symbol_delay_ns=100, delay_ns=7)
    assert line.carry(b"symbol", True, 1000) == [Delivery(1100, b"symbol")]
    assert line.carry(b"other", False, 1000) == [Delivery(1007, b"other")]


def test_when_no_delay_is_given_then_messages_arrive_at_once() -> None:
    assert Line().carry(b"", True, 5) == [Delivery(5, b"")]
    assert Line().carry(b"x", False, -5) == [Delivery(-5, b"x")]
