"""How the tests share the machine: what they compile, in which order they start, who has both cores."""

from __future__ import annotations

import fcntl
import gc
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests import warm

# Some hundred processes are started here. Without bytecode on disk each compiles all that it imports,
# which takes longer than most flights.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
# Beside other tests the threads of the linear algebra mostly wait for each other, and wait by spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# A figure takes longer than most flights; what looks at one asks for it.
os.environ.setdefault("TENBAUD_FIGURE", "0")
# A run that a shell started in the background ignores Ctrl-C; so would each process that it starts.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)

COMPILED_ONCE = (
    "tests/tenbaud/studies/test_equal_bits.py",
    "tests/tenbaud/identify/test_identify_command.py",
    "tests/tenbaud/studies/test_quick.py",
)
"""Their tests stay together: the first compiles a flight, the others read its machine code."""

WITH_CONTROL = (
    "tests/tenbaud/flight/test_systems.py",
    "tests/tenbaud/flight/test_refused_systems.py",
    "tests/tenbaud/recording/test_steps.py",
    "tests/channel/codec/models/test_linear.py",
    "tests/plant_sim/test_linear.py",
)
"""Their tests stay together: one worker imports python-control, and designs each coder once."""

WITH_TABLES = ("tests/tenbaud/log/",)
"""They stay together: one worker imports pandas and what reads the files of other programs."""

LONGEST_FIRST = (
    *COMPILED_ONCE,
    "tests/docs/",
    "tests/tenbaud/view/",
    "tests/network/",
    "tests/examples/",
    "tests/tenbaud/test_restarts.py",
    "tests/tenbaud/telemetry/test_flights.py",
    "tests/tenbaud/test_emulated_flights.py",
    "tests/tenbaud/test_serial_flight.py",
    "tests/tenbaud/test_processes.py",
)
"""What takes or waits longest: started last, it would keep one worker busy and the others idle."""

COMPILED_BEFORE = "[docs/howto/your-log.md]"
"""A page that flies what those above compile: it begins after they have begun, finds most of their
machine code, and waits for the flight that one of them compiles then."""

PAGES = "tests/docs/test_commands.py::test_when_a_page_is_typed_in_then"
"""On two workers, each with one process that has imported everything (`tests/docs/prepared.py`)."""

COLD = (
    "tests/tenbaud/endings/test_containers.py",
    "tests/tenbaud/endings/test_nonsense.py",
    "tests/tenbaud/endings/test_short_commands.py",
    "tests/tenbaud/endings/test_signals.py::test_a_demo_ends",
    "tests/tenbaud/endings/test_signals.py::test_a_lasting_command",
    "tests/tenbaud/endings/test_signals.py::test_what_is_interrupted",
    "tests/tenbaud/endings/test_streams.py",
    "tests/tenbaud/test_restarts.py::test_when_the_ends_are_killed_twenty_times",
    "tests/tenbaud/view/test_gate.py",
    "tests/tenbaud/view/test_beside.py",
    "tests/network/test_pages.py",
    "tests/docs/",
)
"""Tests of processes as the system shows them: theirs are ordinary ones. Elsewhere a process begins
with everything imported (`tests/warm.py`): it disturbs less what flies on the real clock beside it. The
commands of a page are copies of another kind (`tests/docs/prepared.py`)."""

_MACHINE = Path(tempfile.gettempdir()) / f"tenbaud-tests-{os.getuid()}.lock"


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Bring the longest to the front."""
    items.sort(key=_rank)


def pytest_configure() -> None:
    """Collect no garbage while tests are collected: all of that stays."""
    gc.disable()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Let as many workers collect at a time as there are cores.

    In a fresh checkout the first ones write the bytecode of the tests and the libraries, and the others
    read it. All at once, each would compile all of it.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    if not worker:
        return (yield)
    place = int(worker.removeprefix("gw")) % (os.cpu_count() or 1)
    with _MACHINE.with_suffix(f".{place}").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        return (yield)


def pytest_collection_finish() -> None:
    """Let the garbage collector pass over what all tests together have imported."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Keep the tests of a file with a module-wide fixture on one worker, so that it is made once."""
    from xdist.scheduler import LoadScopeScheduling

    config.option.loadscopereorder = False  # the longest first, not the files with the most tests

    class ByFixture(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.partition("::")[0]
            for group in (COMPILED_ONCE, WITH_CONTROL, WITH_TABLES):
                if file.startswith(group):
                    return group[0]
            if nodeid.startswith(PAGES) and not nodeid.endswith(COMPILED_BEFORE):
                return f"{PAGES}{nodeid.count('/') % 2}"
            return file if _has_shared_fixture(config.rootpath / file) else nodeid

    return ByFixture(config, log)


@cache
def _has_shared_fixture(path: Path) -> bool:
    return '(scope="module")' in path.read_text(encoding="utf-8")


def _rank(item: pytest.Item) -> int:
    if item.get_closest_marker("both_cores") is not None:
        return len(LONGEST_FIRST) + 1  # at the end, when no module-wide fixture is at work any more
    if item.nodeid.endswith(COMPILED_BEFORE):
        return len(LONGEST_FIRST)
    if not item.nodeid.startswith(LONGEST_FIRST):
        return len(LONGEST_FIRST)
    return next(rank for rank, start in enumerate(LONGEST_FIRST) if item.nodeid.startswith(start))


@pytest.fixture(scope="session")
def _server() -> Iterator[warm.Server | None]:
    server = warm.Server() if warm.CLONE is not None else None
    subprocess.Popen = warm.Popen  # type: ignore[misc]
    yield server
    warm.Popen.server = None
    if server is not None:
        server.close()


@pytest.fixture(autouse=True)
def _warm(request: pytest.FixtureRequest, _server: warm.Server | None) -> None:
    """Let the processes of most tests begin with everything imported."""
    warm.Popen.server = None if request.node.nodeid.startswith(COLD) else _server


@pytest.fixture(autouse=True)
def _the_machine(request: pytest.FixtureRequest) -> Iterator[None]:
    """Keep every other test on the real clock from running beside one that needs both cores."""
    if request.node.get_closest_marker("real_time") is None:
        yield
        return
    alone = request.node.get_closest_marker("both_cores") is not None
    with _MACHINE.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        try:
            yield
        finally:
            fcntl.flock(lock, fcntl.LOCK_UN)  # a process that the test forked may still have it open
