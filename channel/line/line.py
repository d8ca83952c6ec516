"""One direction of a line as the flight experiences it: when, and whether, a message arrives.

On the virtual clock the transmitter's process asks the line of each direction; on a real clock each
sender asks its own and holds the message back until it is due.
"""

from __future__ import annotations

from typing import NamedTuple


class Delivery(NamedTuple):
    """One arrival. A message that is lost has an arrival too, without data: time passed."""

    arrival_ns: int
    data: bytes | None


class Line:
    """A clean line with a fixed delay for symbols and another for every other message."""

    def __init__(self, symbol_delay_ns: int = 0, delay_ns: int = 0) -> None:
        self._symbol_delay_ns = symbol_delay_ns
        self._delay_ns = delay_ns

    @property
    def longest_delay_ns(self) -> int:
        """Return how long a message may be under way."""
        return max(self._symbol_delay_ns, self._delay_ns)

    @property
    def at_once(self) -> bool:
        """Return whether every message arrives, as it is, when it is sent."""
        return type(self) is Line and self.longest_delay_ns == 0

    def carry(self, data: bytes, is_symbol: bool, now_ns: int) -> list[Delivery]:
        """Return the arrivals of a message put on the line at flight time `now_ns`."""
        delay = self._symbol_delay_ns if is_symbol else self._delay_ns
        return [Delivery(now_ns + delay, data)]
