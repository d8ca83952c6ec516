"""Two processes fly the narrow downlink over every line, whatever happens to it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from channel.links.endpoints import free_endpoint
from channel.links.serial.emulated import EmulatedLine
from tenbaud.flight.outcome import ExitCode
from tenbaud.recording.comparison import Verdict
from tenbaud.recording.diff import compare_runs
from tenbaud.recording.folder import RunFolder
from tests.channel.links.serial.noisy_line import NoisyLine
from tests.tenbaud.ends import Pair, over_serial, over_zenoh
from tests.tenbaud.processes import run
from tests.tenbaud.test_restarts import restart_often
from tests.tenbaud.test_serial_flight import Flown, fly, settings

NARROW = ("--set", "channel.downlink=narrow")
FAULTS = "loss=0.03,flip=0.02,delay=15ms±5ms,duplicate=0.1,up:cut=4s+0.3s,down:cut=7s+0.3s"


def flown_over(link: str, folder: Path, *arguments: str) -> tuple[RunFolder, dict[str, Any]]:
    """Fly the demo on the virtual clock; return its folder and its summary."""
    common = ("--json", "--duration", "12", "--mismatch", "0.1", "--clock", "virtual", *NARROW)
    ended = run("demo", "--link", link, "--out", link, *common, *arguments, cwd=folder)
    assert ended.code == 0, ended.err
    return RunFolder(folder / link), ended.summary


def test_over_every_link_it_is_the_same_flight_with_the_same_faults(tmp_path: Path) -> None:
    flights = {
        link: flown_over(link, tmp_path, "--impair", FAULTS) for link in ("memory", "zenoh", "serial")
    }
    reference, summary = flights["memory"]
    assert summary["impaired_down"].keys() >= {"lost", "flipped", "cut off", "duplicated"}
    over_zenoh, theirs = flights["zenoh"]
    assert theirs["wire_bytes_down"] == summary["wire_bytes_down"]
    for end in ("transmitter", "receiver"):
        compared = compare_runs(getattr(reference, end), getattr(over_zenoh, end))
        assert compared.verdict is Verdict.EQUAL, str(compared)
    # A byte has neither epoch nor whole slot, so a copy that comes late may be dropped or not.
    _, theirs = flights["serial"]
    narrow = theirs["narrow"]
    bytes_of_symbols = theirs["wire_bytes_down"] - narrow["control_bytes_down"]
    assert bytes_of_symbols < 1.2 * narrow["symbols_down"]
    assert theirs["symbols_per_s_kept"] > 5.0


def narrow_settings(**link: Any) -> dict[str, Any]:
    return {**settings(**link), "channel": {"downlink": "narrow"}}


def check_equal_where_confirmed(flown: Flown) -> None:
    ours = dict(zip(*(flown.sent.column("sample", name) for name in ("sample", "digest")), strict=True))
    theirs = zip(*(flown.received.column("sample", name) for name in ("sample", "digest")), strict=True)
    assert ours
    assert ours.items() <= dict(theirs).items()


@pytest.mark.real_time
def test_over_300_baud_a_byte_goes_down_for_each_symbol(tmp_path: Path) -> None:
    with EmulatedLine(tmp_path, 300) as line:
        flown = fly(line, {**narrow_settings(line_rate_baud=300), "duration_s": 3.0})
        carried = line.carried("down")
    meter = flown.receiver.downlink.meter
    assert meter.wire_bytes == meter.symbols + meter.control_bytes >= carried
    assert meter.coder_bits == meter.symbols
    if flown.receiver.downlink.refused or flown.transmitter.node.session.counts["words_missed"]:
        pytest.skip("the machine was too busy for the symbols' times")
    assert flown.outcome.code is ExitCode.OK, flown.outcome.text
    check_equal_where_confirmed(flown)
    assert 60 <= meter.symbols <= 64
    assert carried >= 60
    endpoint = flown.transmitter.endpoint
    assert endpoint.inlet.meter.symbols >= 58  # the last ones may come after the end
    # A symbol that is held up for an eighth of a second at either end changes it by so much.
    assert endpoint.down_baud.whole_baud == pytest.approx(20.0, abs=0.8)


@pytest.mark.real_time
def test_when_bytes_are_damaged_and_the_plug_is_out_then_no_wrong_state_is_confirmed(
    tmp_path: Path,
) -> None:
    with NoisyLine(tmp_path, 115_200, seed=6) as line:

        def disturb() -> None:
            for share in (0.1, 0.0):  # of bytes; no frame with a state could pass
                line.corrupt("up", share)
                line.corrupt("down", share)
                time.sleep(1.0)
            line.unplug()
            time.sleep(0.4)
            line.plug()

        flown = fly(line, {**narrow_settings(), "duration_s": 14.0}, disturb, stop_at=50)
        assert line.damaged["down"] > 0
    # On a busy machine fewer samples are confirmed than a flight needs to be called flown.
    usual = (ExitCode.INTERRUPTED, ExitCode.OK, ExitCode.NOT_FLOWN)
    assert flown.outcome.code in usual, flown.outcome.text
    assert flown.sent.column("sample", "sample")[-1] > 40, "nothing was confirmed after the plug was in"
    check_equal_where_confirmed(flown)
    assert flown.reconnects == 2
    assert flown.dropped["check bits"] > 0
    assert flown.transmitter.node.session.counts["down_erased"] > 0


def test_when_either_end_is_killed_and_started_again_then_the_flight_goes_on(tmp_path: Path) -> None:
    pair = Pair(tmp_path, over_zenoh(free_endpoint()), *NARROW)
    try:
        restart_often(pair, 2)
    finally:
        pair.close()


def test_when_an_end_on_a_serial_line_is_killed_then_the_flight_goes_on(tmp_path: Path) -> None:
    with EmulatedLine(tmp_path, 115_200) as line:
        pair = Pair(tmp_path, over_serial(line), *NARROW)
        try:
            restart_often(pair, 2)
        finally:
            pair.close()
