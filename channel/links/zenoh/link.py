"""The link over Zenoh: reliable, blocking, express, and nothing found by itself.

Zenoh's defaults bind every interface and look around by multicast; here both are off and the
endpoints are given. A reliable `put` to an absent peer is lost in silence, so a liveliness token
tells who is there; its key carries the incarnation, since a half-open link would hide a restart.
Keys, `NAME` being the session's name:

    tenbaud/NAME/up/symbol      the paid path          transmitter -> receiver
    tenbaud/NAME/up/control     everything else        transmitter -> receiver
    tenbaud/NAME/down/command   all of the downlink    receiver -> transmitter
    tenbaud/NAME/alive/ROLE/INCARNATION                liveliness
"""

from __future__ import annotations

import secrets
from contextlib import ExitStack
from typing import Unpack

import zenoh

from channel.errors import LinkError
from channel.links.base import Link, Role
from channel.links.security import KEY_ROOT
from channel.links.zenoh.config import NodeOptions, close_session, is_session_name, open_node
from channel.links.zenoh.gate import Gate
from channel.links.zenoh.inbox import ChannelInbox


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
