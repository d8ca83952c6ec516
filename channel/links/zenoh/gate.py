"""Counts the connections that a Zenoh node refuses, and reports some of them.

Two kinds are refused. A connection whose handshake fails (no certificate, another authority's, an
expired one, no TLS at all) never becomes a link; Zenoh says so in its log only, so the log is read. A
node with a certificate of the authority but without an invitation does get a link, over which the
access rules let nothing pass in either direction; it is seen by its link.
"""

from __future__ import annotations

import os
import re
import sys
import threading
from collections import Counter
from contextlib import suppress
from queue import SimpleQueue
from typing import Self, TextIO

import zenoh

from channel.links.security import Security

_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_REFUSAL = re.compile(r"WARN.*zenoh_link_tls::unicast: (?P<text>.*?)(?:\. Hint:.*)?$")
REASONS = (
    ("no certificate", ("peer sent no certificates",)),
    ("another authority's certificate", ("UnknownIssuer", "UnknownCA", "BadSignature")),
    ("expired certificate", ("certificate expired", "CertificateExpired")),
    ("certificate not valid yet", ("certificate not valid yet", "NotValidYet")),
    ("wrong certificate", ("invalid peer certificate", "BadCertificate", "CertificateUnknown")),
    ("no TLS", ("corrupt message", "InvalidContentType", "handshake eof", "unexpected message")),
    ("gave up the handshake", ("timed out", "deadline has elapsed", "reset by peer", "Broken pipe")),
)
OTHER_REASON = "failed handshake"
UNINVITED = "uninvited certificate"
LAST_WORD_S = 1.0
"""How long a session that closes waits for a terminal."""


def reason_of(text: str) -> str:
    """Return in which of our words a handshake failed."""
    for reason, signs in REASONS:
        if any(sign in text for sign in signs):
            return reason
    return OTHER_REASON


class Gate:
    """Counts the links of nodes that were not invited, for as long as the session is open.

    A separate thread reports them: one of Zenoh's carries symbols, and a terminal may block.
    """

    def __init__(
        self, session: zenoh.Session, security: Security | None, refused: Counter[str]
    ) -> None:
        self._invited = {one.name for one in security.invited} if security is not None else set()
        self._refused = refused
        self._listener = None
        self._unreported: SimpleQueue[tuple[str, int] | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._report_all, name="zenoh gate", daemon=True)
        if security is not None:
            # Runs on a thread of Zenoh and calls nothing of Zenoh.
            handler = zenoh.handlers.Callback(self._on_link, indirect=False)
            self._listener = session.info.declare_link_events_listener(handler, history=True)
            self._thread.start()

    def close(self) -> None:
        """Stop listening; to be called before the session is closed."""
        if self._listener is not None:
            self._listener.undeclare()
            self._listener = None
            self._unreported.put(None)
            self._thread.join(LAST_WORD_S)

    def _on_link(self, event: zenoh.LinkEvent) -> None:
        name = event.link.auth_identifier
        if event.kind == zenoh.SampleKind.PUT and name not in self._invited:
            reason = f"{UNINVITED} {name}"
            self._refused[reason] += 1
            if _is_reported(self._refused[reason]):
                self._unreported.put((reason, self._refused[reason]))

    def _report_all(self) -> None:
        while (item := self._unreported.get()) is not None:
            # A terminal that has gone is no reason to stop.
            with suppress(OSError):
                _say(*item)


class HandshakeLog:
    """Within a `with`, failed TLS handshakes of this process are counted in `refused`.

    Zenoh's log goes to standard output. So for this time the process' standard output is a pipe that a
    thread reads, and Python's own `sys.stdout` writes to where it led before. Whatever else Zenoh
    logs (RUST_LOG) goes to standard error. Once per process: Zenoh sets its log up only once.
    """

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()

    def __enter__(self) -> Self:
        sys.stdout.flush()
        self._python_stdout = sys.stdout
        self._saved = os.dup(1)
        reading, writing = os.pipe()
        os.dup2(writing, 1)
        os.close(writing)
        sys.stdout = os.fdopen(os.dup(self._saved), "w", encoding="utf-8", buffering=1)
        self._lines = os.fdopen(reading, encoding="utf-8", errors="replace")
        self._thread = threading.Thread(target=self._read, name="zenoh log", daemon=True)
        self._thread.start()
        zenoh.init_log_from_env_or("off,zenoh_link_tls=warn")
        return self

    def __exit__(self, *_: object) -> None:
        self._own_stdout: TextIO = sys.stdout
        self._own_stdout.flush()
        sys.stdout = self._python_stdout
        # The pipe's last writer goes, and the thread comes to its end.
        os.dup2(self._saved, 1)
        os.close(self._saved)
        self._thread.join(LAST_WORD_S)
        self._lines.close()
        self._own_stdout.close()

    def _read(self) -> None:
        for line in self._lines:
            # A pipe that nobody reads fills up, and then holds up Zenoh and with it the flight: a
            # terminal that has gone is no reason to stop.
            with suppress(OSError):
                self._take(line)

    def _take(self, line: str) -> None:
        found = _REFUSAL.search(_COLOURS.sub("", line.rstrip()))
        if found is None:
            sys.stderr.write(line)
            return
        reason = reason_of(found["text"])
        self.refused[reason] += 1
        if _is_reported(self.refused[reason]):
            _say(reason, self.refused[reason])


def _is_reported(count: int) -> bool:
    """Return whether it is the first time, or the count has another digit."""
    return str(count).rstrip("0") == "1"


def _say(reason: str, count: int) -> None:
    sys.stderr.write(f"tenbaud: turned a connection away: {reason} ({count} so far)\n")
