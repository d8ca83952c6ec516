"""Running a study: in this process, in a pool of processes, or on a Dask cluster.

With any of them, the figures of a chunk come back here and are kept at once. What is kept stays kept:
after a kill, or when workers vanish for good, the same command goes on with what is missing.
"""

from __future__ import annotations

import logging
import os
import queue
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from importlib import import_module
from multiprocessing import get_context, parent_process
from typing import Any

from tenbaud.studies.chunk import ChunkResult, ChunkTask, fly_chunk, task_of
from tenbaud.studies.compiled import require
from tenbaud.studies.settings import StudyError
from tenbaud.studies.study import Study
from tenbaud.studies.table import Results

POOLS_MAX = 5
"""This many times a pool is made anew after one of its processes was killed."""

WORKERS_AWAITED_S = 60.0
"""How long a cluster may be without any worker."""

OnChunk = Callable[[int, int], None]
"""(flights done, of how many)"""


def run_study(
    study: Study, results: Results, on_chunk: OnChunk, workers: int = 1, scheduler: str | None = None
) -> Any:
    """Fly what is missing of a study; return the whole table.

    StudyError when it could not be finished; what was finished is kept and is not flown again.
    """
    if study.file.engine != "plain":
        require("numba")
    done = results.prepare()
    missing = [index for index in range(study.chunks) if index not in done]
    flown = sum(len(study.chunk(index)) for index in done)
    on_chunk(flown, study.flights)
    tasks = (task_of(study, index) for index in missing)
    if scheduler is not None:
        flying = _on_cluster(list(tasks), scheduler)
    elif workers > 1 and len(missing) > 1:
        flying = flying_in_pool(list(tasks), min(workers, len(missing)))
    else:
        flying = (fly_chunk(task) for task in tasks)
    for result in flying:
        results.write(result)
        flown += len(result.figures)
        on_chunk(flown, study.flights)
    return results.join()


def flying_in_pool(tasks: list[ChunkTask], workers: int) -> Iterator[ChunkResult]:
    """Fly chunks in a pool of processes, in the order of completion; a killed process is replaced."""
    left = {task.chunk: task for task in tasks}
    for _ in range(POOLS_MAX):
        try:
            yield from _in_one_pool(left, workers)
        except BrokenProcessPool:
            continue
        return
    raise StudyError(
        f"worker processes ended {POOLS_MAX} times without a message (killed, or out of memory?); "
        f"{len(left)} of {len(tasks)} chunks are missing. Run the same command again to continue"
    )


def _in_one_pool(left: dict[int, ChunkTask], workers: int) -> Iterator[ChunkResult]:
    """Fly the missing chunks, in the order of completion; BrokenProcessPool when a process died."""
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_end_with_parent)
    try:
        for future in as_completed([pool.submit(fly_chunk, task) for task in left.values()]):
            result = future.result()
            del left[result.chunk]
            yield result
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _end_with_parent() -> None:
    """Let this process end when the one that started it does, however that ends."""
    parent = parent_process()

    def await_it() -> None:
        if parent is not None:
            parent.join()
            os._exit(1)

    threading.Thread(target=await_it, daemon=True).start()


def _on_cluster(tasks: list[ChunkTask], scheduler: str) -> Iterator[ChunkResult]:
    """Fly on a Dask cluster; a worker that vanishes has its chunks flown by another."""
    require("distributed")
    distributed: Any = import_module("distributed")
    try:
        client = distributed.Client(scheduler, timeout=5.0)
    except (OSError, TimeoutError, ValueError) as error:
        raise StudyError(f"no Dask scheduler answers at {scheduler}: {error}") from error
    # What it says of workers and connections that come and go is said below, in one line.
    for part in ("client", "utils"):
        logging.getLogger(f"distributed.{part}").setLevel(logging.CRITICAL)
    with client:
        finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
        futures = client.map(fly_chunk, tasks, pure=False, retries=2)
        for future in futures:
            future.add_done_callback(finished.put)
        seen = time.monotonic()
        for left in range(len(futures), 0, -1):
            while True:
                try:
                    future = finished.get(timeout=2.0)
                    break
                except queue.Empty:
                    seen = _look_for_workers(client, seen, left)
            yield _result_of(future, left)
            seen = time.monotonic()


def _look_for_workers(client: Any, seen: float, left: int) -> float:
    """Return when a worker was last there; StudyError when there has been none for too long."""
    if client.status == "running" and client.scheduler_info(n_workers=-1)["workers"]:
        return time.monotonic()
    if time.monotonic() - seen > WORKERS_AWAITED_S:
        raise StudyError(
            f"the cluster has had no worker for {WORKERS_AWAITED_S:g} s; {left} chunks are missing. "
            "Run the same command again to continue"
        )
    return seen


def _result_of(future: Any, left: int) -> ChunkResult:
    try:
        result: ChunkResult = future.result()
    except StudyError:
        raise
    except Exception as error:
        raise StudyError(
            f"the cluster gave a chunk up: {type(error).__name__}: {error}; {left} chunks are missing. "
            "Run the same command again to continue"
        ) from error
    return result
