"""The controller node of many rigs: one loop serves them all independently.

Every session has its own endpoint; this loop takes in what comes for all of them and keeps their
deadlines. What goes wrong in one ends that one: an exception closes it, and a transmitter that sends
more than its channel carries has the surplus dropped unread, so that it costs the others a few
microseconds a message.

Opening and closing a session reads and writes files, so the host does it on another thread; the loop
only picks up what is ready.
"""

from __future__ import annotations

import heapq
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Protocol

from channel.line.meters import LatenessMeter
from receiver.endpoint import ReceiverEndpoint

POLL_NS = 200_000_000
"""How often every service is asked whether its flight is over."""

PROBE_NS = 20_000_000
"""How often the loop looks how late it is."""

BATCH_MESSAGES_MAX = 64
"""Messages taken in a row before deadlines are looked at again."""

BURST_MESSAGES = 50
SURPLUS = 4.0
"""A session may send this many times its symbol rate, and this many messages at once, for control."""


class Hub(Protocol):
    """The line to all of the transmitters."""

    def receive(self, timeout_s: float) -> tuple[str, bytes] | None:
        """Return (session name, message), or None after `timeout_s` seconds."""

    def send(self, name: str, data: bytes) -> None:
        """Put a message on the line of one session."""


class Host(Protocol):
    """Opens and closes services. Its methods return at once."""

    def on_unserved(self, name: str, data: bytes) -> list[bytes]:
        """Take a message of a session that has no service; return the answers."""

    def ready(self) -> Iterable[tuple[str, Served]]:
        """Return the services that have become ready since the last call."""

    def ended(self, served: Served, error: Exception | None) -> None:
        """Take back a service whose flight is over; `error` says why if it did not end by itself."""


@dataclass(slots=True)
class Served:
    """One session in the loop."""

    name: str
    endpoint: ReceiverEndpoint
    peer_timeout_s: float
    messages_per_s: float | None
    """what it may send; None: as much as it likes, as on the virtual clock"""
    first: bytes
    """message that it was opened for"""
    dropped: int = 0
    """messages above its limit"""
    queued_ns: int | None = None
    """when the loop will look at it next, as the heap has it"""
    allowance: float = field(default=BURST_MESSAGES)
    allowed_ns: int = 0

    def may_send(self, now_ns: int) -> bool:
        """Return whether a message now is within what the session may send; count it if not."""
        if self.messages_per_s is None:
            return True
        earned = (now_ns - self.allowed_ns) * self.messages_per_s / 1e9
        self.allowed_ns = now_ns
        self.allowance = min(BURST_MESSAGES, self.allowance + earned)
        if self.allowance < 1.0:
            self.dropped += 1
            return False
        self.allowance -= 1.0
        return True


class ManyService:
    """The loop; see the module's text."""

    def __init__(self, hub: Hub, host: Host) -> None:
        self._hub = hub
        self._host = host
        self._served: dict[str, Served] = {}
        self._due: list[tuple[int, str]] = []
        self._touched: dict[str, Served] = {}
        self.lateness = LatenessMeter()
        """of the loop, looked at every `PROBE_NS`"""

    @property
    def served(self) -> tuple[Served, ...]:
        """Return the sessions that are open now; for other threads too."""
        return tuple(self._served.values())

    def run(self, should_stop: Callable[[], bool]) -> None:
        """Serve until asked to stop; flights that are still going on are then ended."""
        try:
            self._serve(should_stop)
        finally:
            for served in self.served:
                self._close(served, None)

    def _serve(self, should_stop: Callable[[], bool]) -> None:
        now_ns = time.monotonic_ns()
        probe_ns = now_ns + PROBE_NS
        poll_ns = now_ns + POLL_NS
        while not should_stop():
            self._take_in(self._earliest_ns(now_ns, probe_ns))
            now_ns = time.monotonic_ns()
            if now_ns >= probe_ns:
                self.lateness.add(now_ns - probe_ns)
                probe_ns += -(-(now_ns - probe_ns + 1) // PROBE_NS) * PROBE_NS
            self._keep_deadlines(now_ns)
            self._open_ready(now_ns)
            if now_ns >= poll_ns:
                poll_ns = now_ns + POLL_NS
                for served in self.served:
                    self._guarded(served, self._check, now_ns)
            touched, self._touched = self._touched, {}
            for served in touched.values():
                self._guarded(served, _rest)

    def _take_in(self, due_ns: int) -> None:
        """Take messages until none is left or a batch is full; wait for the first one."""
        item = self._hub.receive(max(0, due_ns - time.monotonic_ns()) / 1e9)
        for _ in range(BATCH_MESSAGES_MAX):
            if item is None:
                return
            self._dispatch(*item)
            item = self._hub.receive(0.0)
        if item is not None:
            self._dispatch(*item)

    def _dispatch(self, name: str, data: bytes) -> None:
        now_ns = time.monotonic_ns()
        served = self._served.get(name)
        if served is None:
            for message in self._host.on_unserved(name, data):
                self._hub.send(name, message)
        elif served.may_send(now_ns):
            self._guarded(served, self._give, now_ns, data)

    def _give(self, served: Served, now_ns: int, data: bytes | None = None) -> None:
        for message in served.endpoint.take(data, now_ns):
            self._hub.send(served.name, message)
        self._touched[served.name] = served
        due_ns = served.endpoint.next_due_ns(now_ns)
        if due_ns is not None and (served.queued_ns is None or due_ns < served.queued_ns):
            served.queued_ns = due_ns
            heapq.heappush(self._due, (due_ns, served.name))
        # A deadline that has moved on stays in the heap until it comes to its top.

    def _earliest_ns(self, now_ns: int, latest_ns: int) -> int:
        """Return the earliest deadline, `latest_ns` at the latest.

        Almost every deadline moves on, with the symbol that it waited for. These are put back here:
        woken for each of them, the loop would wait for the interpreter twice per symbol.
        """
        while self._due:
            queued_ns, name = self._due[0]
            if queued_ns >= latest_ns:
                break
            served = self._served.get(name)
            if served is None or served.queued_ns != queued_ns:
                heapq.heappop(self._due)
                continue
            due_ns = served.endpoint.next_due_ns(now_ns)
            if due_ns is not None and due_ns <= queued_ns:
                return queued_ns
            served.queued_ns = due_ns
            if due_ns is None:
                heapq.heappop(self._due)
            else:
                heapq.heapreplace(self._due, (due_ns, name))
        return latest_ns

    def _keep_deadlines(self, now_ns: int) -> None:
        while self._due and self._due[0][0] <= now_ns:
            queued_ns, name = heapq.heappop(self._due)
            served = self._served.get(name)
            if served is not None and served.queued_ns == queued_ns:
                served.queued_ns = None
                self._guarded(served, self._give, now_ns)

    def _open_ready(self, now_ns: int) -> None:
        for name, served in self._host.ready():
            served.allowed_ns = now_ns
            self._served[name] = served
            self._guarded(served, self._give, now_ns, served.first)

    def _check(self, served: Served, now_ns: int) -> None:
        if served.endpoint.over(now_ns, served.peer_timeout_s):
            self._close(served, None)

    def _guarded(self, served: Served, action: Callable[..., None], *arguments: object) -> None:
        """Do something for one session; an exception ends only that session."""
        try:
            action(served, *arguments)
        except Exception as error:  # of any kind: the others' motors depend on this loop
            self._close(served, error)

    def _close(self, served: Served, error: Exception | None) -> None:
        if self._served.pop(served.name, None) is not None:
            self._touched.pop(served.name, None)
            self._host.ended(served, error)


def _rest(served: Served) -> None:
    served.endpoint.session.flush_records()
