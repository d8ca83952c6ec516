"""Pages from elsewhere, in a browser that has the live page open: they reach nothing of it.

Each knows all but the secret: the port, and even the path below which the browser sends the cookie.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from benchmarks.browser import Served, browser, served, state_is, why_no_browser

pytestmark = pytest.mark.skipif(why_no_browser() is not None, reason=str(why_no_browser()))

REBOUND = "rebound.example"
ELSEWHERE = "elsewhere.example"
FOREIGN = '<!doctype html><title>foreign</title><link rel="icon" href="data:,"><h1>foreign</h1>'

TRY_ALL = """
async (base) => {
  const polling = `${base}_nicegui_ws/socket.io/?EIO=4&transport=polling`;
  const got = {};
  for (const [name, url, options] of [
    ["page, read", base, {}],
    ["page, unread", base, { mode: "no-cors" }],
    ["polling, read", polling, {}],
    ["polling, unread", polling, { mode: "no-cors" }],
    ["posting", `${polling}&sid=none`, { mode: "no-cors", method: "POST", body: "40" }],
  ]) {
    try { got[name] = (await fetch(url, { credentials: "include", ...options })).status; }
    catch (error) { got[name] = error.name; }
  }
  for (const [name, path] of [["stream", "stream"], ["socket.io", "_nicegui_ws/socket.io/?EIO=4&transport=websocket"]]) {
    got[name] = await new Promise((resolve) => {
      const socket = new WebSocket(base.replace("http", "ws") + path);
      socket.onopen = () => { socket.close(); resolve("open"); };
      socket.onerror = () => resolve("refused");
    });
  }
  return got;
}
"""  # noqa: E501
FRAME = """
(base) => new Promise((resolve) => {
  const frame = document.createElement("iframe");
  frame.onload = () => setTimeout(resolve, 200);
  frame.src = base;
  document.body.append(frame);
})
"""


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    # The two names lead here, as a name server of their owner would make them.
    rules = ", ".join(f"MAP {name} 127.0.0.1" for name in (REBOUND, ELSEWHERE))
    with browser(f"--host-resolver-rules={rules}") as one:
        yield one


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("flight")
    with served(folder, "demo", "--view", "--view-port", "0", "--out", "run") as one:
        yield one


@pytest.fixture(scope="module")
def tab(chromium: Any) -> Iterator[Any]:
    page = chromium.new_context().new_page()
    yield page
    page.context.close()


@pytest.fixture
def own(tab: Any, flight: Served) -> Iterator[Any]:
    """The live page, opened as its user does, in a context that then has the cookie."""
    tab.context.clear_cookies()
    tab.goto(flight.url)
    state_is(tab, "lockstep")
    yield tab
    assert tab.locator("#f-rejoins").inner_text() == "0, 0"


@contextmanager
def foreign_server() -> Iterator[int]:
    """Within the `with`, a server of somebody else on this machine; yields its port."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(FOREIGN.encode())
            cookies.append(self.headers.get("Cookie", ""))

        def log_message(self, *_: object) -> None:
            return

    cookies: list[str] = []
    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server.server_port
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
    # The secret was offered to nobody: cookies know no ports, and this server has the same host name.
    assert cookies
    assert not any(cookies)


def on_the_wire(page: Any) -> tuple[list[int], list[str]]:
    """Return two lists that grow as the page asks: the statuses answered, and the cookies sent."""
    statuses: list[int] = []
    cookies: list[str] = []
    wire = page.context.new_cdp_session(page)
    wire.on("Network.responseReceivedExtraInfo", lambda one: statuses.append(one["statusCode"]))
    wire.on(
        "Network.requestWillBeSentExtraInfo",
        lambda one: cookies.append(one["headers"].get("Cookie", "")),
    )
    wire.send("Network.enable")
    return statuses, cookies


def path_of(page: Any) -> str:
    return urlsplit(page.url).path


def test_the_page_itself_may_do_all_that_others_try(own: Any) -> None:
    assert own.evaluate(TRY_ALL, own.url) == {
        "page, read": 200, "page, unread": 200, "polling, read": 200, "polling, unread": 200,
        "posting": 400, "stream": "open", "socket.io": "open",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost", ELSEWHERE])
def test_a_foreign_page_can_neither_ask_listen_steer_nor_frame(own: Any, name: str) -> None:
    with foreign_server() as port:
        page = own.context.new_page()
        page.goto(f"http://{name}:{port}/")
        statuses, sent = on_the_wire(page)
        got = page.evaluate(TRY_ALL, own.url)
        assert set(got.values()) == {"TypeError", "refused"}
        # What a script may not read says nothing of what the server did; this does.
        assert len(statuses) >= 5
        assert set(statuses) == {403}
        # Cookies know no ports: from the same host name this one comes along, and is not enough.
        assert any("tenbaud=" in cookie for cookie in sent) is (name == "127.0.0.1")
        page.evaluate(FRAME, own.url)
        (frame,) = page.frames[1:]
        assert "tenbaud" not in frame.content()
        assert frame.url.startswith("chrome-error://")
        # Nor has it a hold on a window that it opens itself.
        with page.expect_popup() as opened:
            page.evaluate("(base) => { window.held = window.open(base); }", own.url)
        opened.value.wait_for_load_state()
        page.wait_for_function("() => window.held.closed")
        page.close()
    state_is(own, "lockstep")


def test_a_rebound_name_reaches_nothing_even_with_the_printed_secret(own: Any, flight: Served) -> None:
    page = own.context.new_page()
    port = flight.port
    for address in (path_of(own), f"/?key={flight.url.partition('?key=')[2]}", "/"):
        answer = page.goto(f"http://{REBOUND}:{port}{address}")
        assert answer.status == 403
        assert "does not answer to the name" in page.inner_text("body")
    assert page.context.cookies(f"http://{REBOUND}:{port}{path_of(own)}") == []
    got = page.evaluate(TRY_ALL, f"http://{REBOUND}:{port}{path_of(own)}")
    assert set(got.values()) == {403, "refused"}
    page.close()


def test_who_may_only_look_sees_the_flight_and_has_nothing_to_press(own: Any, flight: Served) -> None:
    context = own.context.browser.new_context()
    page = context.new_page()
    page.goto(flight.look_url)
    state_is(page, "lockstep")
    page.get_by_text("view-only").wait_for()
    assert page.locator(".controls button, .controls input").count() == 0
    assert own.locator(".controls button").count() > 5
    context.close()
    # Nor does the one overwrite the other's cookie, in one browser.
    second = own.context.new_page()
    second.goto(flight.look_url)
    state_is(second, "lockstep")
    own.reload()
    state_is(own, "lockstep")
    own.get_by_role("button", name="Corrupt the transmitter's codec").wait_for()
    second.close()


def test_when_the_page_is_opened_without_its_secret_then_it_says_what_to_do(
    tab: Any, flight: Served
) -> None:
    tab.context.clear_cookies()
    answer = tab.goto(f"http://127.0.0.1:{flight.port}/")
    assert answer.status == 403
    assert "the whole address" in tab.inner_text("body")


def test_when_the_server_was_started_anew_then_the_old_page_shows_nothing_and_says_so(
    tab: Any, tmp_path: Path
) -> None:
    nowhere = f"unixsock-stream/{tmp_path}/nobody.sock"
    tab.context.clear_cookies()
    with served(tmp_path, "view", "--port", "0", "--connect", nowhere) as first:
        port = first.port
        tab.goto(first.url)
        tab.get_by_text("No flight found. Start one").wait_for()
    with served(tmp_path, "view", "--port", str(port), "--connect", nowhere) as second:
        answer = tab.goto(tab.url)
        assert answer.status == 403
        assert "Each start prints a new one" in tab.inner_text("body")
        tab.goto(second.url)
        tab.get_by_text("No flight found. Start one").wait_for()
