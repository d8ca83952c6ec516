"""The live page: how soon it is painted, what it costs its browser, and what a viewer costs the loop."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.browser import browser, served, state_is, why_no_browser
from benchmarks.figures import Figure

MEASURED_S = 10.0
PAINTS = 5
SLICES = 6
SLICE_S = 10.0


def page_figures() -> list[Figure]:
    """Return the figures of the page: paint, browser, and lateness with and without a viewer."""
    problem = why_no_browser()
    if problem:
        print(problem, file=sys.stderr)
        return []
    return [*_paint_and_cost(), *_lateness()]


def _paint_and_cost() -> list[Figure]:
    """Fly on the real clock; open the page anew several times, then let one be for a while."""
    flight = ("demo", "--view", "--view-port", "0", "--clock", "real", "--mismatch", "0.1")
    with (
        tempfile.TemporaryDirectory() as folder,
        served(Path(folder), *flight) as one,
        browser() as chromium,
    ):
        paints = sorted(_first_paint(chromium, one.url) for _ in range(PAINTS))
        page = chromium.new_page(viewport={"width": 1200, "height": 900})
        page.add_init_script(COUNT_UPDATES)
        page.goto(one.url)
        state_is(page, "lockstep")
        page.wait_for_timeout(3000.0)
        renderer = _busiest_renderer()
        before, from_s = _cpu_s(renderer), time.monotonic()
        counted = page.evaluate("window.updates")
        page.wait_for_timeout(MEASURED_S * 1000.0)
        span_s = time.monotonic() - from_s
        share = 100.0 * (_cpu_s(renderer) - before) / span_s
        rate = (page.evaluate("window.updates") - counted) / span_s
    return [
        Figure("page_first_paint_s", paints[PAINTS // 2] / 1000.0, "s", "under 1"),
        Figure("page_first_paint_worst_s", paints[-1] / 1000.0, "s", "under 1"),
        Figure("page_updates_per_s", rate, "1/s", "20"),
        Figure("page_tab_cpu_percent", share, "% of a core", "under 25"),
    ]


COUNT_UPDATES = """
window.updates = 0;
const clear = CanvasRenderingContext2D.prototype.clearRect;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  if (this.canvas.id === "pitch-curve") window.updates += 1;
  return clear.apply(this, box);
};
"""
"""Counts what is drawn, not what arrives: the pitch curve is cleared once for each redraw."""


def _first_paint(chromium: Any, url: str) -> float:
    context = chromium.new_context()
    page = context.new_page()
    page.goto(url)
    page.wait_for_function("performance.getEntriesByName('first-contentful-paint').length")
    at: float = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    context.close()
    return at


def _busiest_renderer() -> int:
    """Return the process of the page that is open: of the newest Chromium's renderers the busiest."""
    own = {os.getpid()}
    found: list[int] = []
    parents = _parents()
    for _ in range(6):
        own |= {pid for pid, parent in parents.items() if parent in own}
    for pid in own - {os.getpid()}:
        try:
            if "--type=renderer" in Path(f"/proc/{pid}/cmdline").read_text():
                found.append(pid)
        except OSError:
            continue
    return max(found, key=_cpu_s)


def _parents() -> dict[int, int]:
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    return parents


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _lateness() -> list[Figure]:
    """One flight on the real clock, a viewer coming and going: p99 of the slices with and without.

    The viewer is a subscriber of both ends in a process of its own, as the page's server is.
    """
    from channel.links.endpoints import free_endpoint
    from tenbaud.recording.reader import Recording

    with tempfile.TemporaryDirectory() as folder:
        link, *places = (free_endpoint() for _ in range(3))
        total_s = SLICES * SLICE_S
        ends = [
            _start(folder, "receive", "--listen", link, "--telemetry", places[0], "--out", "lower"),
            _start(
                folder, "transmit", "--connect", link, "--telemetry", places[1], "--out", "upper",
                "--duration", str(total_s),
            ),
        ]  # fmt: skip
        started = time.monotonic()
        spans: list[tuple[float, float]] = []
        for index in range(1, SLICES, 2):
            time.sleep(max(0.0, started + index * SLICE_S - time.monotonic()))
            viewer = _start(folder, code=VIEWER, arguments=places)
            time.sleep(2.5)
            from_s = time.monotonic() - started
            time.sleep(max(0.0, started + (index + 1) * SLICE_S - 0.5 - time.monotonic()))
            spans.append((from_s, time.monotonic() - started - 1.0))
            viewer.terminate()
            viewer.wait()
        summary = json.loads(ends[1].communicate(timeout=60.0)[0])
        ends[0].communicate(timeout=60.0)
        rows = [row for _, row in Recording(Path(folder) / "upper" / "transmitter.mcap").rows("tick")]
    watched, alone = _sorted_lateness(rows, spans)
    p99 = [late[round(0.99 * (len(late) - 1))] for late in (alone, watched)]
    return [
        Figure("loop_late_ms_p99_alone", p99[0], "ms", ""),
        Figure("loop_late_ms_p99_viewed", p99[1], "ms", ""),
        Figure("loop_late_p99_viewed_over_alone", p99[1] / p99[0], "times", "at most 1.2"),
        Figure("telemetry_dropped", summary["telemetry_dropped"], "messages", ""),
    ]


def _sorted_lateness(
    rows: list[dict[str, Any]], spans: list[tuple[float, float]]
) -> tuple[list[float], list[float]]:
    """Return the lateness of the ticks while somebody looked, and as long after each such span."""
    watched, alone = [], []
    for row in rows:
        time_s = row["time_s"]
        if any(first <= time_s < last for first, last in spans):
            watched.append(row["lateness_ms"])
        elif any(first - SLICE_S <= time_s < last - SLICE_S for first, last in spans):
            alone.append(row["lateness_ms"])
    return sorted(watched), sorted(alone)


VIEWER = """
import sys, time
from tenbaud.view.board import Board
from tenbaud.view.feed import Feed
board = Board()
with Feed(tuple(sys.argv[1:])) as feed:
    while True:
        board.take(feed.take(), time.monotonic())
        time.sleep(0.05)
"""


def _start(
    folder: str, *words: str, code: str | None = None, arguments: list[str] | None = None
) -> subprocess.Popen[str]:
    how = ["-c", code, *(arguments or [])] if code else ["-m", "tenbaud", *words, "--json"]
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, *how],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
