"""The log of failed handshakes: read to its end whatever becomes of the terminal."""

from __future__ import annotations

import os

from channel.links.zenoh.gate import HandshakeLog

LINE = b"WARN zenoh_link_tls::unicast: peer sent no certificates. Hint: none\n"


def test_when_the_terminal_has_gone_then_the_log_is_read_and_counted_on() -> None:
    def gone(_reason: str, _count: int) -> None:
        raise BrokenPipeError

    with HandshakeLog(gone) as log:
        for _ in range(3):
            os.write(1, LINE)
    assert log.refused == {"no certificate": 3}
