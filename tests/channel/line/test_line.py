"""A clean line, and what waits for one."""

from __future__ import annotations

from channel.line.line import CleanLine, Delivery, Inlet, Outbox
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, Symbol
from channel.protocol.wire import encode

SYMBOL = encode(Symbol(7, 0, 3, 1))
BYE = encode(Bye(7, Ending.OVER, "enough"))


def test_when_a_line_is_clean_then_messages_arrive_whole_after_its_delay() -> None:
    assert CleanLine(7).carry(b"other", 1000) == [Delivery(1007, b"other")]
    assert CleanLine().carry(b"", 5) == [Delivery(5, b"")]


def test_when_messages_wait_then_they_leave_when_due_and_in_order_of_being_put() -> None:
    outbox = Outbox()
    outbox.put([Delivery(5, b"late"), Delivery(3, b"first"), Delivery(4, None), Delivery(3, b"second")])
    assert len(outbox) == 3
    assert outbox.next_due_ns == 3
    assert outbox.take(4) == [b"first", b"second"]
    assert outbox.take(4) == []
    assert outbox.take(5) == [b"late"]
    assert outbox.next_due_ns is None


def test_when_a_symbol_comes_then_its_bytes_are_no_control_bytes() -> None:
    inlet = Inlet()
    assert inlet.take(SYMBOL) == Symbol(7, 0, 3, 1)
    assert (inlet.meter.wire_bytes, inlet.meter.control_bytes, inlet.malformed) == (len(SYMBOL), 0, 0)


def test_when_a_farewell_comes_then_its_bytes_are_control_bytes() -> None:
    inlet = Inlet()
    inlet.take(SYMBOL)
    assert inlet.take(BYE) == Bye(7, Ending.OVER, "enough")
    assert inlet.meter.wire_bytes == len(SYMBOL) + len(BYE)
    assert inlet.meter.control_bytes == len(BYE)


def test_when_garbage_comes_then_it_is_counted_reported_and_no_frame() -> None:
    told: list[str] = []
    inlet = Inlet(on_malformed=told.append)
    assert inlet.take(SYMBOL[:-1] + b"?") is None
    assert told == ["checksum"]
    assert (inlet.meter.wire_bytes, inlet.meter.control_bytes, inlet.malformed) == (len(SYMBOL), 0, 1)
