"""How a process ends its children, and follows its parent, on systems with and without signals."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from functools import partial

import pytest

from tenbaud.flight import lifeline

FOLLOWS = """
import time
from tenbaud.flight import lifeline
from tenbaud.flight.stop import StopFlag
lifeline.IS_POSIX = {is_posix}
with StopFlag() as stop:
    lifeline.follow_parent()
    print("ready", flush=True)
    for _ in range(1000):
        if stop():
            print("farewell")
            break
        time.sleep(0.02)
"""


@pytest.mark.parametrize("is_posix", [True, False])
@pytest.mark.parametrize("ask", [lifeline.interrupt_child, partial(lifeline.end_child, timeout_s=20.0)])
def test_a_child_that_is_asked_to_end_says_farewell(
    is_posix: bool, ask: Callable[[subprocess.Popen[str]], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lifeline, "IS_POSIX", is_posix)
    monkeypatch.setenv(lifeline.VARIABLE, "1")
    child = subprocess.Popen(
        [sys.executable, "-c", FOLLOWS.format(is_posix=is_posix)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        encoding="utf-8",
    )
    assert child.stdout is not None
    try:
        assert child.stdout.readline() == "ready\n"
        ask(child)
        assert child.stdout.read() == "farewell\n"
        assert child.wait(20.0) == 0
    finally:
        child.kill()
        child.wait()
