"""The page's server: NiceGUI for the page and its controls, one stream of telemetry beside it.

It listens on this machine by default, and answers only requests with a secret of its printed
addresses (`gate.py`), and asks nothing of the internet: every script, style and font comes from the
installed packages.
"""

from __future__ import annotations

import asyncio
import socket
import sys
import time
from collections.abc import Callable, Coroutine
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from importlib.util import find_spec
from typing import Any
from urllib.request import Request, urlopen

from channel.errors import TenbaudError
from channel.links.endpoints import is_loopback
from tenbaud.view.access import COOKIE, Access, draw_access
from tenbaud.view.board import Board
from tenbaud.view.browser import STATIC, open_privately
from tenbaud.view.feed import Feed

STREAM_PERIOD_S = 0.05
IDLE_PERIOD_S = 0.5
FIRST_LOOKS = 100
EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}
"""Hosts that stand for every address of this machine, and by which one it finds itself there."""
SERVING = "tenbaud view: "
"""begins the line with the address of the page"""
LOOK_ONLY = "tenbaud view, to look only: "


class PageUnavailable(TenbaudError):
    """The page cannot be served; the text says what to do."""


@dataclass(frozen=True, slots=True)
class Address:
    """The address of the page."""

    host: str = "127.0.0.1"
    port: int = 8710
    insecure: bool = False

    @property
    def is_local(self) -> bool:
        """Return whether only this machine can reach it."""
        return is_loopback(f"tcp/{self.host}:{self.port}")

    @property
    def url(self) -> str:
        """Return how this machine reaches the server, without any secret."""
        return f"http://{self.name}:{self.port}"

    @property
    def name(self) -> str:
        """Return this machine's name for itself in a URL: one of IPv6 stands in brackets."""
        host = EVERYWHERE.get(self.host, self.host)
        return f"[{host}]" if ":" in host else host

    def checked(self) -> Address:
        """Return the address with a port that is free, any one for port 0.

        Raises PageUnavailable for one that is taken, or that others can reach unless that is allowed.
        """
        if not self.is_local and not self.insecure:
            raise PageUnavailable(
                f"{self.host} is reachable from other machines, and the page is not encrypted: whoever "
                "listens on the network reads its secret, sees the flight, and steers it if it takes "
                "commands. On a network that you trust with that, add --insecure"
            )
        try:
            with socket.socket(socket.AF_INET6 if ":" in self.host else socket.AF_INET) as probe:
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((self.host, self.port))
                return replace(self, port=probe.getsockname()[1])
        except OSError as error:
            raise PageUnavailable(
                f"the page cannot be served at {self.name}:{self.port}: {error.strerror}; give another "
                "--port (--view-port of `tenbaud demo`), or 0 for any free one"
            ) from error


def require_nicegui() -> None:
    """Raise PageUnavailable, with what to install, when the page's extra is missing.

    It only looks: NiceGUI itself takes a second to import, and a replay does without.
    """
    try:
        found = find_spec("nicegui") is not None
    except ValueError:
        found = False
    if not found:
        raise PageUnavailable(
            "the page needs the extra `page`, which is not installed: pip install 'tenbaud[page]'"
        )


def serve(feed: Feed, address: Address, *, open_browser: bool = False, view_only: bool = False) -> None:
    """Serve the page of a live flight until the process is asked to stop. Raises PageUnavailable.

    `view_only`: no address is printed that lets anybody steer.
    """
    require_nicegui()
    address = address.checked()
    from fastapi import FastAPI
    from nicegui import app, ui

    from tenbaud.view.gate import GRANT
    from tenbaud.view.page import build_page

    board = Board()
    access = draw_access(address.host, address.is_local, view_only=view_only)
    app.add_static_files("/view", STATIC, max_cache_age=0)
    _add_stream(app, feed, board)

    def page() -> None:
        build_page(board, feed, steers=ui.context.client.request.scope[GRANT].steers)

    ui.page("/", title="tenbaud", favicon=STATIC / "favicon.svg")(page)
    outer = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    ui.run_with(
        outer,
        tailwind=False,
        show_welcome_message=False,
        gzip_middleware_factory=None,  # packing half a megabyte takes longer than loopback does
        reconnect_timeout=5.0,
    )
    with feed:
        run_page(outer, access, address, open_browser=open_browser)


def run_page(inner: Any, access: Access, address: Address, *, open_browser: bool) -> None:
    """Serve an application behind the gate until the process is asked to stop."""
    import uvicorn

    from tenbaud.view.gate import Gate

    # The gate is the outermost: nothing answers anybody whom it has not let in.
    config = uvicorn.Config(
        Gate(inner, access),
        host=address.host,
        port=address.port,
        ws="wsproto",
        log_level="warning",
        access_log=False,  # an address holds a secret
        proxy_headers=False,
        server_header=False,
        timeout_graceful_shutdown=1,  # an open page would otherwise hold the server up
    )
    with ExitStack() as stack:
        shown = stack.enter_context(open_privately()) if open_browser else None
        runner = stack.enter_context(asyncio.Runner(loop_factory=config.get_loop_factory()))
        runner.run(_serve(uvicorn.Server(config), _first_look(address.url, access, shown)))


async def _serve(server: Any, first_look: Coroutine[Any, Any, None]) -> None:
    looking = asyncio.create_task(first_look)
    try:
        await server.serve()
    finally:
        looking.cancel()


def _add_stream(app: Any, feed: Feed, board: Board) -> None:
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
    app.on_startup(drain)
    app.websocket("/stream")(stream)


async def _first_look(url: str, access: Access, shown: Callable[[str], None] | None) -> None:
    """Fetch the page once, so that the first visitor does not wait for what is only made once.

    Then print the addresses. `shown` opens the first of them in this machine's browser.
    """
    first, *others = access.grants
    page = Request(f"{url}{first.path}/", headers={"Cookie": f"{COOKIE}={first.key}"})
    for _ in range(FIRST_LOOKS):
        with suppress(OSError):
            await asyncio.to_thread(lambda: urlopen(page, timeout=5.0).read())
            break
        await asyncio.sleep(0.05)
    lines = [f"{SERVING}{first.address(url)}", *(f"{LOOK_ONLY}{one.address(url)}" for one in others)]
    sys.stderr.write("\n".join(lines) + "\n")
    sys.stderr.flush()
    if shown is not None:
        await asyncio.to_thread(shown, first.address(url))
