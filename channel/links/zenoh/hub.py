"""One end of many sessions over one Zenoh session: the receiver of many rigs.

Sessions differ by their names, which are part of the keys (`channel.links.zenoh.link`). One
channel takes in what comes for all of them, in order of arrival; it is short, so that a sender that
floods it is held up in its own line before the others have to wait long.
"""

from __future__ import annotations

import re
import secrets
from contextlib import ExitStack
from typing import Unpack

import zenoh

from channel.errors import LinkError
from channel.links.base import LinkCounts
from channel.links.security import KEY_ROOT
from channel.links.zenoh.config import NodeOptions, close_session, is_session_name, open_node
from channel.links.zenoh.gate import Gate
from channel.links.zenoh.link import ChannelInbox

CHANNEL_MESSAGES_MAX = 1024

_PATTERN = re.compile(r"(?:[A-Za-z0-9_.-]+|\*\*?)(?:/(?:[A-Za-z0-9_.-]+|\*\*?))*")


def is_session_pattern(pattern: str) -> bool:
    """Return whether this is a session's name, or one with `*` and `**` for parts of it."""
    return bool(_PATTERN.fullmatch(pattern))


class ZenohHub:
    """The receiving end of every session whose name matches `pattern`, such as `rig/*`.

    In a pattern `*` stands for one part of a name and `**` for any number of them. Raises LinkError
    for a pattern or an endpoint that cannot be used; the addresses are those of `open_node`.
    """

    name = "zenoh"

    def __init__(self, pattern: str, **node: Unpack[NodeOptions]) -> None:
        if not is_session_pattern(pattern):
            raise LinkError(
                f"sessions {pattern!r}: write names as in rig/7, with * for any one part, as in rig/*"
            )
        self.counts = LinkCounts()
        self._joined: dict[str, tuple[zenoh.Publisher, zenoh.LivelinessToken]] = {}
        self._names: dict[str, str] = {}
        """session names by the keys of those joined, which nearly all messages have"""
        self._parts = ExitStack()
        self._session = open_node(**node)
        self._parts.callback(close_session, self._session)
        try:
            gate = Gate(self._session, node.get("security"), self.counts.refused)
            self._parts.callback(gate.close)
            self._inbox = ChannelInbox(
                self._session, f"{KEY_ROOT}/{pattern}/up/*", CHANNEL_MESSAGES_MAX
            )
            self._parts.callback(self._inbox.close)
        except BaseException:
            self.close()
            raise

    def receive(self, timeout_s: float) -> tuple[str, bytes] | None:
        """Return (session name, message), or None after `timeout_s` seconds (0: only what is there).

        None too, at once, for a message under a name that no session can have: it is counted.
        """
        found = self._inbox.sample(timeout_s)
        if found is None:
            return None
        sample, data = found
        key = str(sample.key_expr)
        name = self._names.get(key) or key.removeprefix(f"{KEY_ROOT}/").rpartition("/up/")[0]
        # The key is the sender's choice, and a name leads to a configuration and a folder.
        if key not in self._names and not is_session_name(name):
            self.counts.dropped["no session's name"] += 1
            return None
        self.counts.messages_in += 1
        self.counts.bytes_in += len(data)
        return name, data

    def wake(self) -> None:
        """End the wait of the thread that receives; for other threads."""
        self._inbox.interrupt()

    def join(self, name: str) -> None:
        """Show the transmitter of this session that its receiver is there."""
        if name in self._joined:
            return
        # A transmitter that takes nothing in must not hold up the commands of the others: what does
        # not fit is dropped, and the next command frame repeats it.
        publisher = self._session.declare_publisher(
            _command_key(name),
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
            reliability=zenoh.Reliability.RELIABLE,
        )
        token = self._session.liveliness().declare_token(
            f"{KEY_ROOT}/{name}/alive/receiver/{secrets.token_hex(4)}"
        )
        self._joined[name] = (publisher, token)
        self._names |= dict.fromkeys(_inbound_keys(name), name)

    def leave(self, name: str) -> None:
        """Undo `join`."""
        joined = self._joined.pop(name, None)
        if joined is not None:
            for key in _inbound_keys(name):
                self._names.pop(key, None)
            publisher, token = joined
            token.undeclare()
            publisher.undeclare()

    def send(self, name: str, data: bytes) -> None:
        """Publish one message for a session, joined or not; one that cannot leave is counted."""
        joined = self._joined.get(name)
        try:
            if joined is not None:
                joined[0].put(data)
            else:
                self._session.put(
                    _command_key(name), data, congestion_control=zenoh.CongestionControl.DROP
                )
        except zenoh.ZError:
            self.counts.dropped["could not send"] += 1
            return
        self.counts.messages_out += 1
        self.counts.bytes_out += len(data)

    def close(self) -> None:
        """Close the Zenoh session; what was sent before is still delivered."""
        self._parts.close()

    def __enter__(self) -> ZenohHub:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _inbound_keys(name: str) -> tuple[str, str]:
    return f"{KEY_ROOT}/{name}/up/symbol", f"{KEY_ROOT}/{name}/up/control"


def _command_key(name: str) -> str:
    return f"{KEY_ROOT}/{name}/down/command"
