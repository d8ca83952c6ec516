"""How many 10-baud rigs a receiver process serves in real time, and what each of them costs.

The receivers are `tenbaud receive --sessions`, recording every flight; the rigs are `light_rigs`, on
the same cores, and what they take of these is shown beside. CPU is in percent of one core.
Then the same with two receivers behind a router, the rigs spread over them by the names of their
sessions, for what a fleet costs (docs/fleet.md).
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from benchmarks.figures import Figure
from benchmarks.light_rigs import NAME, session_pattern
from channel.links.endpoints import free_endpoint

RIGS = (5, 25, 50, 100, 150, 200, 300)
SHARDED = (50, 100)
SHARDS = 2
SECONDS = 10.0
SETTLE_S = 2.0
TIMEOUT_S = 90.0
LATE_MS = 5.0
SYMBOLS_PER_S = 10
LINEAR_RIGS = 100
"""Up to here a receiver keeps up, and the cost of one rig follows from the slope."""


def load_figures(
    rigs: tuple[int, ...] = RIGS, sharded: tuple[int, ...] = SHARDED, seconds: float = SECONDS
) -> list[Figure]:
    """Return CPU, memory and lateness for each number of rigs, and what one of them costs."""
    points = {number: measure(number, seconds) for number in rigs}
    figures = [figure for number in rigs for figure in _shown(f"load_{number}_rigs", points[number])]
    linear = tuple(number for number in rigs if number <= LINEAR_RIGS)
    for name, unit in (
        ("cpu_percent", "% of a core"),
        ("memory_mb", "MB"),
        ("rigs_cpu_percent", "% of a core"),
        ("bytes_up_per_s", "bytes/s"),
        ("bytes_down_per_s", "bytes/s"),
    ):
        slope, straightness = line_through(linear, [points[number][name] for number in linear])
        figures.append(Figure(f"load_{name}_per_rig", slope, unit))
        figures.append(Figure(f"load_{name}_linear_r2", straightness, "", "near 1"))
    within = [number for number, point in points.items() if kept(point)]
    figures.append(Figure("load_rigs_within_5_ms", max(within, default=0), "rigs", "at least 50"))
    for number in sharded:
        point = measure(number, seconds, SHARDS)
        figures += _shown(f"load_{number}_rigs_{SHARDS}_shards", point)
        figures.append(
            Figure(
                f"load_{number}_rigs_{SHARDS}_shards_router_cpu_percent",
                point["router_cpu_percent"],
                "% of a core",
            )
        )
    return figures


def kept(point: dict[str, float]) -> bool:
    """Return whether all was in time: the loop, and every symbol."""
    whole = not (point["desyncs"] or point["erasures"] or point["rejoins"])
    return point["loop_late_ms_p99"] < LATE_MS and whole


def _shown(name: str, point: dict[str, float]) -> list[Figure]:
    return [
        Figure(f"{name}_cpu_percent", point["cpu_percent"], "% of a core"),
        Figure(f"{name}_rigs_cpu_percent", point["rigs_cpu_percent"], "% of a core"),
        Figure(f"{name}_memory_mb", point["memory_mb"], "MB"),
        Figure(f"{name}_loop_late_ms_p99", point["loop_late_ms_p99"], "ms", "below 5"),
        Figure(f"{name}_erased", point["erasures"] / point["samples"], "of symbols"),
        Figure(f"{name}_desyncs", point["desyncs"], "", "0"),
        Figure(f"{name}_rejoins", point["rejoins"], ""),
    ]


def measure(rigs: int, seconds: float, shards: int = 0) -> dict[str, float]:
    """Fly `rigs` rigs against one receiver, or against shards behind a router; return what was seen.

    CPU and memory are those of all receivers together, lateness that of the latest.
    """
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder, ExitStack() as started:

        def start(*arguments: str) -> subprocess.Popen[str]:
            return started.enter_context(_started(folder, *arguments))

        router: list[subprocess.Popen[str]] = []
        if shards:
            most = ("--connections-max", str(2 * rigs + shards))
            router = [start("tenbaud", "router", "--listen", endpoint, *most)]
        receivers = [
            start(
                *("tenbaud", "receive", "--sessions", pattern, "--preset", "tuned-10baud"),
                *("--router" if shards else "--listen", endpoint),
                *("--rigs-max", str(rigs), "--out", f"many-{index}", "--json"),
                # The first rig has its session long before the last, and waits for it without a word.
                *("--set", f"link.peer_timeout_s={TIMEOUT_S}"),
            )
            for index, pattern in enumerate(
                [session_pattern(shard) for shard in range(shards)] or [f"{NAME}/*"]
            )
        ]
        fleet = start("benchmarks.light_rigs", endpoint, str(rigs), str(seconds), str(shards))
        if fleet.stdout is None or fleet.stdout.readline() != "flying\n":
            raise RuntimeError("the rigs did not get their sessions")
        time.sleep(SETTLE_S)
        groups = {"cpu_percent": receivers, "rigs_cpu_percent": [fleet], "router_cpu_percent": router}
        since_s, before = time.monotonic(), {name: _cpu_s(group) for name, group in groups.items()}
        time.sleep(seconds - 2 * SETTLE_S)
        span_s = time.monotonic() - since_s
        cpu = {name: 100.0 * (_cpu_s(group) - before[name]) / span_s for name, group in groups.items()}
        memory_mb = sum(_resident_mb(one.pid) for one in receivers)
        seen: dict[str, Any] = json.loads(fleet.communicate(timeout=TIMEOUT_S)[0])
        summaries = [_ended(receiver) for receiver in receivers]
    flights = [flight for summary in summaries for flight in summary["flights"]]
    lost = sum(flight["recording_rows_lost"] for flight in flights)
    flown = round(seconds * SYMBOLS_PER_S) * rigs
    # A rig that rejoins, as some do where the cores do not suffice, counts the samples it skipped.
    if seen["samples"] < flown or (seen["samples"] > flown and not seen["rejoins"]):
        raise RuntimeError(
            f"the rigs flew {seen['samples']} of {flown} samples: some lost their sessions"
        )
    if len(flights) != rigs or lost:
        raise RuntimeError(f"{len(flights)} of {rigs} flights, {lost} rows lost")
    return {
        **seen,
        **cpu,
        "memory_mb": memory_mb,
        "loop_late_ms_p99": max(summary["loop_late_ms_p99"] for summary in summaries),
        "bytes_up_per_s": sum(flight["wire_bytes_up"] for flight in flights) / seconds,
        "bytes_down_per_s": sum(flight["wire_bytes_down"] for flight in flights) / seconds,
    }


def line_through(x: tuple[int, ...], y: list[float]) -> tuple[float, float]:
    """Return the slope of the straight line through points, and the share of variance it explains."""
    count = len(x)
    mean_x, mean_y = sum(x) / count, sum(y) / count
    products = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True))
    squares_x = sum((a - mean_x) ** 2 for a in x)
    squares_y = sum((b - mean_y) ** 2 for b in y)
    return products / squares_x, products**2 / (squares_x * squares_y) if squares_y else 1.0


@contextmanager
def _started(folder: str, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """Within a `with`, a process runs; one that is left over at the end is killed."""
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    quiet = subprocess.DEVNULL if arguments[0] == "tenbaud" else None
    process = subprocess.Popen(
        [sys.executable, "-m", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=quiet,
        text=True,
    )
    try:
        yield process
    finally:
        if process.poll() is None:
            process.kill()
            process.communicate()


def _ended(receiver: subprocess.Popen[str]) -> dict[str, Any]:
    receiver.send_signal(signal.SIGINT)
    out, _ = receiver.communicate(timeout=TIMEOUT_S)
    if not out:
        raise RuntimeError("a receiver ended without a summary")
    summary: dict[str, Any] = json.loads(out)
    return summary


def _cpu_s(processes: list[subprocess.Popen[str]]) -> float:
    ticks = 0
    for process in processes:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")


def _resident_mb(pid: int) -> float:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return 0.0
