"""The page on which both ends fly in the browser: how soon it is there, and how fast it flies."""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

from benchmarks.browser import browser, why_no_browser
from benchmarks.figures import Figure
from docs.tools.browser import page_files, why_no_pyodide

OPENINGS = 5
FLOWN_S = 10.0
FLYING = """
() => document.getElementById("value-0") && document.getElementById("value").textContent.endsWith("°")
"""
FLIGHT_TIME = "() => parseFloat(document.getElementById('f-time').textContent)"


class _Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        pass


@contextmanager
def served_folder(folder: Path) -> Iterator[str]:
    """Within the `with`, the folder is served on loopback; yields the address of its top."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Quiet, directory=str(folder)))
    thread = Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def write_page(folder: Path) -> None:
    """Write the files of the page below a folder, as the site has them."""
    for name, content in page_files().items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def in_browser_figures() -> list[Figure]:
    """Return the time to the first picture, and the speed of a flight that nothing holds back."""
    problem = why_no_browser() or why_no_pyodide()
    if problem:
        print(problem, file=sys.stderr)
        return []
    with tempfile.TemporaryDirectory() as folder, browser() as chromium:
        write_page(Path(folder))
        with served_folder(Path(folder)) as address:
            shown = sorted(_shown_s(chromium, address) for _ in range(OPENINGS))
            speed = _speed(chromium, address)
    return [
        Figure("in_browser_first_picture_s", shown[OPENINGS // 2], "s", "under 10"),
        Figure("in_browser_first_picture_worst_s", shown[-1], "s", "under 10"),
        Figure("in_browser_speed", speed, "x real time", "20 at least"),
    ]


def _shown_s(chromium: Any, address: str) -> float:
    """Return the seconds from opening the page, nothing of it cached, to a flight that is drawn."""
    context = chromium.new_context()
    page = context.new_page()
    opened_s = time.monotonic()
    _open(page, address)
    shown_s = time.monotonic() - opened_s
    context.close()
    return shown_s


def _speed(chromium: Any, address: str) -> float:
    page = chromium.new_page()
    _open(page, address)
    page.click('[data-pace="null"]')
    page.wait_for_timeout(2000.0)
    before_s, since_s = page.evaluate(FLIGHT_TIME), time.monotonic()
    page.wait_for_timeout(FLOWN_S * 1000.0)
    return float(page.evaluate(FLIGHT_TIME) - before_s) / (time.monotonic() - since_s)


def _open(page: Any, address: str) -> None:
    page.goto(f"{address}/browser/flight.html")
    page.wait_for_function(FLYING, timeout=120_000)
