"""The live page: how soon it is painted, what it costs its browser, what it costs the loop."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from benchmarks.browser import browser, served, state_is, why_no_browser
from benchmarks.figures import Figure
from tenbaud import fly

MEASURED_S = 10.0
PAINTS = 5
SLICES = 6
SLICE_S = 15.0


def page_figures() -> list[Figure]:
    """Return the figures of the page: paint, browser, and lateness with and without a viewer."""
    problem = why_no_browser()
    if problem:
        print(problem, file=sys.stderr)
        return []
    return [*_replay(), *_paint_and_cost(), *_lateness()]


def _replay() -> list[Figure]:
    """Open the replay of a flight of 10 minutes: the time from the address to its curves."""
    with tempfile.TemporaryDirectory() as folder, browser() as chromium:
        settings = {"duration_s": 600.0, "transmitter.plant.mismatch": 0.1}
        fly("tuned-10baud", settings=settings, out=Path(folder) / "run")
        started_s = time.monotonic()
        with served(Path(folder), "view", "run", "--port", "0") as one:
            up_s = time.monotonic() - started_s
            shown = sorted(_first_shown(chromium, one.url, REPLAY_SHOWN) for _ in range(PAINTS))
    return [
        Figure("replay_10_min_shown_s", shown[PAINTS // 2] / 1000.0, "s", "under 1"),
        Figure("replay_10_min_shown_worst_s", shown[-1] / 1000.0, "s", "under 1"),
        Figure("replay_10_min_served_s", up_s, "s", ""),
    ]


def _paint_and_cost() -> list[Figure]:
    """Fly on the real clock; open the page anew several times, then let one be for a while."""
    flight = ("demo", "--view", "--view-port", "0", "--clock", "real", "--mismatch", "0.1")
    with (
        tempfile.TemporaryDirectory() as folder,
        served(Path(folder), *flight) as one,
        browser() as chromium,
    ):
        paints = sorted(_first_shown(chromium, one.url, PAINTED_AT) for _ in range(PAINTS))
        page = chromium.new_page(viewport={"width": 1200, "height": 900})
        page.add_init_script(COUNT_UPDATES)
        page.goto(one.url)
        state_is(page, "lockstep")
        page.wait_for_timeout(3000.0)
        tab, *others = _browser_processes()
        before, from_s = _cpu_s(tab), time.monotonic()
        before_others = sum(map(_cpu_s, others))
        counted = page.evaluate("window.updates")
        page.wait_for_timeout(MEASURED_S * 1000.0)
        span_s = time.monotonic() - from_s
        share = 100.0 * (_cpu_s(tab) - before) / span_s
        rest = 100.0 * (sum(map(_cpu_s, others)) - before_others) / span_s
        rate = (page.evaluate("window.updates") - counted) / span_s
    return [
        Figure("page_first_paint_s", paints[PAINTS // 2] / 1000.0, "s", "under 1"),
        Figure("page_first_paint_worst_s", paints[-1] / 1000.0, "s", "under 1"),
        Figure("page_updates_per_s", rate, "1/s", "20"),
        Figure("page_tab_cpu_percent", share, "% of a core", "under 25"),
        Figure("page_rest_of_browser_cpu_percent", rest, "% of a core", ""),
    ]


COUNT_UPDATES = """
window.updates = 0;
const clear = CanvasRenderingContext2D.prototype.clearRect;
CanvasRenderingContext2D.prototype.clearRect = function (...box) {
  if (this.canvas.id === "value-0") window.updates += 1;
  return clear.apply(this, box);
};
"""
"""Counts what is drawn, not what arrives: the pitch curve is cleared once for each redraw."""


PAINTED_AT = """
() => {
  const [painted] = performance.getEntriesByName("first-contentful-paint");
  return document.getElementById("light") && painted && performance.timeOrigin + painted.startTime;
}
"""


REPLAY_SHOWN = """
() => {
  const time = document.getElementById("f-time");
  return time && parseFloat(time.textContent) >= 0 && document.getElementById("value-0") && Date.now();
}
"""
"""When figures and curves of a recording are there."""


def _first_shown(chromium: Any, url: str, expression: str) -> float:
    """Return the milliseconds from opening the printed address, its exchange for a cookie included."""
    context = chromium.new_context()
    page = context.new_page()
    opened_ms = time.time() * 1000.0
    page.goto(url)
    painted_ms: float = page.wait_for_function(expression).json_value()
    context.close()
    return painted_ms - opened_ms


def _browser_processes() -> list[int]:
    """Return the processes of the browser, the open tab's first: the busiest of its renderers."""
    own = {os.getpid()}
    parents = _parents()
    for _ in range(6):
        own |= {pid for pid, parent in parents.items() if parent in own}
    renderers: list[int] = []
    others: list[int] = []
    for pid in own:
        with suppress(OSError):
            words = Path(f"/proc/{pid}/cmdline").read_text()
            if "chrom" in words.partition("\0")[0]:
                (renderers if "--type=renderer" in words else others).append(pid)
    renderers.sort(key=_cpu_s, reverse=True)
    return renderers + others


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
    """One flight on the real clock, the page coming and going: p99 of the slices with and without.

    With the page means its server and a browser that shows it, on the same cores as the flight.
    """
    from channel.links.endpoints import free_endpoint
    from tenbaud.recording.reader import Recording

    with tempfile.TemporaryDirectory() as folder:
        link, *places = (free_endpoint() for _ in range(3))
        total_s = (SLICES + 1) * SLICE_S
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
            watching = ("view", "--port", "0", "--connect", places[0], "--connect", places[1])
            with served(Path(folder), *watching) as one, browser() as chromium:
                page = chromium.new_page(viewport={"width": 1200, "height": 900})
                page.goto(one.url)
                state_is(page, "lockstep")
                page.wait_for_timeout(2000.0)
                from_s = time.monotonic() - started
                until_s = started + (index + 1) * SLICE_S
                page.wait_for_timeout(max(0.0, until_s - time.monotonic()) * 1000.0)
                spans.append((from_s, time.monotonic() - started - 1.5))
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
    """Return the lateness of the ticks while somebody looked, and of as long a span before each."""
    watched, alone = [], []
    for row in rows:
        time_s = row["time_s"]
        if any(first <= time_s < last for first, last in spans):
            watched.append(row["lateness_ms"])
        elif any(first - SLICE_S <= time_s < last - SLICE_S for first, last in spans):
            alone.append(row["lateness_ms"])
    return sorted(watched), sorted(alone)


def _start(folder: str, *words: str) -> subprocess.Popen[str]:
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-m", "tenbaud", *words, "--json"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
