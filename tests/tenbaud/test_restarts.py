"""Two real processes that are killed, stopped and cut off, and come back by themselves."""

from __future__ import annotations

import random
import signal
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from channel.links.endpoints import free_endpoint
from channel.links.serial.emulated import EmulatedLine
from tenbaud.recording.reader import Recording
from tests.tenbaud.ends import Pair, Relay, over_serial, over_zenoh

SEED = 20240619
SAFE_VOLTS = [0.0, 0.0]
WATCHDOG_S = 0.5
SAMPLE_S = 0.1
LEAD_S = 0.3
"""At most: from the beginning of an epoch, or its agreement if that is later, to its first command."""


@pytest.fixture
def pair(tmp_path: Path) -> Iterator[Pair]:
    pair = Pair(tmp_path, over_zenoh(free_endpoint()))
    yield pair
    pair.close()


def ticks_of(folder: Path) -> list[dict[str, Any]]:
    return [row for _, row in Recording(folder / "transmitter.mcap").rows("tick")]


def check_plant(folder: Path) -> None:
    """Whatever happened, the motors had finite voltages within limits, and none when silent.

    An epoch starts the watchdog's time again when it is agreed on, from when its first command is
    owed: a guard that was on its way to the safe command holds until then what it had reached.
    """
    silent_s = 0.0
    events = Recording(folder / "transmitter.mcap").rows("event")
    agreed = sorted(
        (row["time_s"], row["sample"] * SAMPLE_S)
        for _, row in events
        if row["kind"] in ("started", "rejoin")
    )
    for row in ticks_of(folder):
        assert all(-5.0 <= value <= 5.0 for value in row["applied"]), row
        silent_s = 0.0 if row["commanded"] is not None else silent_s + 0.01
        while agreed and agreed[0][0] <= row["time_s"]:
            agreed_s, begins_s = agreed.pop(0)
            silent_s = -(max(begins_s - agreed_s, 0.0) + LEAD_S)
        if silent_s > WATCHDOG_S + 1.0 + 0.05:
            assert row["applied"] == SAFE_VOLTS, row
            assert row["guard"] in ("latched", "ready")


def restart_often(pair: Pair, times: int) -> None:
    chance = random.Random(SEED)
    pair.wait_until_both_fly()
    flown = [pair.transmitter.folder]
    killed = {"receive": 0, "transmit": 0}
    rejoins = 0
    for index in range(times):
        time.sleep(chance.uniform(0.0, 1.5))
        verb = chance.choice(("receive", "transmit")) if index > 1 else ("receive", "transmit")[index]
        killed[verb] += 1
        if verb == "receive":
            pair.receiver.kill()
            # Long enough, now and then, for the watchdog to take the motors down.
            time.sleep(chance.choice((0.0, 2.0)))
            rejoins += 1
        else:
            pair.transmitter.kill()
            rejoins = 0
        end = pair.start(verb)
        if verb == "transmit":
            flown.append(end.folder)
        pair.wait_until_both_fly()
    code, summary = pair.transmitter.stop_politely()
    assert code == 130, pair.transmitter.said
    assert summary["desyncs"] == 0
    assert summary["rejoins"] >= rejoins
    assert min(killed.values()) >= 1
    code, _ = pair.receiver.ended()
    assert code == 0, pair.receiver.said
    for folder in flown:
        check_plant(folder)


def test_when_either_end_is_killed_and_started_again_then_the_flight_goes_on(pair: Pair) -> None:
    restart_often(pair, 3)


def test_when_an_end_on_a_serial_line_is_killed_and_started_again_then_the_flight_goes_on(
    tmp_path: Path,
) -> None:
    with EmulatedLine(tmp_path, 115_200) as line:
        pair = Pair(tmp_path, over_serial(line))
        try:
            restart_often(pair, 3)
        finally:
            pair.close()


@pytest.mark.soak
def test_when_the_ends_are_killed_twenty_times_then_the_flight_goes_on(pair: Pair) -> None:
    restart_often(pair, 20)


@pytest.mark.parametrize("verb", ["receive", "transmit"])
def test_when_an_end_is_stopped_for_a_while_then_the_flight_goes_on(pair: Pair, verb: str) -> None:
    pair.wait_until_both_fly()
    process = (pair.receiver if verb == "receive" else pair.transmitter).process
    process.send_signal(signal.SIGSTOP)
    time.sleep(5.0)
    process.send_signal(signal.SIGCONT)
    time.sleep(0.3)
    pair.wait_until_both_fly()
    code, summary = pair.transmitter.stop_politely()
    assert code == 130
    assert summary["desyncs"] == 0
    assert summary["samples"] > 25
    pair.receiver.ended()
    check_plant(pair.transmitter.folder)


def test_when_the_line_is_muted_or_cut_then_the_flight_goes_on(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    relay = Relay(int(endpoint.rpartition(":")[2]))
    pair = Pair(tmp_path, over_zenoh(endpoint, f"tcp/127.0.0.1:{relay.port}"))
    try:
        pair.wait_until_both_fly()
        for corrupt, seconds in ((relay.mute, 1.0), (relay.cut, 3.0)):
            corrupt(seconds)
            time.sleep(0.3)
            pair.wait_until_both_fly()
        code, summary = pair.transmitter.stop_politely()
        assert code == 130
        assert summary["desyncs"] == 0
        assert summary["rejoins"] >= 1
        assert summary["guard_rearmed"] >= 1
        check_plant(pair.transmitter.folder)
    finally:
        pair.close()
        relay.close()


def test_when_a_restarted_end_has_another_configuration_then_it_is_refused(pair: Pair) -> None:
    pair.wait_until_both_fly()
    pair.transmitter.kill()
    pair.arguments = ("--set", "coder.decay=0.9")
    stranger = pair.start("transmit")
    code, _ = stranger.ended()
    assert code == 3
    assert "coder.decay: here 0.9, there 0.95" in "\n".join(stranger.said)
    pair.arguments = ()
    pair.start("transmit")
    pair.wait_until_both_fly()
