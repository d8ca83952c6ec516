"""The gate before the page's server: every request and every WebSocket passes it, or gets nothing.

It stands outside of NiceGUI and of its Socket.IO, which would talk to any origin. A request passes when
its `Host` is a name of this server, its `Origin` is this page, and its cookie holds the secret that
belongs to its path.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from tenbaud.view.access import COOKIE, Access, Grant, is_same_origin

if TYPE_CHECKING:
    from starlette.responses import HTMLResponse
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

GRANT = "tenbaud.grant"
"""the entry of an ASGI scope that holds the `Grant` of who asks"""

SAFE_METHODS = ("GET", "HEAD")
HEADERS = (
    # No other page may show this one in a frame and lead a click onto it.
    (b"content-security-policy", b"frame-ancestors 'none'; base-uri 'none'; form-action 'none'"),
    (b"x-frame-options", b"DENY"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
    (b"referrer-policy", b"no-referrer"),
    (b"x-content-type-options", b"nosniff"),
)
PAGE = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>tenbaud</title>
<meta name="viewport" content="width=device-width"><meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
<style>body {{ font: 1rem/1.5 sans-serif; max-width: 40rem; margin: 3rem auto; padding: 1rem }}</style>
{head}</head><body>{body}</body></html>"""
NO_SECRET = (
    "This page shows, and may steer, a flight. Open it with the whole address that "
    "<code>tenbaud view</code> or <code>tenbaud demo --view</code> printed in its terminal, the "
    "<code>?key=…</code> at its end included. Each start prints a new one."
)


class Gate:
    """An ASGI application in front of another."""

    def __init__(self, app: ASGIApp, access: Access) -> None:
        self.app = app  # by this name NiceGUI finds the server that it runs in
        self._access = access

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, refuse, or pass on."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers = _headers(scope)
        refusal = self._refusal(scope, headers)
        if refusal:
            await _page("", f"<p>{refusal}</p>", 403)(scope, receive, _with_headers(send))
        elif (grant := self._entering(scope)) is not None:
            # Not a redirect: after one, browsers that came from another site withhold a strict cookie.
            head = f'<meta http-equiv="refresh" content="0; url={grant.path}/">'
            answer = _page(head, "", 200)
            answer.headers["set-cookie"] = grant.cookie
            await answer(scope, receive, _with_headers(send))
        elif (grant := self._holder(scope, headers)) is not None:
            # Everything is served below the grant's path, so that the cookie goes nowhere else.
            inner = {**scope, "root_path": grant.path, GRANT: grant}
            await self.app(inner, receive, _with_headers(send))
        else:
            await _page("", f"<p>{NO_SECRET}</p>", 403)(scope, receive, _with_headers(send))

    def _refusal(self, scope: Scope, headers: dict[str, str]) -> str:
        """Return why this request comes from the wrong place; "" when it does not."""
        host = headers.get("host", "")
        if not self._access.answers_to(host):
            return (
                f"This server does not answer to the name {escape(host)!r}. Use the address that it "
                "printed, or an IP address of its machine."
            )
        changes = scope["type"] == "websocket" or scope["method"] not in SAFE_METHODS
        if not is_same_origin(headers) or (changes and "origin" not in headers):
            return "Only the page itself may ask for this, and no page from elsewhere."
        return ""

    def _entering(self, scope: Scope) -> Grant | None:
        """Return what the secret in a printed address allows; None when this is no such address."""
        from starlette.datastructures import QueryParams

        if scope["type"] != "http" or scope["path"] != "/" or scope["method"] not in SAFE_METHODS:
            return None
        return self._access.holder_of(QueryParams(scope["query_string"]).get("key", ""))

    def _holder(self, scope: Scope, headers: dict[str, str]) -> Grant | None:
        """Return what the cookie of a request allows, at its path; None: nothing."""
        grant = self._access.below(scope["path"])
        # Another server of this host name may have set a cookie of the same name.
        cookies = (part.strip().partition("=") for part in headers.get("cookie", "").split(";"))
        keys = [key for name, _, key in cookies if name == COOKIE]
        return grant if grant is not None and any(map(grant.accepts, keys)) else None


def _headers(scope: Scope) -> dict[str, str]:
    """Return the headers by name; one that came twice is joined, and equals nothing expected."""
    found: dict[str, str] = {}
    for raw_name, raw_value in scope["headers"]:
        name, value = raw_name.decode("latin-1").lower(), raw_value.decode("latin-1")
        between = "; " if name == "cookie" else ", "
        found[name] = f"{found[name]}{between}{value}" if name in found else value
    return found


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] in ("http.response.start", "websocket.http.response.start"):
            message = {**message, "headers": [*message.get("headers", ()), *HEADERS]}
        await send(message)

    return sending


def _page(head: str, body: str, status: int) -> HTMLResponse:
    """Return a small page of our own; a WebSocket that is asked for is refused with it."""
    from starlette.responses import HTMLResponse

    return HTMLResponse(PAGE.format(head=head, body=body), status, {"cache-control": "no-store"})
