"""The course of a flight, the same on either clock: greet, fly tick by tick, finish.

Only the passing of time differs (`transmitter.loops.real`, `transmitter.loops.virtual`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from channel.line.line import Delivery
from channel.protocol.endings import End
from transmitter.endpoint import TransmitterEndpoint


class Flight(ABC):
    """Flies an endpoint; times are flight times."""

    def __init__(self, endpoint: TransmitterEndpoint, should_stop: Callable[[], bool]) -> None:
        self.endpoint = endpoint
        self._should_stop = should_stop

    def greet(self) -> None:
        """Ask for a session until there is one, a refusal, or no sense in going on."""
        while self._needs_answer() and self._may_ask():
            self._send(self.endpoint.hello(self._now_ns()))
            self._await_answer()

    def run(self, ticks: int) -> int:
        """Fly `ticks` ticks, or to the end of the rig or the safe voltage; return the tick reached."""
        self.begin(ticks)
        while self.step():
            pass
        return self.endpoint.tick

    def begin(self, ticks: int) -> None:
        """Begin a flight of `ticks` ticks, for a caller that steps it."""
        self.endpoint.begin(ticks)
        self._begin()

    def step(self) -> bool:
        """Fly one tick; return whether there was one, so that the flight goes on."""
        endpoint = self.endpoint
        due_ns = endpoint.next_due_ns
        if due_ns is None:
            return False
        self._wait_until(due_ns)
        if self._should_stop():
            endpoint.node.stop()
        messages = endpoint.begin_tick(self._now_ns())
        if messages is None:
            return False
        self._send(messages)
        endpoint.end_tick()
        self._rest()
        return True

    def finish(self, farewell: Callable[[], End]) -> None:
        """Let the last echoes come in, end the session on both sides, take a real rig's motors down.

        `farewell` gives the ending for the receiver once the echoes are in.
        """
        self.endpoint.node.conclude(self.endpoint.tick)
        self._linger()
        self.endpoint.node.flush_records()
        self.leave(farewell())
        self._land()

    def leave(self, end: End) -> None:
        """End the session on both sides at once; before the first tick nothing else is to be done."""
        for message in self.endpoint.farewell(end):
            self._send_past_line(message)

    def _needs_answer(self) -> bool:
        """Return whether there is no answer to begin on."""
        return self.endpoint.greeting

    @abstractmethod
    def _begin(self) -> None:
        """Begin the flight's time at the first tick."""

    @abstractmethod
    def _rest(self) -> None:
        """Do the work that can wait until a tick is over."""

    @abstractmethod
    def _land(self) -> None:
        """Take the motors to their safe voltage, where the rig asks for it."""

    @abstractmethod
    def _now_ns(self) -> int:
        """Return the time."""

    @abstractmethod
    def _may_ask(self) -> bool:
        """Return whether a session may be asked for once more; LinkLost when nobody will answer."""

    @abstractmethod
    def _await_answer(self) -> None:
        """Take in messages until it is time to ask again."""

    @abstractmethod
    def _wait_until(self, due_ns: int) -> None:
        """Take in messages until a tick is due."""

    @abstractmethod
    def _linger(self) -> None:
        """Take in messages until no echo can come any more."""

    @abstractmethod
    def _send(self, messages: list[Delivery]) -> None:
        """Put messages on the line."""

    @abstractmethod
    def _send_past_line(self, message: bytes) -> None:
        """Hand a message to the receiver without the line's delays and faults."""
