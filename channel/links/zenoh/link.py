"""The link over Zenoh: reliable, blocking, express, without discovery.

Zenoh's defaults bind every interface and look around by multicast; here both are off and the
endpoints are given. A reliable `put` to an absent peer is lost in silence, so a liveliness token
tells who is there; its key carries the incarnation, since a half-open link would hide a restart.
Keys, `NAME` being the session's name:

    tenbaud/NAME/up/symbol      the paid path          transmitter -> receiver
    tenbaud/NAME/up/control     everything else        transmitter -> receiver
    tenbaud/NAME/down/command   all of the downlink    receiver -> transmitter
    tenbaud/NAME/alive/ROLE/INCARNATION                liveliness

A loop takes its messages from Zenoh's channel itself (`ChannelInbox`): handing them over in a callback
costs a change of threads per message, some 90 microseconds in a round trip. That channel cannot wait
with a deadline, so a second thread sleeps until the deadline and then puts a message of its own into
the channel. It is left alone for as long as messages come in time: a deadline that moves on is noticed
when the old one is reached, and only one that moves forward wakes the thread up.

That message contains a secret, so that no outside process can send one: a flood of them would be passed
over without end. A full channel holds up the thread of Zenoh that fills it, and with it the sender.
"""

from __future__ import annotations

import math
import secrets
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from typing import Unpack

import zenoh

from channel.errors import LinkError
from channel.links.base import Link, Role
from channel.links.security import KEY_ROOT
from channel.links.zenoh.config import NodeOptions, close_session, is_session_name, open_node
from channel.links.zenoh.gate import Gate


class ZenohLink(Link):
    """One end of a session over Zenoh.

    Where it listens and connects, and who is let in: see `open_node`. One end listens, the other
    connects; either may start first.
    `best_effort`: a symbol that the network cannot take at once is dropped, an erasure, instead of
    keeping the loop waiting; all else stays reliable. Raises LinkError for a name or endpoint that
    cannot be used.
    """

    name = "zenoh"

    def __init__(
        self, role: Role, session_name: str, *, best_effort: bool = False, **node: Unpack[NodeOptions]
    ) -> None:
        super().__init__()
        if not is_session_name(session_name):
            raise LinkError(
                f"session name {session_name!r}: letters, digits, '_', '-', '.', and '/' between "
                "parts, none of which is '.' or '..'"
            )
        self._peers: set[str] = set()
        self._parts = ExitStack()
        self._session = open_node(**node)
        self._parts.callback(close_session, self._session)
        try:
            gate = Gate(self._session, node.get("security"), self.counts.refused)
            self._parts.callback(gate.close)
            self._declare(role, f"{KEY_ROOT}/{session_name}", best_effort)
        except BaseException:
            self.close()
            raise

    def _declare(self, role: Role, root: str, best_effort: bool) -> None:
        inbound, other = ("down", "receiver") if role == "transmitter" else ("up", "transmitter")
        self._inbox = ChannelInbox(self._session, f"{root}/{inbound}/*")
        self._parts.callback(self._inbox.close)
        alive = self._session.liveliness()
        self._watch = alive.declare_subscriber(
            f"{root}/alive/{other}/*",
            zenoh.handlers.Callback(self._on_alive, indirect=False),
            history=True,
        )
        outbound = ("up/symbol", "up/control") if role == "transmitter" else ("down/command",) * 2
        self._symbols, self._control = (
            self._session.declare_publisher(
                f"{root}/{key}",
                congestion_control=zenoh.CongestionControl.DROP
                if may_drop
                else zenoh.CongestionControl.BLOCK,
                priority=zenoh.Priority.REAL_TIME,
                express=True,
                reliability=zenoh.Reliability.BEST_EFFORT if may_drop else zenoh.Reliability.RELIABLE,
            )
            for key, may_drop in zip(outbound, (best_effort, False), strict=True)
        )
        # Declared last: who sees the token can be heard already.
        self._token = alive.declare_token(f"{root}/alive/{role}/{secrets.token_hex(4)}")

    def send(self, data: bytes) -> None:
        """Publish one message; it is lost in silence when the peer is not there."""
        try:
            (self._symbols if self.wire.is_symbol(data) else self._control).put(data)
        except zenoh.ZError as error:
            raise LinkError(f"Zenoh could not send: {error}") from error
        self.counts.messages_out += 1
        self.counts.bytes_out += len(data)

    def receive(self, timeout_s: float) -> bytes | None:
        data = self._inbox.get(timeout_s)
        if data is None:
            return None
        self.counts.messages_in += 1
        self.counts.bytes_in += len(data)
        return data

    def peer_present(self) -> bool:
        """Return whether a liveliness token of the other end stands."""
        return bool(self._peers)

    def close(self) -> None:
        """Close the Zenoh session; what was sent before is still delivered."""
        self._parts.close()

    def _on_alive(self, sample: zenoh.Sample) -> None:
        # On a thread of Zenoh; calls nothing of Zenoh.
        key = str(sample.key_expr)
        if sample.kind == zenoh.SampleKind.PUT:
            self._peers.add(key)
        else:
            self._peers.discard(key)


CHANNEL_MESSAGES_MAX = 10_000


class ChannelInbox:
    """Messages of a key expression, in order. Used by one thread; any thread may `wake` it."""

    def __init__(
        self, session: zenoh.Session, key: str, messages_max: int = CHANNEL_MESSAGES_MAX
    ) -> None:
        self._session = session
        self._wake_key = key.replace("*", "wake")
        self._wake_payload = secrets.token_bytes(16)
        self._subscriber = session.declare_subscriber(key, zenoh.handlers.FifoChannel(messages_max))
        self._interrupted = False
        self._waker = _Waker(self.wake)

    def get(self, timeout_s: float) -> bytes | None:
        """Return the next message, or None after `timeout_s` seconds (0: only what is there)."""
        found = self.sample(timeout_s)
        return None if found is None else found[1]

    def sample(self, timeout_s: float) -> tuple[zenoh.Sample, bytes] | None:
        """Return the next message as Zenoh has it, with its key, and its bytes."""
        deadline_s = 0.0
        while (sample := self._subscriber.try_recv()) is not None:
            if (data := sample.payload.to_bytes()) != self._wake_payload:
                return sample, data
        while timeout_s > 0.0 and not self._interrupted:
            deadline_s = deadline_s or time.monotonic() + timeout_s
            self._waker.arm(deadline_s)
            sample = self._subscriber.recv()
            if (data := sample.payload.to_bytes()) != self._wake_payload:
                return sample, data
            if time.monotonic() >= deadline_s:
                break
        self._interrupted = self._interrupted and timeout_s <= 0.0
        return None

    def interrupt(self) -> None:
        """End the wait that is going on, or the next one, as if its deadline were reached."""
        self._interrupted = True
        self.wake()

    def wake(self) -> None:
        """Let the loop that waits look at its deadline; it goes on waiting if that is not reached."""
        self._session.put(
            self._wake_key, self._wake_payload, allowed_destination=zenoh.Locality.SESSION_LOCAL
        )

    def close(self) -> None:
        """Stop taking messages. A channel left full would hang the closing session."""
        # First, for a full channel also holds up the thread that wakes, which is then waited for.
        self._subscriber.undeclare()
        self._waker.close()


class _Waker:
    """Calls `wake` at the last deadline that it was armed with."""

    def __init__(self, wake: Callable[[], None]) -> None:
        self._wake = wake
        self._armed: tuple[float] = (math.inf,)
        self._asleep_until_s = math.inf
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="zenoh-wake", daemon=True)
        self._thread.start()

    def arm(self, deadline_s: float) -> None:
        """Set the deadline, on the monotonic clock, in place of the one before."""
        self._armed = (deadline_s,)
        if deadline_s < self._asleep_until_s:
            self._notify()

    def close(self) -> None:
        self._closed = True
        self._notify()
        self._thread.join()

    def _notify(self) -> None:
        with self._changed:
            self._changed.notify()

    def _run(self) -> None:
        done: tuple[float] | None = None
        while not self._closed:
            armed = self._armed
            if armed is not done and armed[0] <= time.monotonic():
                done = armed
                self._wake()
            with self._changed:
                # Whoever arms from here on finds a later time and notifies, which has to wait for
                # the lock, hence for this thread to sleep.
                self._asleep_until_s = math.inf
                armed = self._armed
                until_s = math.inf if armed is done else armed[0]
                self._asleep_until_s = until_s
                if not self._closed:
                    left_s = until_s - time.monotonic()
                    self._changed.wait(None if left_s == math.inf else max(0.0, left_s))
