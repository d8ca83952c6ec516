"""Asks the page's server for things as any program can, with the standard library alone.

As a program it becomes another user first, and tells on standard output what it got.
"""

from __future__ import annotations

import http.client
import json
import os
import socket
import sys
from pathlib import Path

POLLING = "_nicegui_ws/socket.io/?EIO=4&transport=polling"
SOCKET_IO = "_nicegui_ws/socket.io/?EIO=4&transport=websocket"
UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec_WebSocket_Version": "13",
    "Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ==",
}


class Answer:
    """What the server answered."""

    def __init__(self, raw: http.client.HTTPResponse) -> None:
        self.status = raw.status
        self.headers = {name.lower(): value for name, value in raw.getheaders()}
        self.text = "" if raw.status == 101 else raw.read().decode()


def ask(port: int, path: str, method: str = "GET", **headers: str) -> Answer:
    """Ask for a path; header names have _ for -. Origin and Host are sent as they are given."""
    sent = {name.replace("_", "-"): value for name, value in headers.items()}
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10.0)
    try:
        connection.request(method, path, headers=sent)
        return Answer(connection.getresponse())
    finally:
        connection.close()


def open_socket(port: int, path: str, **headers: str) -> Answer:
    """Ask for a WebSocket; status 101 is one that was opened."""
    return ask(port, path, **UPGRADE, **headers)


def enter(port: int, key: str) -> tuple[str, str]:
    """Exchange a secret for a cookie; return (path of the page, Cookie header)."""
    cookie = ask(port, f"/?key={key}").headers["set-cookie"]
    value, path = cookie.split("; ")[:2]
    return path.removeprefix("Path="), value


def everything(port: int, path: str, cookie: str) -> dict[str, int]:
    """Ask for all that there is, as the page itself would; return the status of each."""
    own = {"Origin": f"http://127.0.0.1:{port}", "Cookie": cookie}
    return {
        "page": ask(port, path, Cookie=cookie).status,
        "script": ask(port, f"{path}view/view.js", Cookie=cookie).status,
        "polling": ask(port, path + POLLING, Cookie=cookie).status,
        "posting": ask(port, f"{path}{POLLING}&sid=none", "POST", **own).status,
        "stream": open_socket(port, f"{path}stream", **own).status,
        "socket.io": open_socket(port, path + SOCKET_IO, **own).status,
    }


def found_in_sight(secret: str) -> list[str]:
    """Return the processes whose command line or environment shows this to the present user."""
    found = []
    for name in ("cmdline", "environ"):
        for path in Path("/proc").glob(f"[0-9]*/{name}"):
            try:
                if secret.encode() in path.read_bytes() and path.parent.name != str(os.getpid()):
                    found.append(str(path))
            except OSError:
                continue
    return found


def _reaches(path: str) -> str:
    try:
        with socket.socket(socket.AF_UNIX) as one:
            one.connect(path)
    except OSError as error:
        return type(error).__name__
    return "connected"


def _as_another_user() -> None:
    given = json.load(sys.stdin)
    "".encode("idna")  # what is imported late cannot be read any more as somebody else
    os.setgroups([])
    os.setgid(given["uid"])
    os.setuid(given["uid"])
    port, key, path = given["port"], given["key"], given["path"]
    without = {
        "/": everything(port, "/", ""),
        "the page's path": everything(port, path, ""),
        "the page's path and a guess": everything(port, path, f"tenbaud={'0' * len(key)}"),
    }
    told = {
        "uid": os.getuid(),
        "without": without,
        "sockets": [_reaches(one) for one in given["sockets"]],
        "in sight": found_in_sight(key),
        "with": everything(port, *enter(port, key)),
    }
    json.dump(told, sys.stdout)


if __name__ == "__main__":
    _as_another_user()
