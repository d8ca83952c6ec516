"""The one way in that both ends share."""

from __future__ import annotations

from channel.line.inlet import Inlet
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, Symbol
from channel.protocol.wire import encode

SYMBOL = encode(Symbol(7, 0, 3, 1))
BYE = encode(Bye(7, Ending.OVER, "enough"))


def test_when_a_symbol_comes_then_its_bytes_are_no_control_bytes() -> None:
    inlet = Inlet()
    assert inlet.take(SYMBOL) == Symbol(7, 0, 3, 1)
    assert (inlet.wire_bytes, inlet.control_bytes, inlet.malformed) == (len(SYMBOL), 0, 0)


def test_when_a_farewell_comes_then_its_bytes_are_control_bytes() -> None:
    inlet = Inlet()
    inlet.take(SYMBOL)
    assert inlet.take(BYE) == Bye(7, Ending.OVER, "enough")
    assert inlet.wire_bytes == len(SYMBOL) + len(BYE)
    assert inlet.control_bytes == len(BYE)


def test_when_garbage_comes_then_it_is_counted_told_and_no_frame() -> None:
    told: list[str] = []
    inlet = Inlet(on_malformed=told.append)
    assert inlet.take(SYMBOL[:-1] + b"?") is None
    assert told == ["checksum"]
    assert (inlet.wire_bytes, inlet.control_bytes, inlet.malformed) == (len(SYMBOL), 0, 1)
