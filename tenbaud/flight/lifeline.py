"""Child processes that end with their parent, for any cause.

The parent holds a pipe to the child's standard input and never writes to it. The operating system
closes it with the parent, also when that was killed and could tell nobody.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from _thread import interrupt_main
from typing import Any

IS_POSIX = os.name == "posix"
VARIABLE = "TENBAUD_ENDS_WITH_STDIN"


def start_child(*arguments: str, **more: Any) -> subprocess.Popen[str]:
    """Start `tenbaud` with these arguments as a child that ends when this process does.

    It has a separate group: a Ctrl-C at the terminal reaches it through its parent only. `more` goes
    to `subprocess.Popen`.
    """
    return subprocess.Popen(
        [sys.executable, "-m", "tenbaud", *arguments],
        stdin=subprocess.PIPE,
        encoding="utf-8",
        start_new_session=True,
        env={**os.environ, VARIABLE: "1", "PYTHONIOENCODING": "utf-8"},
        **more,
    )


def interrupt_child(child: subprocess.Popen[str]) -> None:
    """Ask a child to end as after Ctrl-C.

    Windows has no signal between processes that leaves time to end: there its standard input is closed,
    as if this process had ended.
    """
    if IS_POSIX:
        child.send_signal(signal.SIGINT)
    elif child.stdin is not None:
        child.stdin.close()


def end_child(child: subprocess.Popen[str], timeout_s: float) -> None:
    """End a child and wait for it: its resources, such as a port, are free then."""
    if child.poll() is None:
        if IS_POSIX:
            child.terminate()
            child.send_signal(signal.SIGCONT)  # one that was stopped would not hear the other
        else:
            interrupt_child(child)
    try:
        child.wait(timeout_s)
    except subprocess.TimeoutExpired:
        child.kill()
        child.wait()


def follow_parent() -> None:
    """In a process of `start_child`: ask this process to end when its parent has gone."""
    if os.environ.pop(VARIABLE, None) is not None:
        threading.Thread(target=_follow, name="lifeline", daemon=True).start()


def _follow() -> None:
    while os.read(0, 4096):
        pass
    if IS_POSIX:
        os.kill(os.getpid(), signal.SIGTERM)
    else:  # where `os.kill` would end the process before its handler has run
        interrupt_main(signal.SIGTERM)
