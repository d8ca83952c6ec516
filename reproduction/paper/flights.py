"""The flights behind the figures: what to fly, and flying it on two cores.

A flight with `processes` is the real thing, two processes over Zenoh on loopback, virtual clock, both
recorded. The others, whose errors alone are wanted, run the same two sessions in one process without
a recording; equal inputs give equal states there, which the tests of the demo hold.
"""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from channel.errors import TenbaudError
from reproduction.paper.curves import Curves

WORKERS = 2
ALONE = 6.0
"""weight of what takes less time in this process than workers take to start"""
GRACE_S = 3.0
"""The signal that ends a worker's flight when the command is interrupted."""

Overrides = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Job:
    """One flight to fly."""

    name: str
    preset: str
    overrides: Overrides = field(default_factory=dict)
    processes: bool = False
    window_start_s: float | None = None
    """where errors begin to count; None: where the flight's own summary begins"""
    keep_series: bool = False
    """whether the curves are wanted as well as the figures; for flights of two processes"""

    @property
    def weight(self) -> float:
        """Return roughly how long it takes, for the progress bar."""
        return 10.0 if self.processes else 1.0


@dataclass(frozen=True, slots=True)
class Flown:
    """The result of a job."""

    name: str
    summary: dict[str, Any]
    largest_rad: float
    rms_rad: float
    """of the codec's error"""
    pitch_rad: float
    """largest pitch in the window"""
    reference_rad: float
    curves: Curves | None = None

    @property
    def largest(self) -> float:
        """Return the largest error as a fraction of the largest pitch in the window."""
        return self.largest_rad / self.pitch_rad

    @property
    def rms(self) -> float:
        """Return the root-mean-square error as a fraction of the largest pitch in the window."""
        return self.rms_rad / self.pitch_rad

    @property
    def largest_of_reference(self) -> float:
        """Return the largest error as a fraction of the reference's amplitude."""
        return self.largest_rad / self.reference_rad if self.reference_rad else float("nan")


class Task(NamedTuple):
    """Something else to compute beside the flights: a function of a module, and its arguments."""

    name: str
    function: Callable[..., Any]
    arguments: tuple[Any, ...]
    weight: float = 3.0


def fly_all(
    jobs: Iterable[Job],
    folder: Path,
    tasks: Iterable[Task] = (),
    on_done: Callable[[str, float], None] = lambda name, weight: None,
) -> tuple[dict[str, Flown], dict[str, Any]]:
    """Fly every job and do every task, long ones first; return both by name.

    Two are done at a time, each by a worker process; a few short ones one by one in this process.
    """
    flights = [Task(job.name, fly, (job, folder), job.weight) for job in jobs]
    ordered = sorted([*flights, *tasks], key=lambda task: -task.weight)
    flown: dict[str, Flown] = {}
    others: dict[str, Any] = {}

    def keep(task: Task, result: Any) -> None:
        (flown if task.function is fly else others)[task.name] = result
        on_done(task.name, task.weight)

    if sum(task.weight for task in ordered) <= ALONE:
        for task in ordered:
            keep(task, task.function(*task.arguments))
        return flown, others
    # spawn: a forked child would inherit the locks of whatever threads the parent has.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(WORKERS, context, initializer=_leave_interrupts_to_parent) as pool:
        waiting: dict[Future[Any], Task] = {
            pool.submit(task.function, *task.arguments): task for task in ordered
        }
        try:
            for done in as_completed(waiting):
                keep(waiting[done], done.result())
        except BaseException:
            _end_workers()
            raise
    return flown, others


def _end_workers() -> None:
    """End the pool's processes: those in flight may first end their two ends, then no more waiting."""
    workers = multiprocessing.active_children()
    for worker in workers:
        worker.terminate()
    for worker in workers:
        worker.join(GRACE_S)
        worker.kill()


def _leave_interrupts_to_parent() -> None:
    """A Ctrl-C reaches the whole group; a worker that dies of it would leave its pool waiting."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def fly(job: Job, folder: Path) -> Flown:
    """Fly one job; TenbaudError says which one went wrong, and how."""
    from tenbaud.build.flight import agree
    from tenbaud.config.load import load_config

    agreement = agree(load_config(job.preset, None, job.overrides), "virtual")
    if job.processes:
        return _fly_processes(job, agreement, folder)
    return _fly_in_memory(job, agreement)


def _fly_processes(job: Job, agreement: Any, folder: Path) -> Flown:
    from reproduction.paper.curves import read_curves
    from tenbaud.flight.demo import fly_demo
    from tenbaud.recording.folder import RunFolder, create_run_folder

    run = RunFolder(create_run_folder(None, job.name, folder / job.name))
    result = fly_demo(agreement, run, lambda status: None, draw=False)
    if result.code or result.summary["desyncs"] or result.summary["recording_rows_lost"]:
        raise TenbaudError(f"flight {job.name}: {result.summary['outcome']} {result.messages}")
    start_s = result.summary["window_start_s"] if job.window_start_s is None else job.window_start_s
    curves = read_curves(run.transmitter, run.receiver)
    used = (curves.times_s >= start_s - 1e-9) & ~np.isnan(curves.coded_rad)
    error = (curves.pitch_rad - curves.coded_rad)[used]
    return Flown(
        job.name,
        result.summary,
        float(np.abs(error).max()),
        float(np.sqrt(np.mean(error**2))),
        float(np.abs(curves.pitch_rad[curves.times_s >= start_s - 1e-9]).max()),
        float(result.summary["reference_amplitude_rad"] or 0.0),
        curves if job.keep_series else None,
    )


def _fly_in_memory(job: Job, agreement: Any) -> Flown:
    from channel.protocol.wire import DATAGRAM
    from tenbaud.build.ends import build_receiver
    from tenbaud.flight import transmit
    from tenbaud.flight.summary import transmitter_part

    if job.window_start_s is not None:
        start = round(job.window_start_s / agreement.config.timing.tick_s)
        agreement = replace(agreement, scored_from=start)
    run = transmit.prepare(agreement, None, DATAGRAM)
    scores = run.node.scores
    peer = build_receiver(agreement, None, DATAGRAM)
    outcome = transmit.fly_virtual(run, peer, lambda: False)
    if outcome.code:
        raise TenbaudError(f"flight {job.name}: {outcome.text}")
    return Flown(
        job.name,
        transmitter_part(run, outcome),
        scores.first.coded.largest,
        scores.first.coded.rms or 0.0,
        scores.first.largest,
        scores.first.reference_largest,
    )
