"""The page's server: NiceGUI for the page and its controls, one stream of telemetry beside it.

It listens on this machine unless told otherwise, answers only to its own names, and asks nothing of
the internet: every script, style and font comes from the installed packages.
"""

from __future__ import annotations

import asyncio
import socket
import sys
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import urlopen

from channel.errors import TenbaudError
from channel.links.endpoints import is_loopback
from tenbaud.view.board import Board
from tenbaud.view.feed import Feed

STREAM_PERIOD_S = 0.05
IDLE_PERIOD_S = 0.5
FIRST_LOOKS = 100
EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""Hosts that stand for every address of this machine, and by which one it finds itself there."""
STATIC = Path(__file__).parent / "static"


class PageUnavailable(TenbaudError):
    """The page cannot be served; the text says what to do."""


@dataclass(frozen=True, slots=True)
class Address:
    """Where the page is served."""

    host: str = "127.0.0.1"
    port: int = 8710
    insecure: bool = False

    @property
    def is_local(self) -> bool:
        """Return whether only this machine can reach it."""
        return is_loopback(f"tcp/{self.host}:{self.port}")

    @property
    def url(self) -> str:
        """Return what to type into a browser on this machine."""
        return f"http://{self.name}:{self.port}"

    @property
    def name(self) -> str:
        """Return this machine's name for itself in a URL: one of IPv6 stands in brackets."""
        host = EVERYWHERE.get(self.host, self.host)
        return f"[{host}]" if ":" in host else host

    def check(self) -> None:
        """Refuse an address that is taken, or that others can reach unless told to allow it."""
        if not self.is_local and not self.insecure:
            raise PageUnavailable(
                f"{self.host} is reachable from other machines, and the page has no password: whoever "
                "opens it sees the flight, and steers it if it takes commands. On a network that you "
                "trust with that, add --insecure"
            )
        try:
            with _socket_for(self.host) as probe:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((self.host, self.port))
        except OSError as error:
            raise PageUnavailable(
                f"the page cannot be served at {self.name}:{self.port}: {error.strerror}; give another "
                "--port (--view-port of `tenbaud demo`), or 0 for any free one"
            ) from error


def require_nicegui() -> None:
    """Raise PageUnavailable, with what to install, when the page's extra is missing."""
    try:
        import nicegui  # noqa: F401
    except ImportError as error:
        raise PageUnavailable(
            f"the live page needs the extra `page` ({error}): pip install 'tenbaud[page]'"
        ) from error


def serve(feed: Feed, address: Address, *, open_browser: bool = False) -> None:
    """Serve the page until the process is asked to stop. Raises PageUnavailable."""
    require_nicegui()
    address.check()
    from nicegui import app, ui
    from starlette.middleware.trustedhost import TrustedHostMiddleware

    from tenbaud.view.page import build_page

    board = Board()
    if address.is_local:
        names = ["127.0.0.1", "localhost", address.name]
        app.add_middleware(TrustedHostMiddleware, allowed_hosts=names)
    app.add_static_files("/view", STATIC, max_cache_age=0)
    _add_stream(app, feed, board)
    ui.page("/", title="tenbaud", favicon=STATIC / "favicon.svg")(lambda: build_page(board, feed))
    app.on_startup(lambda: _first_look(address.url))
    with ExitStack() as stack:
        stack.enter_context(feed)
        ui.run(
            host=address.host,
            port=address.port,
            reload=False,
            show=open_browser,
            tailwind=False,
            show_welcome_message=False,
            gzip_middleware_factory=None,  # packing half a megabyte takes longer than loopback does
            reconnect_timeout=5.0,
            timeout_graceful_shutdown=1,  # an open page would otherwise hold the server up
        )


def _add_stream(app: object, feed: Feed, board: Board) -> None:
    from fastapi import WebSocket, WebSocketDisconnect

    fresh = asyncio.Condition()

    async def drain() -> None:
        due_s = time.monotonic()
        while True:
            if board.take(feed.take(), time.monotonic()):
                async with fresh:
                    fresh.notify_all()
            # By the clock, not after a pause, so that twenty a second are twenty.
            due_s = max(due_s + STREAM_PERIOD_S, time.monotonic())
            await asyncio.sleep(due_s - time.monotonic())

    async def stream(browser: WebSocket) -> None:
        if not _same_origin(browser.headers.get("origin"), browser.headers.get("host")):
            await browser.close(1008)
            return
        await browser.accept()
        index = 0
        try:
            while True:
                index, messages = board.since(index)
                for message in messages:
                    await browser.send_text(message.decode())
                try:
                    async with asyncio.timeout(IDLE_PERIOD_S), fresh:
                        await fresh.wait()
                except TimeoutError:
                    await browser.send_json({"silent_s": board.silent_s(time.monotonic())})
        except (WebSocketDisconnect, RuntimeError):
            return

    # Annotations are strings here and WebSocket is a local name, which FastAPI could not look up.
    stream.__annotations__["browser"] = WebSocket
    app.on_startup(drain)  # type: ignore[attr-defined]
    app.websocket("/stream")(stream)  # type: ignore[attr-defined]


async def _first_look(url: str) -> None:
    """Fetch the page once, so that the first visitor does not wait for what is only made once."""
    for _ in range(FIRST_LOOKS):
        with suppress(OSError):
            await asyncio.to_thread(lambda: urlopen(url, timeout=5.0).read())
            break
        await asyncio.sleep(0.05)
    sys.stderr.write(f"tenbaud view: {url}\n")
    sys.stderr.flush()


def _same_origin(origin: str | None, host: str | None) -> bool:
    """Return whether a browser asks from this very page; other sites may not listen in."""
    return origin is None or urlsplit(origin).netloc == host


def _socket_for(host: str) -> socket.socket:
    """Return a socket that takes this host's kind of address."""
    return socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET)


def free_port(host: str) -> int:
    """Return a port that was free at this address a moment ago."""
    with _socket_for(host) as probe:
        probe.bind((host, 0))
        return int(probe.getsockname()[1])
