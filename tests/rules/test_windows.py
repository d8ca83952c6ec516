"""No module uses what Windows lacks, unless it stands behind a test of the system.

It finds what would fail there with certainty; the rest needs a run on Windows.
"""

from __future__ import annotations

import re
from datetime import datetime
from pathlib import Path

import pytest

from tenbaud.recording.folder import create_run_folder
from tests.rules.sources import PACKAGES, files_below, report
from tests.rules.windows import findings_in

FOR_PEOPLE = {
    ("tenbaud/flight/trouble.py", "'%Y-%m-%d %H:%M:%S'"): "a line of text",
    ("tenbaud/keys/store.py", "'%Y-%m-%d %H:%M'"): "a line of text",
}
"""Times with colons that are in no name of a file."""


def excused(finding: str) -> bool:
    name, _, rest = finding.partition(":")
    return any(name == file and what in rest for file, what in FOR_PEOPLE)


def test_nothing_that_windows_lacks_is_used_without_a_branch() -> None:
    found = [line for name, source in files_below(*PACKAGES) for line in findings_in(source, name)]
    assert not [line for line in found if not excused(line)], report(found)
    assert len(found) == len(FOR_PEOPLE), "an excuse without its reason"


@pytest.mark.parametrize(
    "statement",
    [
        "import fcntl",
        "from termios import tcgetattr",
        "def f():\n    import pty",
        "from socket import AF_UNIX",
        "s = socket.socket(socket.AF_UNIX)",
        "os.kill(number, signal.SIGTERM)",
        "p.kill() if p is None else os.kill(p.pid, 9)",
        "if p is None:\n    os.fork()",
        "signal.signal(signal.SIGKILL, f)",
        "process.send_signal(signal.SIGINT)",
        "loop.add_signal_handler(2, f)",
        "asyncio.set_event_loop_policy(policy)",
        "flags = os.O_RDONLY | os.O_CLOEXEC",
        "text = path.read_text()",
        "path.write_text(text)",
        "open('a.txt')",
        "path.open('w')",
        "os.fdopen(3, 'w')",
        "subprocess.run(command, text=True)",
        "subprocess.Popen(command, text=True, **more)",
        "subprocess.Popen(command, preexec_fn=f)",
        "name = time.strftime('run-%H:%M')",
        "try:\n    import pty\nexcept OSError:\n    pass",
    ],
)
def test_what_windows_lacks_is_found(statement: str) -> None:
    assert len(findings_in(statement, "a.py")) >= 1


@pytest.mark.parametrize(
    "statement",
    [
        "try:\n    import fcntl\nexcept ImportError:\n    fcntl = None",
        "def f():\n    if os.name != 'posix':\n        return\n    import pty",
        "if hasattr(signal, 'SIGHUP'):\n    signal.signal(signal.SIGHUP, f)",
        "number = os.getuid() if hasattr(os, 'getuid') else 0",
        "is_there = hasattr(socket, 'AF_UNIX') and socket.AF_UNIX in known",
        "flags = os.O_RDONLY | getattr(os, 'O_NONBLOCK', 0)",
        "path.read_text(encoding='utf-8')",
        "path.read_text('utf-8')",
        "open('a.bin', 'rb')",
        "os.fdopen(3, 'wb')",
        "link.open(end)",
        "name = time.strftime('%H-%M')",
    ],
)
def test_what_windows_has_or_a_branch_keeps_from_it_passes(statement: str) -> None:
    assert findings_in(statement, "a.py") == []


def test_the_name_of_a_run_folder_may_be_one_on_windows(tmp_path: Path) -> None:
    made = create_run_folder(tmp_path, 'a:b?"c', None, datetime(2026, 11, 27, 23, 59, 59))
    assert not re.search(r'[<>:"/\\|?*]', made.name)
