"""Whole flights over a serial line: in this process on the real clock, and as a user runs them."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from channel.errors import LinkLost
from channel.links.serial.emulated import EmulatedLine
from tenbaud import MemoryRecorder
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.build.transmitter_run import TransmitterRun
from tenbaud.config.load import ConfigError, load_config
from tenbaud.flight import receive, transmit
from tenbaud.flight.ends import Endpoints, open_link
from tenbaud.flight.outcome import ExitCode, Outcome
from tenbaud.recording.comparison import Verdict
from tenbaud.recording.diff import compare_runs
from tenbaud.recording.folder import RunFolder
from tests.channel.links.serial.noisy_line import NoisyLine
from tests.tenbaud.confirmed import PATIENT, check_flown, need_idle
from tests.tenbaud.processes import run

BAUD_OFF = 0.17
"""What a symbol that is held up for 50 ms, at either end of three seconds, changes the rate by."""


@dataclass
class Flown:
    """What a flight left behind."""

    transmitter: TransmitterRun
    receiver: Any
    outcome: Outcome
    sent: MemoryRecorder
    received: MemoryRecorder
    dropped: dict[str, int]
    reconnects: int
    up_bytes: int
    """that the transmitter's link put on the line, from opening to closing"""

    def assert_nothing_silent(self) -> None:
        ours = self.sent.column("sample", "digest")
        theirs = self.received.column("sample", "digest")
        assert self.transmitter.node.session.counts["confirmed"] == len(ours) > 0
        assert self.transmitter.node.session.counts["desyncs"] == 0
        assert ours == theirs[: len(ours)]


def fly(
    line: EmulatedLine,
    overrides: dict[str, Any],
    meanwhile: Callable[[], None] = lambda: None,
    stop_at: int | None = None,
) -> Flown:
    """Fly both ends over a line on the real clock, the receiver on a separate thread.

    `meanwhile` runs on another thread once the flight has begun. With `stop_at` the flight is stopped
    when this sample or a later one is confirmed and `meanwhile` has returned.
    """
    config = load_config("paper-10baud", None, overrides)
    agreement = agree(config, "real")
    sent, received = MemoryRecorder(), MemoryRecorder()
    over = threading.Event()
    with ExitStack() as stack:
        ends = []
        for role, port in (
            ("receiver", line.receiver_port),
            ("transmitter", line.transmitter_port),
        ):
            section = config.link.model_copy(update={"port": str(port)})
            changed = agree(config.model_copy(update={"link": section}), "real")
            ends.append(stack.enter_context(open_link(changed, role, Endpoints())))  # type: ignore[arg-type]
        lower, upper = ends
        endpoint = build_receiver(agreement, received, lower.wire)
        service = threading.Thread(
            target=lambda: _serve(agreement, endpoint, lower, over.is_set), name="receiver"
        )
        service.start()
        run_up = transmit.prepare(agreement, sent, upper.wire)

        def should_stop() -> bool:
            if stop_at is None or intruder.is_alive():
                return False
            return max(sent.column("sample", "sample"), default=-1) >= stop_at

        def interfere() -> None:
            while not over.is_set() and run_up.node.tick < 100:
                over.wait(0.02)
            meanwhile()

        intruder = threading.Thread(target=interfere, name="meanwhile")
        intruder.start()
        try:
            outcome = transmit.fly_real(run_up, upper, should_stop)
        finally:
            over.set()
            intruder.join()
            service.join()
    dropped = dict(upper.counts.dropped + lower.counts.dropped)
    reconnects = upper.counts.reconnects + lower.counts.reconnects
    up_bytes = upper.counts.line_bytes_out
    return Flown(run_up, endpoint, outcome, sent, received, dropped, reconnects, up_bytes)


def _serve(agreement: Any, endpoint: Any, link: Any, should_stop: Callable[[], bool]) -> None:
    try:
        receive.serve(agreement, endpoint, link, should_stop)
    except LinkLost:
        return  # the transmitter's outcome tells


def settings(**link: Any) -> dict[str, Any]:
    return {
        "duration_s": 5.0,
        "link": {"kind": "serial", "port": "given by the test", **link},
        "transmitter": {"watchdog_s": 30.0, "plant": {"mismatch": 0.1}},
    }


@pytest.mark.real_time
def test_when_it_flies_at_ten_baud_then_ten_bytes_a_second_go_up_and_ten_baud_are_measured(
    tmp_path: Path,
) -> None:
    with EmulatedLine(tmp_path, 115_200) as line:
        flown = fly(line, settings() | {"duration_s": 3.0})
        carried = line.carried("up")
    assert flown.outcome.code is ExitCode.OK, flown.outcome.text
    flown.assert_nothing_silent()
    meter = flown.transmitter.uplink.meter
    symbol_bytes = meter.wire_bytes - meter.control_bytes
    assert symbol_bytes == meter.symbols == meter.coder_bits
    # A busy machine may hold the loop up past a slot, which is then an erasure and no byte.
    missed = flown.transmitter.node.session.counts["words_missed"]
    assert symbol_bytes + missed + flown.transmitter.uplink.refused == 30
    # Beside the symbols only the handshake, the farewell and the links' own notices.
    assert carried == flown.up_bytes
    assert not flown.dropped
    if missed or flown.transmitter.node.commands_late:
        pytest.skip("the machine was too busy for the symbols' times")
    assert flown.receiver.session.meter.baud == pytest.approx(10.0, abs=BAUD_OFF)


@pytest.mark.real_time
def test_when_the_line_has_2400_baud_then_the_compact_downlink_flies_over_it(tmp_path: Path) -> None:
    compact = {**settings(line_rate_baud=2400), "duration_s": 3.0}
    with EmulatedLine(tmp_path, 2400) as line:
        flown = fly(line, {**compact, "channel": {"downlink": "compact"}})
        carried = line.carried("down")
    flown.assert_nothing_silent()
    assert flown.outcome.code is ExitCode.OK, flown.outcome.text
    downlink = flown.receiver.downlink
    samples = flown.receiver.session.counts["samples"]
    assert downlink.meter.command_bytes == 16 * samples >= 16 * 30
    # 19 bytes of each frame on the line; beside them the welcome.
    assert downlink.meter.wire_bytes - 19 * samples < 200
    assert carried >= 19 * 30
    node = flown.transmitter.node
    if node.session.counts["words_missed"] or node.commands_late:
        pytest.skip("the machine was too busy for the symbols' times")
    assert "line busy" not in flown.dropped
    assert flown.receiver.session.meter.whole_baud == pytest.approx(10.0, abs=BAUD_OFF)


def test_when_the_line_damages_bytes_then_no_divergence_is_silent(tmp_path: Path) -> None:
    # Up, one byte in five; down, as much as frames of this size stand for some seconds.
    with NoisyLine(tmp_path, 460_800, seed=6) as line:

        def corrupt() -> None:
            line.corrupt("up", 0.2)
            line.corrupt("down", 0.001)

        changed = settings(line_rate_baud=460_800)
        flown = fly(line, {**changed, "channel": {"repeats": 6}}, corrupt)
        assert line.damaged["up"] > 0
        assert line.damaged["down"] > 0
    assert flown.outcome.code in (ExitCode.OK, ExitCode.LINK_LOST), flown.outcome.text
    flown.assert_nothing_silent()
    assert flown.dropped


def test_when_garbage_storms_over_the_uplink_then_the_flight_goes_on(tmp_path: Path) -> None:
    import random
    import time

    chooser = random.Random(9)
    with NoisyLine(tmp_path, 115_200) as line:

        def storm() -> None:
            for _ in range(40):
                line.inject("up", chooser.randbytes(30))
                time.sleep(0.025)

        flown = fly(line, settings(), storm)
    assert flown.outcome.code is ExitCode.OK, flown.outcome.text
    flown.assert_nothing_silent()
    assert flown.dropped["check bits"] > 100
    # After the storm symbols are taken again.
    words = flown.received.column("sample", "word")
    assert any(word is not None for word in words[-10:])


def test_when_the_plug_is_out_for_a_moment_then_slots_are_erased_and_the_flight_goes_on(
    tmp_path: Path,
) -> None:
    import time

    with EmulatedLine(tmp_path, 921_600) as line:

        def pull() -> None:
            line.unplug()
            time.sleep(0.4)
            line.plug()

        changed = settings(line_rate_baud=921_600)
        flown = fly(line, {**changed, "channel": {"repeats": 32}}, pull)
    assert flown.outcome.code is ExitCode.OK, flown.outcome.text
    flown.assert_nothing_silent()
    assert flown.reconnects == 2
    assert flown.dropped["unplugged"] > 0
    assert flown.receiver.session.counts["erasures"] >= 3
    words = flown.received.column("sample", "word")
    assert any(word is not None for word in words[-10:])


def test_when_the_plug_stays_out_then_the_motors_go_to_their_safe_voltage(tmp_path: Path) -> None:
    with EmulatedLine(tmp_path, 115_200) as line:
        changed = settings()
        changed["transmitter"] = {"watchdog_s": 0.3, "ramp_s": 0.2}
        flown = fly(line, changed, line.unplug)
    assert flown.outcome.code is ExitCode.LINK_LOST
    assert "safe voltage" in flown.outcome.text
    assert flown.transmitter.node.guard.command == (0.0, 0.0)


def test_when_the_line_is_too_slow_then_it_is_refused_with_the_arithmetic() -> None:
    with pytest.raises(ConfigError, match=r"168 bytes.*16800 bit/s.*9600 baud"):
        agree(load_config(None, None, settings(line_rate_baud=9600)), "real")
    with pytest.raises(ConfigError, match=r"10 symbols/s x 1 byte x 10 line bits = 100 bit/s"):
        agree(load_config(None, None, settings(line_rate_baud=75, downlink="zenoh")), "real")
    # With the commands elsewhere, 110 baud carry ten symbols a second.
    slow = agree(load_config(None, None, settings(line_rate_baud=110, downlink="zenoh")), "real")
    assert slow.terms.uplink_line_ns == pytest.approx(90.9e6, rel=1e-3)
    assert slow.terms.lead_ticks == 13
    second = settings(line_rate_baud=110, downlink="other", downlink_rate_baud=9600)
    with pytest.raises(ConfigError, match="16800 bit/s"):
        agree(load_config(None, None, second), "real")


def test_when_the_lead_leaves_no_time_for_the_line_then_it_is_refused() -> None:
    short = settings()
    short["timing"] = {"lead_ticks": 4}
    with pytest.raises(ConfigError, match=r"14\.6 ms for a command frame .* lead_ticks >= 5"):
        agree(load_config(None, None, short), "real")


@pytest.mark.parametrize(("clock", "byte_ns"), [("virtual", 0), ("real", 10**10 // 2400 + 1)])
def test_when_the_clock_is_virtual_then_the_welcome_takes_no_time_on_a_slow_line(
    clock: Any, byte_ns: int
) -> None:
    slow = {**settings(line_rate_baud=2400), "channel": {"downlink": "narrow"}}
    # The first symbol is expected from the end of the welcome on.
    assert agree(load_config(None, None, slow), clock).terms.downlink_byte_ns == byte_ns


@pytest.mark.parametrize("clock", ["virtual", pytest.param("real", marks=pytest.mark.real_time)])
def test_when_the_demo_flies_over_a_serial_line_then_it_is_the_flight_of_any_link(
    clock: str, tmp_path: Path
) -> None:
    seconds = 3 if clock == "real" else 8
    common = ["--json", "--duration", str(seconds), "--mismatch", "0.1", "--clock", clock, *PATIENT]
    ended = run("demo", "--link", "serial", "--out", "serial", *common, cwd=tmp_path)
    assert ended.code == 0, ended.err
    summary = ended.summary
    assert summary["link"] == "serial"
    check_flown(summary, 10 * seconds)
    assert summary["line_bytes_out"] > 10 * seconds
    if clock == "real":
        need_idle(summary)
        assert summary["baud_measured"] == pytest.approx(10.0, abs=BAUD_OFF)
        return
    memory = run("demo", "--link", "memory", "--out", "memory", *common, cwd=tmp_path)
    assert memory.code == 0, memory.err
    serial_run, memory_run = RunFolder(tmp_path / "serial"), RunFolder(tmp_path / "memory")
    for one, other in (
        (serial_run.transmitter, memory_run.transmitter),
        (serial_run.receiver, memory_run.receiver),
    ):
        compared = compare_runs(one, other)
        assert compared.verdict is Verdict.EQUAL, str(compared)
    assert memory.summary["coder_bits_up"] == summary["coder_bits_up"]
    # One byte where a datagram has fifteen.
    assert memory.summary["wire_bytes_up"] - summary["wire_bytes_up"] == 80 * 14 - 2 * 3


def test_when_the_uplink_is_slow_and_the_commands_come_back_on_another_port_then_it_flies(
    tmp_path: Path,
) -> None:
    ended = run(
        *("demo", "--json", "--link", "serial", "--line-rate", "300", "--downlink", "second"),
        *("--clock", "real", "--duration", "5", "--mismatch", "0", "--out", "slow", *PATIENT),
        cwd=tmp_path,
    )
    assert ended.code == 0, ended.err
    summary = ended.summary
    check_flown(summary, 50)
    assert summary["lead_ticks"] == 8  # 20 + 10 + 33.3 + 14.6 ms


def test_when_endpoints_are_given_to_a_serial_end_then_it_says_what_to_give_instead(
    tmp_path: Path,
) -> None:
    ended = run(
        *("receive", "--link", "serial", "--port", "x", "--listen", "tcp/127.0.0.1:1"), cwd=tmp_path
    )
    assert ended.code == 2
    assert "--port" in ended.err


def test_when_a_serial_end_has_no_port_then_it_asks_for_one(tmp_path: Path) -> None:
    ended = run("transmit", "--link", "serial", cwd=tmp_path)
    assert ended.code == 2
    assert "--port /dev/ttyUSB0" in ended.err
