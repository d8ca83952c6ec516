"""The log of failed handshakes: read to its end whatever becomes of the terminal."""

from __future__ import annotations

import os

import pytest

from channel.links.zenoh import gate

LINE = b"WARN zenoh_link_tls::unicast: peer sent no certificates. Hint: none\n"


def test_when_the_terminal_has_gone_then_the_log_is_read_and_counted_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def gone(_reason: str, _count: int) -> None:
        raise BrokenPipeError

    monkeypatch.setattr(gate, "_say", gone)
    with gate.HandshakeLog() as log:
        for _ in range(3):
            os.write(1, LINE)
    assert log.refused == {"no certificate": 3}
