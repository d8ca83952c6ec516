"""The schema of the telemetry: the committed file, and what a command may be."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tenbaud.telemetry.command_queue import WAITING_MAX, CommandQueue
from tenbaud.telemetry.schema import Impair, SetPoint, schema_json

COMMITTED = Path(__file__).parents[3] / "docs" / "telemetry.schema.json"


def test_the_committed_schema_is_the_present_one() -> None:
    assert json.loads(COMMITTED.read_text()) == schema_json()


def test_every_field_has_a_meaning() -> None:
    for name, message in schema_json()["$defs"].items():
        for field, described in message.get("properties", {}).items():
            assert described.get("description") or "const" in described, (name, field)


def test_commands_are_taken_in_order() -> None:
    queue = CommandQueue()
    queue.offer(b'{"kind":"set_point","value":0.5}')
    queue.offer(b'{"kind":"impair","text":"loss=0.2"}')
    assert queue.take() == SetPoint(kind="set_point", value=0.5)
    assert queue.take() == Impair(kind="impair", text="loss=0.2")
    assert queue.take() is None
    assert queue.refused == 0


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff\xfe",
        b"{}",
        b'{"kind":"land"}',
        b'{"kind":"set_point","value":1e7}',
        b'{"kind":"set_point","value":NaN}',
        b'{"kind":"set_point","value":0.1,"more":1}',
        b'{"kind":"set_point","value":0.1,"output":-1}',
        b'{"kind":"impair","text":"loss=2"}',
        b'{"kind":"impair","text":"skew=200ppm"}',
        b'{"kind":"corrupt","end":"transmitter","field":"model.0"}',
        b'{"kind":"pace","factor":0}',
    ],
)
def test_what_makes_no_sense_is_refused_and_counted(data: bytes) -> None:
    queue = CommandQueue()
    queue.offer(data)
    assert (queue.take(), queue.refused) == (None, 1)


def test_a_flood_is_bounded() -> None:
    queue = CommandQueue()
    for _ in range(WAITING_MAX + 10):
        queue.offer(b'{"kind":"pause","paused":true}')
    assert queue.refused == 10
