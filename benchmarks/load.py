"""How many 10-baud rigs one receiver process serves in real time, and what each of them costs.

The receiver is `tenbaud receive --sessions`, recording every flight; the rigs are `light_rigs`, on the
same cores. CPU is that of the receiver's process, in percent of one core, while all are flying.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.figures import Figure
from benchmarks.light_rigs import NAME
from channel.links.endpoints import free_endpoint

RIGS = (5, 25, 50, 75, 100)
SECONDS = 10.0
SETTLE_S = 2.0
TIMEOUT_S = 90.0


def load_figures(rigs: tuple[int, ...] = RIGS, seconds: float = SECONDS) -> list[Figure]:
    """Return CPU, memory and lateness for each number of rigs, and how straight the two curves are."""
    points = [measure(number, seconds) for number in rigs]
    figures = []
    for number, point in zip(rigs, points, strict=True):
        figures += [
            Figure(f"load_{number}_rigs_cpu_percent", point["cpu_percent"], "% of a core"),
            Figure(f"load_{number}_rigs_memory_mb", point["memory_mb"], "MB"),
            Figure(
                f"load_{number}_rigs_loop_late_ms_p99",
                point["loop_late_ms_p99"],
                "ms",
                "below 5" if number <= 50 else "",
            ),
            Figure(f"load_{number}_rigs_erased", point["erasures"] / point["samples"], "of symbols"),
            Figure(f"load_{number}_rigs_desyncs", point["desyncs"], "", "0"),
        ]
    for name, unit in (("cpu_percent", "% of a core"), ("memory_mb", "MB")):
        slope, straightness = line_through(rigs, [point[name] for point in points])
        figures.append(Figure(f"load_{name}_per_rig", slope, unit))
        figures.append(Figure(f"load_{name}_linear_r2", straightness, "", "near 1"))
    within = [
        number
        for number, point in zip(rigs, points, strict=True)
        if point["loop_late_ms_p99"] < 5.0 and point["desyncs"] == 0
    ]
    return [*figures, Figure("load_rigs_within_5_ms", max(within, default=0), "rigs", "at least 50")]


def measure(rigs: int, seconds: float) -> dict[str, float]:
    """Fly so many rigs against one receiver process; return what they and the receiver saw."""
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        receiver = _start(
            folder,
            *("tenbaud", "receive", "--sessions", f"{NAME}/*", "--preset", "tuned-10baud"),
            *("--listen", endpoint, "--rigs-max", str(rigs), "--out", "many", "--json"),
        )
        fleet = _start(folder, "benchmarks.light_rigs", endpoint, str(rigs), str(seconds))
        try:
            if fleet.stdout is None or fleet.stdout.readline() != "flying\n":
                raise RuntimeError("the rigs did not get their sessions")
            time.sleep(SETTLE_S)
            cpu_s, since_s = _cpu_s(receiver.pid), time.monotonic()
            time.sleep(seconds - 2 * SETTLE_S)
            cpu_percent = 100.0 * (_cpu_s(receiver.pid) - cpu_s) / (time.monotonic() - since_s)
            memory_mb = _resident_mb(receiver.pid)
            seen: dict[str, Any] = json.loads(fleet.communicate(timeout=TIMEOUT_S)[0])
            receiver.send_signal(signal.SIGINT)
            out, err = receiver.communicate(timeout=TIMEOUT_S)
        finally:
            for process in (fleet, receiver):
                if process.poll() is None:
                    process.kill()
        if not out:
            raise RuntimeError(f"the receiver ended without a summary: {err}")
        summary = json.loads(out)
    lost = sum(flight["recording_rows_lost"] for flight in summary["flights"])
    if len(summary["flights"]) != rigs or lost:
        raise RuntimeError(f"{len(summary['flights'])} of {rigs} flights, {lost} rows lost")
    return {
        **seen,
        "cpu_percent": cpu_percent,
        "memory_mb": memory_mb,
        "loop_late_ms_p99": summary["loop_late_ms_p99"],
    }


def line_through(x: tuple[int, ...], y: list[float]) -> tuple[float, float]:
    """Return the slope of the straight line through points, and the share of variance it explains."""
    count = len(x)
    mean_x, mean_y = sum(x) / count, sum(y) / count
    products = sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y, strict=True))
    squares_x = sum((a - mean_x) ** 2 for a in x)
    squares_y = sum((b - mean_y) ** 2 for b in y)
    return products / squares_x, products**2 / (squares_x * squares_y) if squares_y else 1.0


def _start(folder: str, *arguments: str) -> subprocess.Popen[str]:
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        [sys.executable, "-m", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE if arguments[0] == "tenbaud" else None,
        text=True,
    )


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _resident_mb(pid: int) -> float:
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return 0.0
