"""Whole flights of two processes over Zenoh on loopback: speed, lateness, memory."""

from __future__ import annotations

import json
import os
import pty
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from benchmarks.figures import Figure
from channel.links.endpoints import free_endpoint

WARM_UP_FRACTION = 0.15


class FlightFailed(RuntimeError):
    """A flight that was to be measured did not end as it should."""


def virtual_figures(rounds: int = 5) -> list[Figure]:
    """Return how many times faster than real time a recorded 100 s flight at 10 baud goes."""
    factors = sorted(demo_summary("--mismatch", "0.1")["realtime_factor"] for _ in range(rounds))
    return [
        Figure("virtual_realtime_factor", factors[len(factors) // 2], "times", "at least 100"),
        Figure("virtual_realtime_factor_best", factors[-1], "times", ""),
    ]


def real_figures(duration_s: float = 20.0) -> list[Figure]:
    """Return the lateness of a 100 Hz loop and the baud rate on the receiver's clock."""
    summary = demo_summary("--clock", "real", "--duration", str(duration_s))
    asked = {"p50": "", "p99": "at most 2", "max": ""}
    lateness = [
        Figure(f"loop_late_ms_{name}", summary[f"loop_late_ms_{name}"], "ms", asked[name])
        for name in asked
    ]
    return [*lateness, Figure("baud_measured", summary["baud_measured"], "baud", "10.0 +- 0.1")]


def fly_figures(rounds: int = 3) -> list[Figure]:
    """Return how long `fly` takes for 100 s of four states at 10 bit/s, with design and recordings."""
    import control

    from tenbaud import fly

    plant = control.ss(
        [[0, 1, 0, 0], [-3, -1, 1, 0], [0, 0, 0, 1], [1, 0, -3, -1]],
        [[0, 0], [1, 0], [0, 0], [0, 1]],
        [[1, 0, 0, 0], [0, 0, 1, 0]],
        0,
    )
    times = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(rounds):
            started = time.perf_counter()
            run = fly(plant, rate_baud=10, reference=[0.5, -0.2], out=Path(folder) / str(number))
            times.append(time.perf_counter() - started)
            if run.summary["digest_checks"] != 1000:
                raise FlightFailed(str(run.summary["outcome"]))
    return [
        Figure("fly_first_s", times[0], "s", "at most 3"),
        Figure("fly_again_s", sorted(times[1:])[(rounds - 1) // 2], "s", "at most 3"),
    ]


def memory_figures(ticks: int = 1_000_000) -> list[Figure]:
    """Return by how much each process grows over a long virtual flight, after a warm-up."""
    duration_s = ticks * 0.01
    sizes: dict[str, list[tuple[float, float]]] = {"transmit": [], "receive": []}
    with tempfile.TemporaryDirectory() as folder:
        endpoint = free_endpoint()
        pair = {
            "receive": _start(folder, "receive", "--listen", endpoint, "--out", "lower"),
            "transmit": _start(
                folder,
                "transmit",
                "--connect",
                endpoint,
                "--duration",
                str(duration_s),
                "--no-figure",  # the library that draws it would be taken for growth
                "--out",
                "upper",
            ),
        }
        started = time.monotonic()
        while pair["transmit"].poll() is None:
            for name, process in pair.items():
                size = _resident_mb(process.pid)
                if size is not None:
                    sizes[name].append((time.monotonic() - started, size))
            time.sleep(0.25)
        for process in pair.values():
            process.communicate(timeout=60)
    figures = []
    for name, seen in sizes.items():
        warm = [size for at, size in seen if at >= WARM_UP_FRACTION * seen[-1][0]]
        grown = max(warm[-5:]) - warm[0]
        role = "transmitter" if name == "transmit" else "receiver"
        figures.append(Figure(f"memory_growth_{role}_mb", grown, "MB", "at most 5"))
        figures.append(Figure(f"memory_{role}_mb", warm[-1], "MB", ""))
    return figures


def cold_start_figures(rounds: int = 7) -> list[Figure]:
    """Return how long `tenbaud --help`, `import tenbaud` and the first output of a demo take."""

    def median_s(command: list[str], run: Callable[[list[str]], object]) -> float:
        times = []
        for _ in range(rounds):
            started = time.perf_counter()
            run([sys.executable, *command])
            times.append(time.perf_counter() - started)
        return sorted(times)[rounds // 2]

    def run(command: list[str]) -> None:
        subprocess.run(command, check=True, capture_output=True)

    loaded_s = median_s(["-c", "import tenbaud"], run) - median_s(["-c", ""], run)
    first_s = median_s(["-m", "tenbaud", "demo", "--link", "memory"], _until_first_output)
    return [
        Figure("cold_start_help_s", median_s(["-m", "tenbaud", "--help"], run), "s", "at most 0.5"),
        Figure("import_tenbaud_s", loaded_s, "s", "at most 0.15"),
        Figure("first_output_of_demo_s", first_s, "s", "at most 0.5"),
    ]


def _until_first_output(command: list[str]) -> None:
    """Run a command on a terminal until it shows something, then end it."""
    ours, theirs = pty.openpty()
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1]), "TERM": "xterm"}
        process = subprocess.Popen(command, stdout=theirs, stderr=theirs, cwd=folder, env=environment)
        os.close(theirs)
        os.read(ours, 1)
        process.kill()
        process.wait()
    os.close(ours)


def demo_summary(*arguments: str) -> dict[str, Any]:
    """Fly `tenbaud demo` with these arguments; return its summary."""
    with tempfile.TemporaryDirectory() as folder:
        ended = _start(folder, "demo", "--out", "run", *arguments, clock=None)
        out, err = ended.communicate()
        if ended.returncode:
            raise FlightFailed(f"tenbaud demo {' '.join(arguments)} failed:\n{err}")
        summary: dict[str, Any] = json.loads(out)
        return summary


def _start(folder: str, *arguments: str, clock: str | None = "virtual") -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "tenbaud", *arguments, "--json"]
    if clock is not None:
        command += ["--clock", clock]
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    return subprocess.Popen(
        command,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def _resident_mb(pid: int) -> float | None:
    try:
        text = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return None
    for line in text.splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return None
