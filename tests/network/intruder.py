"""What somebody does who has no business here. Run as a script, on a machine of the test:

    python -m tests.network.intruder handshake HOST CERTIFICATE KEY     ("-" for none)
    python -m tests.network.intruder garbage HOST COUNT PER_SECOND
    python -m tests.network.intruder insider HOST KEYS TRANSMITTER RECEIVER

It prints one JSON line: what it reached.
"""

from __future__ import annotations

import contextlib
import json
import random
import socket
import ssl
import sys
import time
from pathlib import Path

from channel.protocol.endings import Ending

PORT = 7447
GREETINGS = (
    b"GET / HTTP/1.0\r\n\r\n",
    b"SSH-2.0-scanner\r\n",
    b"\x00" * 64,
    b"\x16\x03\x01\xff\xff" + b"\x41" * 200,
    b"",
)


def handshake(host: str, certificate: str, key: str) -> dict[str, object]:
    """Try TLS with this certificate or none, and whether a byte comes back."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    if certificate != "-":
        context.load_cert_chain(certificate, key)
    try:
        with (
            socket.create_connection((host, PORT), 5.0) as plain,
            context.wrap_socket(plain) as line,
        ):
            line.settimeout(1.0)
            # In TLS 1.3 the client has finished before its certificate is looked at.
            return {"refused": line.recv(1) == b""}
    except TimeoutError:
        # Taken in: the other side waits for us to go on.
        return {"refused": False}
    except OSError as error:
        return {"refused": True, "why": str(error)}


def garbage(host: str, count: str, per_second: str) -> dict[str, object]:
    """Connect so often, say nonsense, and leave."""
    chooser = random.Random(1)
    reached = 0
    started = time.monotonic()
    for number in range(int(count)):
        with contextlib.suppress(OSError), socket.create_connection((host, PORT), 5.0) as line:
            reached += 1
            line.sendall(GREETINGS[number % len(GREETINGS)] + chooser.randbytes(number % 50))
        time.sleep(max(0.0, started + (number + 1) / float(per_second) - time.monotonic()))
    return {"reached": reached}


def insider(host: str, keys: str, transmitter: str, receiver: str) -> dict[str, object]:
    """With a valid certificate and no invitation: listen to the flight, and try to take part in it."""
    from channel.links.base import Role
    from channel.links.security import Invited, Part, Security
    from channel.links.zenoh.link import ZenohLink
    from channel.protocol.frames import Bye, Claim, Commands, Echo, Hello, Symbol, Unknown
    from channel.protocol.wire import encode
    from tenbaud.keys.store import read_node

    heard = 0
    saw_a_peer = False
    nothing = Hello(1, "0", bytes(16), bytes(8))
    echo = Echo(10, 1, 0, (5000, -5000) * 10)
    frames = (
        nothing,
        Symbol(1, 0, 10, 1),
        Unknown(1, 0),
        Claim(1, 0, 2),
        Commands(1, 0, (echo,)),
        Bye(1, Ending.OVER, "intruder"),
    )
    roles: tuple[tuple[Role, Part, str], ...] = (
        ("transmitter", "receiver", receiver),
        ("receiver", "transmitter", transmitter),
    )
    for role, other, name in roles:
        invited = (Invited(name, other, "helicopter"),)
        security = Security(read_node(Path(keys)).credentials, invited)
        with ZenohLink(role, "helicopter", connect=(f"tls/{host}:{PORT}",), security=security) as link:
            for _ in range(10):
                for frame in frames:
                    link.send(encode(frame))
                heard += link.receive(0.1) is not None
                saw_a_peer = saw_a_peer or link.peer_present()
    return {"heard": heard, "saw_a_peer": saw_a_peer}


if __name__ == "__main__":
    deeds = {"handshake": handshake, "garbage": garbage, "insider": insider}
    print(json.dumps(deeds[sys.argv[1]](*sys.argv[2:])))
