"""The last line names what ended the flight, and not what followed from it."""

from __future__ import annotations

from pathlib import Path

from channel.links.serial.emulated import EmulatedLine
from tenbaud.flight.outcome import SAFE, ExitCode, Outcome, first_cause
from tests.tenbaud.ends import Pair, over_serial


def test_a_port_that_is_pulled_out_is_named(tmp_path: Path) -> None:
    (tmp_path / "line").mkdir()
    with EmulatedLine(tmp_path / "line", 115_200) as line:
        pair = Pair(tmp_path, over_serial(line), "--set", "link.peer_timeout_s=8")
        try:
            pair.wait_until_both_fly()
            line.unplug()
            code, summary = pair.receiver.ended()
        finally:
            pair.close()
    last = pair.receiver.said[-1]
    assert code == ExitCode.LINK_LOST
    assert last.startswith(f"tenbaud receiver: the serial port {line.receiver_port} was lost (")
    assert summary["outcome"] in last


def test_a_lost_line_comes_before_the_silence_that_it_causes() -> None:
    silence = Outcome(ExitCode.LINK_LOST, f"the receiver is gone; {SAFE}")
    told = first_cause(silence, "the serial port /dev/ttyUSB0 was lost (no such device)", SAFE)
    assert told.code is ExitCode.LINK_LOST
    assert told.text == f"the serial port /dev/ttyUSB0 was lost (no such device); {SAFE}"
    assert first_cause(silence, "", SAFE) == silence
    over = Outcome(ExitCode.OK, "the flight is over")
    assert first_cause(over, "the serial port was lost") == over
