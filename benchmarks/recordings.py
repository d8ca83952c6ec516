"""A flight of ten minutes at 100 Hz: how large it is, how long its files take to convert and to open.

The flight has a command lead and the noise of a real line, as its recording is then largest. Converting
is timed with the start of Python, opening with the imports that it needs.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.figures import Figure
from channel.links.endpoints import free_endpoint
from tenbaud import Run
from tenbaud.recording.convert import FORMS

MINUTES = 10
KILLED_AFTER_S = 6.0
STARTED_S = 60.0
TOP = Path(__file__).parents[1]

OPEN = """
import sys, time
started = time.perf_counter()
from tenbaud import Run
run = Run(sys.argv[1])
run.pitch
opened = time.perf_counter()
run.signals
print(opened - started, time.perf_counter() - started)
"""


LONG_TICKS = 1_000_000
LONG = """
import math, resource, sys, time
from pathlib import Path
from channel.codec.models.pitch import PITCH_SIGNALS
from receiver.session import records as receiver
from tenbaud.flight.report import draw_figure
from tenbaud.recording.folder import RunFolder
from tenbaud.recording.overview import OverviewRecorder
from tenbaud.recording.writer import McapRecorder
from transmitter.session import records as transmitter

def peak_mib():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

folder, ticks = RunFolder(Path(sys.argv[1])), int(sys.argv[2])
upper, lower = (
    McapRecorder(path, {}, wait_when_full=True, overview=OverviewRecorder(PITCH_SIGNALS))
    for path in (folder.transmitter, folder.receiver)
)
begin_mib, digest = None, "0123456789abcdef"
for tick in range(ticks):
    if tick == ticks // 100:
        begin_mib = peak_mib()
    at, pitch = tick * 10_000_000, math.sin(tick * 0.003)
    row = (tick, tick / 100, (pitch,), (pitch,), (0.5, -0.5), (0.5, -0.5), False, 0.1, "running")
    upper.write(transmitter.TICK_CHANNEL, at, row)
    states = ((pitch + 0.01, 0.1, 0.2, 0.3), (pitch + 0.02, 0.1, 0.2, 0.3))
    upper.write(transmitter.ESTIMATE_CHANNEL, at, (tick, *states))
    lower.write(receiver.TICK_CHANNEL, at, (tick, (0.3,), states[0], (0.5, -0.5)))
    if tick % 10 == 0:
        word = (1 if tick % 3 else -1,)
        end = ((0.1,), states[0], (0.1, 1.0), digest)
        upper.write(transmitter.SAMPLE_CHANNEL, at, (tick // 10, word, word, *end, digest, 1, (0,)))
        lower.write(receiver.SAMPLE_CHANNEL, at, (tick // 10, word, *end, tick / 100))
flown = time.perf_counter()
upper.close()
lower.close()
assert not (upper.error or lower.error)
draw_figure(folder, "a long flight")
print(time.perf_counter() - flown, peak_mib() - begin_mib)
"""


def recording_figures(minutes: int = MINUTES, long_ticks: int = LONG_TICKS) -> list[Figure]:
    """Return sizes and times of a run of some minutes, and what a killed pair of processes lost."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seconds = str(60 * minutes)
        _tenbaud(
            folder,
            *("demo", "--json", "--duration", seconds, "--delivery", "end", "--out", "run"),
            *("--mismatch", "0.1", "--disturbance", "q=2e-3"),
        )
        run = folder / "run"
        sizes = {end: (run / f"{end}.mcap").stat().st_size / 1e6 for end in ("transmitter", "receiver")}
        figures = [Figure(f"recording_{end}_mb", size, "MB", "") for end, size in sizes.items()]
        total = sum(sizes.values())
        figures.append(Figure("recording_both_ends_mb", total, "MB", "below 15"))
        figures += [_conversion(folder, form) for form in FORMS]
        opened, everything = _opening(folder)
        figures.append(Figure("run_opens_s", opened, "s", "below 1"))
        figures.append(Figure("run_all_signals_s", everything, "s", ""))
        figures.append(_timed(folder, "replay_s", "replay", "run"))
        figures.append(_timed(folder, "audit_s", "audit", "run"))
        figures += long_flight_end(folder, long_ticks)
        return figures + _killed(folder)


def long_flight_end(folder: Path, ticks: int = LONG_TICKS) -> list[Figure]:
    """Record a long flight without flying it; return what its end takes: both files and the figure.

    The memory is what the process has at its end over what it had after the first hundredth.
    """
    run = folder / "long"
    run.mkdir()
    done = subprocess.run(
        [sys.executable, "-c", LONG, str(run), str(ticks)],
        env=_environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    end_s, more_mib = map(float, done.stdout.split())
    return [
        Figure("long_flight_end_s", end_s, "s", "at most 20"),
        Figure("long_flight_more_mib", more_mib, "MiB", "at most 150"),
    ]


def _conversion(folder: Path, form: str) -> Figure:
    return _timed(folder, f"convert_{form}_s", "convert", "run", "--to", form, asked="below 10")


def _timed(folder: Path, name: str, *arguments: str, asked: str = "") -> Figure:
    started = time.perf_counter()
    _tenbaud(folder, *arguments)
    return Figure(name, time.perf_counter() - started, "s", asked)


def _opening(folder: Path, rounds: int = 3) -> tuple[float, float]:
    """Return the best of some rounds: until the first signal is there, and until all are."""
    times = []
    for _ in range(rounds):
        done = subprocess.run(
            [sys.executable, "-c", OPEN, "run"],
            cwd=folder,
            env=_environment(),
            capture_output=True,
            text=True,
            check=True,
        )
        opened, everything = map(float, done.stdout.split())
        times.append((opened, everything))
    return min(times)


def _killed(folder: Path) -> list[Figure]:
    """Kill both ends of a flight on the real clock; return how much of it each had not written."""
    endpoint = free_endpoint()
    shared = ("--clock", "real", "--status", "none")
    commands = {
        "receiver": ("receive", "--listen", endpoint, "--out", "lower", *shared),
        "transmitter": (
            *("transmit", "--connect", endpoint, "--out", "upper", "--duration", "3600"),
            *shared,
        ),
    }
    ends = {
        role: subprocess.Popen(
            [sys.executable, "-m", "tenbaud", *arguments],
            cwd=folder,
            env=_environment(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        for role, arguments in commands.items()
    }
    _until_recorded(folder / "upper" / "transmitter.mcap")
    time.sleep(KILLED_AFTER_S)
    killed_s = time.time()
    for process in ends.values():
        process.send_signal(signal.SIGKILL)
        process.wait()
    figures = []
    for role, place in (("transmitter", "upper"), ("receiver", "lower")):
        # The last row reached the file when the file was last written; ticks are 10 ms apart.
        run = Run(folder / place)
        written_s = (folder / place / f"{role}.mcap").stat().st_mtime
        assert len(run.time_s) > 100, f"the {role} had not flown yet"
        figures.append(Figure(f"killed_{role}_loses_s", killed_s - written_s, "s", "at most 1"))
    return figures


def _until_recorded(path: Path) -> None:
    """Wait until a flight that has just been started has written something."""
    give_up_s = time.monotonic() + STARTED_S
    while not path.is_file() or path.stat().st_size == 0:
        if time.monotonic() > give_up_s:
            raise RuntimeError(f"nothing was recorded in {path}")
        time.sleep(0.05)


def _tenbaud(folder: Path, *arguments: str) -> None:
    subprocess.run(
        [sys.executable, "-m", "tenbaud", *arguments],
        cwd=folder,
        env=_environment(),
        check=True,
        capture_output=True,
    )


def _environment() -> dict[str, str]:
    path = os.pathsep.join([str(TOP), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": path}
