"""Commands to a running flight that it cannot obey: reported, without effect."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from channel.protocol.events import EventKind
from channel.protocol.wire import DATAGRAM
from tenbaud import MemoryRecorder
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.flight import transmit
from tenbaud.flight.outcome import ExitCode
from tenbaud.sentences.events import event_text
from tenbaud.telemetry.command_queue import CommandQueue
from tenbaud.telemetry.end import steered
from tenbaud.telemetry.live import LiveReceiver, LiveTransmitter
from tests.events import event_fields


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
def test_when_a_field_to_corrupt_is_missing_then_it_is_reported_and_the_flight_goes_on(
    end: str,
) -> None:
    config = load_config("static-10baud", None, {"duration_s": 2.0})
    agreement = replace(agree(config, "virtual"), live=True)
    run = transmit.prepare(agreement, None, DATAGRAM)
    endpoint = build_receiver(agreement, None, DATAGRAM)
    queues = (CommandQueue(), CommandQueue())
    for queue in queues:
        # The static coder has no state, hence no range.
        queue.offer(json.dumps({"kind": "corrupt", "end": end, "field": "range"}).encode())
    run.node.before_every_tick(LiveTransmitter(run, queues[0], lambda: False).at_tick)
    live = LiveReceiver(endpoint, queues[1], lambda: False, MemoryRecorder(), None, "")
    assert not live()
    outcome = transmit.fly_virtual(run, endpoint, lambda: False)
    assert outcome.code is ExitCode.OK, outcome.text
    assert run.desyncs_asked == 0
    session = run.node.session if end == "transmitter" else endpoint.session
    told = [
        event_text(event_fields(event)) for event in session.events if event.kind is EventKind.CONTROL
    ]
    assert len(told) == 1
    assert told[0].endswith("coder state has 0 value(s): ignored")


def test_a_set_point_beyond_a_stop_of_the_plant_is_refused_in_words() -> None:
    config = load_config("helicopter-10baud", None, {"duration_s": 2.0})
    agreement = replace(agree(config, "virtual"), live=True)
    steering = steered(agreement)
    queue, endpoint = CommandQueue(), build_receiver(agreement, None, DATAGRAM)
    for value in (0.3, 0.55):
        queue.offer(json.dumps({"kind": "set_point", "output": 1, "value": value}).encode())
    LiveReceiver(endpoint, queue, lambda: False, MemoryRecorder(), steering, "")()
    assert steering is not None
    assert steering[1] is not None
    assert steering[1].by_hand == 0.3
    told = [event_text(event_fields(event)) for event in endpoint.session.events]
    assert told[-1].endswith("elevation is within -28.0 deg and 30.0 deg: ignored")
