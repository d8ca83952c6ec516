"""The publisher: its own thread, its own pace, and never an end to the flight."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable

from channel.errors import LinkError
from tenbaud.telemetry.publisher import Publisher


class Counting:
    def __init__(self) -> None:
        self.skipped = 0
        self.number = 0
        self.watched = False

    @property
    def tap(self) -> Counting:
        return self

    def watch(self, watched: bool) -> None:
        self.watched = watched

    def compose(self) -> dict[str, object]:
        self.number += 1
        return {"number": self.number, "thread": threading.current_thread().name}


class Port:
    def __init__(self, act: Callable[[], None] = lambda: None) -> None:
        self.sent: list[dict[str, object]] = []
        self.closed = False
        self.watched = True
        self._act = act

    def is_watched(self) -> bool:
        return self.watched

    def publish(self, data: bytes) -> None:
        self._act()
        self.sent.append(json.loads(data))

    def close(self) -> None:
        self.closed = True


def wait_until(met: Callable[[], bool]) -> None:
    until_s = time.monotonic() + 10.0
    while not met():
        assert time.monotonic() < until_s
        time.sleep(0.005)


def test_messages_leave_from_a_thread_of_their_own_and_the_last_word_is_said() -> None:
    composer, port = Counting(), Port()
    with Publisher(composer, port, 200.0) as publisher:
        wait_until(lambda: len(port.sent) >= 5)
        before = len(port.sent)
    assert len(port.sent) > before
    assert publisher.sent == len(port.sent) == composer.number
    assert {message["thread"] for message in port.sent} == {"telemetry"}
    assert port.closed


def test_while_nobody_watches_nothing_is_composed_until_somebody_does() -> None:
    composer, port = Counting(), Port()
    port.watched = False
    composer.watched = True
    with Publisher(composer, port, 200.0) as publisher:
        wait_until(lambda: not composer.watched)
        assert composer.number == 0
        port.watched = True
        wait_until(lambda: len(port.sent) >= 2)
    assert composer.watched
    assert publisher.sent == composer.number == len(port.sent)


def test_when_the_network_holds_it_up_then_periods_are_left_out_and_counted() -> None:
    composer, port = Counting(), Port(lambda: time.sleep(0.05))
    with Publisher(composer, port, 100.0) as publisher:
        wait_until(lambda: len(port.sent) >= 4)
    assert publisher.composer.skipped >= 4
    assert publisher.error is None


def test_when_the_network_refuses_then_it_is_counted_and_tried_again() -> None:
    failures = iter([True, True, False])

    def act() -> None:
        if next(failures, False):
            raise LinkError("gone")

    composer, port = Counting(), Port(act)
    with Publisher(composer, port, 200.0) as publisher:
        wait_until(lambda: len(port.sent) >= 2)
    assert publisher.composer.skipped >= 2
    assert publisher.error is None


def test_when_composing_fails_then_the_telemetry_ends_and_says_why() -> None:
    composer, port = Counting(), Port()
    composer.compose = lambda: {"x": object()}  # type: ignore[method-assign]
    with Publisher(composer, port, 200.0) as publisher:
        wait_until(lambda: publisher.error is not None)
    assert "telemetry ended" in str(publisher.error)
    assert port.closed
