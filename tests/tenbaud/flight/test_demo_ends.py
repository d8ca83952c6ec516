"""How `tenbaud demo` treats one end when the other one fails."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.flight import demo
from tenbaud.flight.outcome import ExitCode
from tenbaud.flight.stop import StopFlag
from tenbaud.flight.viewing import viewed
from tenbaud.recording.folder import RunFolder

ENDS = {
    "receive": 'print(\'{{"samples": {samples}, "exit_code": 7}}\'); raise SystemExit(7)',
    "transmit": 'import time; time.sleep(1.5); print(\'{{"samples": {samples}, "exit_code": 7}}\'); '
    "raise SystemExit(7)",
}
"""Processes that write a summary but no status, as in a flight of less than 0.2 s."""


@pytest.mark.parametrize("samples", [2, 0])
def test_the_end_that_flew_is_left_to_end_its_flight(
    samples: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start_child(verb: str, *_: str, **pipes: Any) -> subprocess.Popen[str]:
        code = ENDS[verb].format(samples=samples)
        return subprocess.Popen([sys.executable, "-c", code], text=True, **pipes)

    monkeypatch.setattr(demo, "start_child", start_child)
    dismissed: list[str] = []
    interrupt = demo._Child.interrupt
    monkeypatch.setattr(
        demo._Child, "interrupt", lambda self: (dismissed.append(self.role), interrupt(self))
    )
    agreement = agree(load_config("paper-10baud", None, {}), "virtual")
    with StopFlag() as stop:
        result = demo._fly_processes(agreement, RunFolder(tmp_path), lambda _: None, viewed(), stop)
    assert result.code is ExitCode.NOT_FLOWN
    assert dismissed == ([] if samples else ["transmitter"])
    assert len(result.messages) == (2 if samples else 1)
