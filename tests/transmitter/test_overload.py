"""Flights whose processes are too slow for their symbol rate: they say so, and fly at what they can."""

from __future__ import annotations

import threading
import time

import pytest

from channel.codec.codec import Vector
from channel.codec.models.pitch import PITCH_SIGNALS
from channel.line.line import Uplink
from channel.protocol.endings import End, Ending
from channel.protocol.events import EventKind
from channel.protocol.limits import CommandLimits
from plant_sim.encoder import Encoder
from plant_sim.pitch import PitchParameters, PitchPlant
from receiver.endpoint import ReceiverEndpoint
from receiver.loops.single import serve
from receiver.session.session import ReceiverSession
from tenbaud.sentences.events import event_text
from tests.channel.codec.parts import THREE_SIGNS, ConstantController, identity_of, pitch_codec, terms
from tests.channel.links.memory_pair import MemoryLink, memory_pair
from tests.events import event_fields
from tests.tenbaud.machine import Pacer
from transmitter.endpoint import TransmitterEndpoint, TransmitterNode
from transmitter.guard import Guard, GuardSettings
from transmitter.loops.real import RealFlight
from transmitter.metrics.scores import Scores
from transmitter.rigs.simulated import SimulatedRig
from transmitter.session.session import TransmitterSession

pytestmark = [pytest.mark.real_time, pytest.mark.both_cores]

TICK_S = 0.001
TICKS = 1500
TOO_LONG_S = 0.003
CODEC = pitch_codec(THREE_SIGNS, ticks_per_sample=1, tick_s=TICK_S)
TERMS = terms(
    tick_ns=1_000_000,
    ticks_per_sample=1,
    rate_baud=1000.0,
    deadline_allowance_ns=3_000_000,
    downlink_budget_ns=2_000_000,
    lead_ticks=5,
)
IDENTITY = identity_of(CODEC)


class SlowRig(SimulatedRig):
    """Takes three periods to put a tick's voltages on the motors."""

    def write(self, tick: int, volts: Vector) -> None:
        time.sleep(TOO_LONG_S)
        super().write(tick, volts)


class SlowController(ConstantController):
    """Takes one and a half periods for each command."""

    def command(self, tick: int, state: Vector) -> Vector:
        time.sleep(TOO_LONG_S / 2)
        return super().command(tick, state)


def flight_over(link: MemoryLink, kind: type[SimulatedRig]) -> RealFlight:
    node = TransmitterNode(
        TransmitterSession(CODEC, TERMS, IDENTITY, 5),
        kind(PitchPlant(PitchParameters(), TICK_S), (Encoder(4096),), (0.0, 0.0)),
        Guard(CommandLimits.of(PITCH_SIGNALS, 5.0), GuardSettings(100, 50, (0.0, 0.0))),
        Scores(CODEC.model, 0, 1000, lambda _: ()),
        rearm_ticks=10_000,
    )
    return RealFlight(TransmitterEndpoint(node, Uplink(TERMS, CODEC.coder.alphabet)), link, 10.0)


def flown(rig: type[SimulatedRig], controller: ConstantController) -> RealFlight:
    near, far = memory_pair()
    end = ReceiverEndpoint(ReceiverSession(CODEC, TERMS, controller, IDENTITY, 77))
    thread = threading.Thread(target=serve, args=(end, far, 20.0))
    flight = flight_over(near, rig)
    thread.start()
    try:
        flight.greet()
        flight.run(TICKS)
    finally:
        flight.leave(End(Ending.OVER, "the flight is over"))
        thread.join(timeout=20.0)
    assert not thread.is_alive()
    return flight


def check_reported(flight: RealFlight) -> None:
    session = flight.endpoint.node.session
    said = [event_text(event_fields(event)) for event in session.events if event.kind is EventKind.RATE]
    assert said
    assert "1000 symbols/s are configured" in said[0]
    assert flight.endpoint.rate.kept_symbols_per_s is not None
    assert flight.endpoint.rate.kept_symbols_per_s < 950.0
    assert session.counts["desyncs"] == 0


def test_when_the_receiver_is_too_slow_then_it_says_so_and_the_flight_goes_on() -> None:
    with Pacer() as pacer:
        flight = flown(SimulatedRig, SlowController(1.0, -1.0))
    check_reported(flight)
    pacer.need_idle()
    # Without the common state there is no flight: it is asked for now and then, not all the time.
    counts = flight.endpoint.node.session.counts
    assert counts["digest_checks"] > TICKS // 25
    assert counts["rejoins"] <= TICKS * TICK_S / 0.05, "at most one answer's age apart"


def test_when_the_transmitter_is_too_slow_then_it_says_so_and_no_common_state_is_asked_for() -> None:
    with Pacer() as pacer:
        flight = flown(SlowRig, ConstantController(1.0, -1.0))
    check_reported(flight)
    assert flight.endpoint.ticks_missed > TICKS // 2
    pacer.need_idle()
    counts = flight.endpoint.node.session.counts
    assert counts["rejoins"] == 0
    assert counts["digest_checks"] > TICKS * 9 // 10
