"""The transmitter's outcome: what the last moments of a flight may still change about it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import pytest

from channel.protocol.endings import End, Ending
from channel.protocol.wire import DATAGRAM
from receiver.endpoint import ReceiverEndpoint
from tenbaud.build.ends import build_receiver
from tenbaud.build.flight import Agreement, agree
from tenbaud.build.transmitter_run import TransmitterRun
from tenbaud.config.load import load_config
from tenbaud.flight import receive, transmit
from tenbaud.flight.outcome import ExitCode, Outcome
from tests.channel.links.memory_pair import memory_pair
from transmitter.session.session import Phase

SECONDS = 2.0
PATIENCE_S = 20.0
LAST_SAMPLE = 19
DELAY = "up:delay=150ms"
"""The symbol of the last sample leaves 100 ms before the last tick and arrives after it."""


def agreement_on(clock: Any, **ends: Any) -> Agreement:
    link = {"peer_timeout_s": 3 * PATIENCE_S, "impairments": DELAY}
    changed = {"duration_s": SECONDS, "link": link, **ends}
    return agree(load_config("paper-10baud", None, changed), clock)


def corrupted_receiver(clock: Any) -> ReceiverEndpoint:
    """Return a receiver whose codec goes wrong after the flight's last sample."""
    sabotage = {"sabotage": f"sample={LAST_SAMPLE},field=range"}
    return build_receiver(agreement_on(clock, receiver=sabotage), None, DATAGRAM)


def fly_virtual(**transmitter: Any) -> tuple[Outcome, ReceiverEndpoint]:
    run = transmit.prepare(agreement_on("virtual", transmitter=transmitter), None, DATAGRAM)
    endpoint = corrupted_receiver("virtual")
    outcome = transmit.fly_virtual(run, endpoint, lambda: False)
    assert run.node.session.confirmed_state.sample == LAST_SAMPLE + 1
    return outcome, endpoint


def fly_real(endpoint: ReceiverEndpoint, should_stop: Callable[[TransmitterRun], bool]) -> Outcome:
    """Fly over a memory link in real time, the receiver in a separate thread."""
    agreement = agreement_on("real")
    near, far = memory_pair()

    def serve() -> None:
        receive.serve(agreement, endpoint, far, lambda: False)

    service = threading.Thread(target=serve, daemon=True)
    service.start()
    try:
        run = transmit.prepare(agreement, None, DATAGRAM)
        return transmit.fly_real(run, near, lambda: should_stop(run))
    finally:
        service.join(PATIENCE_S)
        assert not service.is_alive(), "the receiver was not told that the flight is over"


@pytest.mark.parametrize("on_desync", ["rejoin", "stop"])
def test_when_the_last_echo_differs_then_the_flight_is_a_desync(on_desync: str) -> None:
    outcome, endpoint = fly_virtual(on_desync=on_desync)
    assert outcome.code is ExitCode.DESYNC
    assert f"differ after sample {LAST_SAMPLE}" in outcome.text
    told = End(Ending.DESYNC, outcome.text, by_peer=True)
    assert on_desync == "stop" or endpoint.session.end == told


def test_when_the_last_echo_differs_on_the_real_clock_then_the_flight_is_a_desync() -> None:
    endpoint = corrupted_receiver("real")
    outcome = fly_real(endpoint, lambda _: False)
    assert outcome.code is ExitCode.DESYNC
    end = endpoint.session.end
    assert end is not None
    assert end.ending is Ending.DESYNC
    assert f"differ after sample {LAST_SAMPLE}" in end.text


def test_when_it_is_stopped_as_the_welcome_arrives_then_the_receiver_is_informed() -> None:
    endpoint = build_receiver(agreement_on("real"), None, DATAGRAM)
    outcome = fly_real(endpoint, lambda run: run.node.session.phase is Phase.FLYING)
    assert outcome.code is ExitCode.INTERRUPTED
    assert endpoint.session.end == End(Ending.STOPPED, by_peer=True)
