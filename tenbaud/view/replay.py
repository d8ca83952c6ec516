"""Serves the page of finished flights: the instruments of the live page, fed from recordings.

A browser asks for moments and gets the messages of a live board (`recorded.py`). Nothing here steers
anything, so one address is printed.
"""

from __future__ import annotations

import math
from typing import Any

import orjson

from tenbaud.view.access import draw_access
from tenbaud.view.browser import STATIC
from tenbaud.view.recorded import RecordedFlight
from tenbaud.view.server import Address, require_nicegui, run_page

HEAD = """<!doctype html><html lang="en"><head><meta charset="utf-8"><title>tenbaud</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="view/favicon.svg"><link rel="stylesheet" href="view/view.css">
</head><body>"""


def serve_recorded(
    flights: list[RecordedFlight], address: Address, *, open_browser: bool = False
) -> None:
    """Serve the page until the process is asked to stop. Raises PageUnavailable."""
    require_nicegui()
    address = address.checked()
    from starlette.applications import Starlette
    from starlette.responses import HTMLResponse
    from starlette.routing import Mount, Route, WebSocketRoute
    from starlette.staticfiles import StaticFiles
    from starlette.websockets import WebSocket, WebSocketDisconnect

    instruments, transport = (
        (STATIC / name).read_text(encoding="utf-8") for name in ("instruments.html", "transport.html")
    )
    # In the place that the controls have on the page of a live flight.
    html = HEAD + instruments.replace("<main", f"{transport}<main", 1) + "</body></html>"

    async def page(_: Any) -> HTMLResponse:
        return HTMLResponse(html, headers={"cache-control": "no-store"})

    async def stream(browser: WebSocket) -> None:
        await browser.accept()
        try:
            await browser.send_text(orjson.dumps({"recorded": described(flights)}).decode())
            while True:
                answer = moments(flights, await browser.receive_text())
                await browser.send_text(answer.decode())
        except (WebSocketDisconnect, RuntimeError):
            return
        except (ValueError, TypeError, KeyError):  # KeyError: bytes instead of text
            await browser.close(1003)  # no question of the page's script

    app = Starlette(
        routes=[
            Route("/", page),
            Mount("/view", StaticFiles(directory=STATIC)),
            WebSocketRoute("/stream", stream),
        ]
    )
    access = draw_access(address.host, address.is_local, view_only=True)
    run_page(app, access, address, open_browser=open_browser)


def described(flights: list[RecordedFlight]) -> dict[str, Any]:
    """Return what a browser needs to know once."""
    return {
        "flights": [{"name": flight.name, "missing": flight.missing} for flight in flights],
        "duration_s": max(flight.duration_s for flight in flights),
        "step_s": min(flight.sample_s for flight in flights),
        "notes": [note for flight in flights for note in flight.notes],
        "events_s": sorted(set().union(*(flight.events_s for flight in flights))),
    }


def moments(flights: list[RecordedFlight], question: str) -> bytes:
    """Return the messages of all flights at the moment that a browser asks for.

    `from_s` and `to_s` beside `at_s`: with the curves of this window. ValueError or TypeError for what
    is no question.
    """
    asked: dict[str, Any] = orjson.loads(question)
    if not isinstance(asked, dict):
        raise ValueError("a question is an object")
    at_s = float(asked.get("at_s", ""))
    window = None if "from_s" not in asked else (float(asked["from_s"]), float(asked.get("to_s", "")))
    if not all(map(math.isfinite, (at_s, *(window or ())))):
        raise ValueError("a time is a finite number")
    return orjson.dumps({"runs": [flight.moment(at_s, window) for flight in flights]})
