"""How the tests share the machine: what they compile, in which order they start, who has both cores."""

from __future__ import annotations

import fcntl
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

# Some hundred processes are started here. Without bytecode on disk each compiles all that it imports,
# which takes longer than most flights.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

LONGEST_FIRST = ("tests/docs/",)
"""What takes longest: started last, it would keep one worker busy and the others idle."""

_MACHINE = Path(tempfile.gettempdir()) / f"tenbaud-tests-{os.getuid()}.lock"


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Bring tests of one module-wide fixture together on one worker, and the longest to the front."""
    for item in items:
        shared = _shared_fixture(item)
        if shared and item.get_closest_marker("xdist_group") is None:
            item.add_marker(pytest.mark.xdist_group(item.nodeid.partition("::")[0]))
    items.sort(key=_rank)


def _shared_fixture(item: pytest.Item) -> bool:
    """Return whether a fixture that is made once per module is among the test's."""
    found = getattr(item, "_fixtureinfo", None)
    definitions = found.name2fixturedefs.values() if found else ()
    return any(one.scope == "module" for several in definitions for one in several)


def _rank(item: pytest.Item) -> int:
    if item.get_closest_marker("both_cores") is not None:
        return len(LONGEST_FIRST) + 1  # at the end, when no module-wide fixture is at work any more
    ranks = [rank for rank, start in enumerate(LONGEST_FIRST) if item.nodeid.startswith(start)]
    return ranks[0] if ranks else len(LONGEST_FIRST)


@pytest.fixture(autouse=True)
def _the_machine(request: pytest.FixtureRequest) -> Iterator[None]:
    """Keep every other test on the real clock from running beside one that needs both cores."""
    if request.node.get_closest_marker("real_time") is None:
        yield
        return
    alone = request.node.get_closest_marker("both_cores") is not None
    with _MACHINE.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        yield
