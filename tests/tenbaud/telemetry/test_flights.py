"""Telemetry of whole flights, as a viewer of any kind gets it, and flights that are steered."""

from __future__ import annotations

import json
import math
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from channel.links.endpoints import free_endpoint
from tenbaud.recording.comparison import Verdict
from tenbaud.recording.diff import compare_runs
from tenbaud.recording.reader import Recording
from tenbaud.sentences.events import event_text
from tenbaud.telemetry.schema import TELEMETRY, ReceiverTelemetry, TransmitterTelemetry
from tests.tenbaud.processes import Ended, finish, run, start


class Watched:
    """Two ends and a viewer of both."""

    def __init__(self, folder: Path, *arguments: str, transmitter: tuple[str, ...] = ()) -> None:
        from channel.links.zenoh.telemetry import TelemetryFeed

        link, *places = (free_endpoint() for _ in range(3))
        shared = ["--json", *arguments]
        self.lower = start(
            *("receive", "--listen", link, "--out", "lower", "--telemetry", places[0], *shared),
            cwd=folder,
        )
        self.upper = start(
            *("transmit", "--connect", link, "--out", "upper", "--telemetry", places[1], *shared),
            *transmitter,
            cwd=folder,
        )
        self.received: list[bytes] = []
        self.feeds = []
        for place in places:
            self.feeds.append(
                _patiently(lambda at=place: TelemetryFeed(at, "**", self.received.append))
            )

    def messages(self) -> list[TransmitterTelemetry | ReceiverTelemetry]:
        return [TELEMETRY.validate_json(data) for data in list(self.received)]

    def newest(self, role: str) -> Any:
        found = [message for message in self.messages() if message.role == role]
        return found[-1] if found else None

    def wait(self, met: Callable[[], object], seconds: float = 240.0) -> None:
        until_s = time.monotonic() + seconds
        while not met():
            assert time.monotonic() < until_s, self.received[-1:]
            time.sleep(0.02)

    def send(self, **command: object) -> None:
        for feed in self.feeds:
            feed.send("helicopter", json.dumps(command).encode())

    def stopped(self) -> tuple[Ended, Ended]:
        """Interrupt the flight; return both ends."""
        self.upper.send_signal(signal.SIGINT)
        return self.ended()

    def ended(self) -> tuple[Ended, Ended]:
        return finish(self.upper), finish(self.lower)


def _patiently(do: Callable[[], Any]) -> Any:
    from channel.errors import LinkError

    until_s = time.monotonic() + 240.0
    while True:
        try:
            return do()
        except LinkError:
            assert time.monotonic() < until_s
            time.sleep(0.05)


@contextmanager
def watched(folder: Path, *arguments: str, transmitter: tuple[str, ...] = ()) -> Iterator[Watched]:
    pair = Watched(folder, *arguments, transmitter=transmitter)
    try:
        yield pair
    finally:
        for feed in pair.feeds:
            feed.close()
        for process in (pair.upper, pair.lower):
            if process.poll() is None:
                process.kill()
                process.wait()


def controls(path: Path) -> list[str]:
    rows = [row for _, row in Recording(path).rows("event")]
    return [event_text(row) for row in rows if row["kind"] == "control"]


def corrupt_until_found(pair: Watched, end: str) -> None:
    """Corrupt a codec of a narrow flight until it is found: one change in ten vanishes unseen."""

    def rejoins() -> int:
        return int(pair.newest("transmitter").counts["rejoins"])

    before = rejoins()
    while rejoins() == before:
        pair.send(kind="corrupt", end=end)
        until_s = pair.newest("transmitter").time_s + 5.0
        pair.wait(lambda end_s=until_s: rejoins() > before or pair.newest("transmitter").time_s > end_s)


def test_when_a_narrow_flight_is_watched_then_a_corrupt_codec_of_either_end_is_found(
    tmp_path: Path,
) -> None:
    narrow = ("--set", "channel.downlink=narrow", "--clock", "virtual", "--allow-control")
    with watched(tmp_path, *narrow, transmitter=("--duration", "3600", "--pace", "5")) as pair:
        pair.wait(lambda: (up := pair.newest("transmitter")) and up.narrow and up.narrow.confirmed_to)
        for end in ("transmitter", "receiver"):
            corrupt_until_found(pair, end)
        known = pair.newest("transmitter").narrow
        while known.rest >= 1.0:  # it asks for the receiver's state
            pair.wait(lambda before=known: pair.newest("transmitter").narrow != before)
            known = pair.newest("transmitter").narrow
        pair.stopped()
    assert (known.baud_configured, known.is_mirrored) == (20.0, True)
    assert known.size >= 1
    assert known.hash_symbols > 0
    assert known.confirmed_to > 0
    assert known.rest > 0.0


def test_when_a_flight_is_looked_at_then_every_message_keeps_to_the_schema(tmp_path: Path) -> None:
    with watched(tmp_path, "--clock", "real", transmitter=("--duration", "600")) as pair:
        # However late the viewer finds the flight.
        pair.wait(lambda: pair.newest("transmitter") and pair.newest("receiver"))
        began = pair.newest("transmitter").time_s
        pair.wait(lambda: pair.newest("transmitter").time_s > began + 3.5)
        upper, lower = pair.stopped()
        assert (upper.code, lower.code) == (130, 0), upper.err + lower.err
        messages = pair.messages()
    sent = [one for one in messages if isinstance(one, TransmitterTelemetry)]
    taken = [one for one in messages if isinstance(one, ReceiverTelemetry)]
    samples = [sample for one in sent for sample in one.samples]
    numbers = [sample.sample for sample in samples]
    assert numbers == sorted(set(numbers))
    assert len(numbers) > 25
    assert all(sample.digest == sample.peer_digest for sample in samples)
    times = [point.time_s for one in sent for point in one.points]
    assert times == sorted(times)
    assert len(times) > 30
    assert {tuple(point.reference) for one in taken for point in one.points} == {(math.pi / 2.0,)}
    assert any(one.lateness is not None and one.lateness.p99_ms >= 0.0 for one in sent)
    assert sent[-1].phase == "ended"
    for one in messages:
        assert one.plant.model == "pitch"
        assert [(signal.name, signal.unit) for signal in one.plant.outputs] == [("pitch", "rad")]
        assert [signal.name for signal in one.plant.inputs] == ["front", "rear"]
    assert not any(one.takes_commands for one in messages)
    assert upper.summary["telemetry"] == "on"
    assert upper.summary["telemetry_sent"] >= len(sent)


def test_when_a_flight_is_watched_and_could_be_steered_then_it_is_the_same_flight(
    tmp_path: Path,
) -> None:
    flown = ("--preset", "paper-10baud", "--clock", "virtual", "--lead", "3")
    alone = ("--duration", "20", "--mismatch", "0.1", "--disturbance", "q=2e-3")
    # Paced, so that it still goes on when the viewer has found it.
    paced = (*alone, "--pace", "4")
    with watched(tmp_path, *flown, "--allow-control", transmitter=paced) as pair:
        upper, lower = pair.ended()
        assert (upper.code, lower.code) == (0, 0)
        assert pair.received
    for end in (upper, lower):
        assert "every user of this machine" in end.err
    unwatched = run(
        *("demo", *flown, *alone, "--out", "alone", "--json", "--link", "memory"), cwd=tmp_path
    )
    assert unwatched.code == 0, unwatched.err
    for end in ("transmitter", "receiver"):
        folder = "upper" if end == "transmitter" else "lower"
        compared = compare_runs(tmp_path / folder / f"{end}.mcap", tmp_path / "alone" / f"{end}.mcap")
        assert compared.verdict is Verdict.EQUAL, str(compared)


def test_when_a_flight_is_steered_then_every_command_takes_hold_and_is_written_down(
    tmp_path: Path,
) -> None:
    flight = ("--duration", "90", "--pace", "1")
    how = ("--clock", "virtual", "--allow-control")
    with watched(tmp_path, *how, transmitter=flight) as pair:
        pair.wait(lambda: pair.newest("receiver"))
        pair.wait(lambda: pair.newest("transmitter") and pair.newest("transmitter").time_s > 0.5)
        pair.send(kind="set_point", value=0.25)
        pair.wait(lambda: pair.newest("receiver").set_points == [0.25])
        pair.send(kind="pause", paused=True)
        pair.wait(lambda: pair.newest("transmitter").paused)
        stood = pair.newest("transmitter").time_s
        pair.send(kind="step", samples=3)
        pair.wait(
            lambda: pair.newest("transmitter").time_s > stood and pair.newest("transmitter").paused
        )
        assert pair.newest("transmitter").time_s == pytest.approx(stood + 0.3)
        pair.send(kind="corrupt", end="receiver")
        pair.send(kind="pause", paused=False)
        pair.wait(lambda: pair.newest("transmitter").counts["desyncs"] == 1)
        pair.send(kind="corrupt", end="transmitter", field="angle")
        pair.wait(lambda: pair.newest("transmitter").counts["rejoins"] == 2)
        pair.send(kind="impair", text="up:loss=0.5")
        pair.wait(lambda: pair.newest("transmitter").counts["erasures"] > 5)
        assert pair.newest("transmitter").impairments == "up:loss=0.5"
        pair.send(kind="nonsense")
        pair.send(kind="pace", factor=1000.0)
        upper, lower = pair.ended()
    assert (upper.code, lower.code) == (0, 0), upper.err + lower.err
    assert upper.summary["desyncs"] == 2
    assert upper.summary["commands_refused"] == 1
    assert upper.summary["impaired_up"]["lost"] > 100
    told = controls(tmp_path / "upper" / "transmitter.mcap")
    assert [text.split(": ")[1].split()[0] for text in told] == [
        *("pause", "pause", "continue", "one", "the", "1000.0")
    ]
    down = controls(tmp_path / "lower" / "receiver.mcap")
    assert [text.split(": ")[1].split()[0] for text in down] == ["set-point", "one"]
    ticks = [row for _, row in Recording(tmp_path / "lower" / "receiver.mcap").rows("tick")]
    steered = next(row["tick"] for row in ticks if row["reference"] == [0.25])
    assert f"before sample {steered // 10}:" in down[0]
    assert all(row["reference"] == [0.25] for row in ticks if row["tick"] >= steered)


def test_when_control_is_not_allowed_then_commands_do_nothing(tmp_path: Path) -> None:
    flight = ("--duration", "3600", "--pace", "4")
    with watched(tmp_path, "--clock", "virtual", transmitter=flight) as pair:
        pair.wait(lambda: pair.newest("transmitter") and pair.newest("transmitter").time_s > 0.5)
        for command in ({"kind": "set_point", "value": 0.1}, {"kind": "pause", "paused": True}):
            pair.send(**command)
        pair.send(kind="corrupt", end="receiver", field="range")
        sent_s = pair.newest("transmitter").time_s
        pair.wait(lambda: pair.newest("transmitter").time_s > sent_s + 4.0)
        upper, lower = pair.stopped()
    assert (upper.code, lower.code) == (130, 0)
    assert upper.summary["desyncs"] == 0
    assert not controls(tmp_path / "upper" / "transmitter.mcap")
    assert not controls(tmp_path / "lower" / "receiver.mcap")


def test_when_telemetry_is_off_then_nothing_listens_and_the_summary_says_so(tmp_path: Path) -> None:
    from tests.tenbaud.processes import fly_pair

    upper, lower = fly_pair(
        tmp_path,
        *("--clock", "virtual", "--telemetry", "off"),
        transmitter={"arguments": ["--duration", "2"]},
    )
    assert (upper.summary["telemetry"], lower.summary["telemetry"]) == ("off", "off")


def test_when_the_codec_learns_its_plant_then_viewers_get_what_it_learned(tmp_path: Path) -> None:
    flown = ("--preset", "helicopter-10baud", "--clock", "virtual")
    with watched(tmp_path, *flown, transmitter=("--duration", "20", "--pace", "4")) as pair:
        pair.wait(lambda: pair.newest("transmitter") and pair.newest("transmitter").time_s > 1.0)
        learned = pair.newest("transmitter").learned
        assert {"travel_thrust", "pitch_force"} <= set(learned)
        assert all(deviation > 0.0 for _, deviation in learned.values())
