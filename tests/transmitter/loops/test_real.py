"""Both real drivers over a memory link, in two threads: counts only, never times.

A busy machine may hold either thread up at any tick. All laws here hold then as well.
"""

from __future__ import annotations

import threading
import time
from typing import Any

import pytest

from channel.codec.codec import Vector
from channel.codec.models.pitch import PITCH_SIGNALS
from channel.errors import ConfigMismatch, LinkLost
from channel.line.line import Uplink
from channel.line.virtual import Step, encode_step
from channel.protocol.endings import End, Ending
from channel.protocol.identity import Identity
from channel.protocol.limits import CommandLimits
from plant_sim.encoder import Encoder
from plant_sim.pitch import PitchParameters, PitchPlant
from receiver.controllers.pid import PAPER_GAINS, Pid
from receiver.controllers.references import Constant
from receiver.endpoint import ReceiverEndpoint
from receiver.loops.single import serve
from receiver.session.session import Phase as ReceiverPhase
from receiver.session.session import ReceiverSession
from tests.channel.codec.parts import THREE_SIGNS, identity_of, pitch_codec, terms
from tests.channel.links.memory_pair import MemoryLink, memory_pair
from transmitter.endpoint import TransmitterEndpoint, TransmitterNode
from transmitter.guard import Guard, GuardSettings
from transmitter.loops.real import RealFlight
from transmitter.metrics.scores import Scores
from transmitter.rigs.simulated import SimulatedRig
from transmitter.session.session import Phase, TransmitterSession

TICK_S = 0.005
TICKS = 200
CODEC = pitch_codec(THREE_SIGNS, ticks_per_sample=4, tick_s=TICK_S)
# A generous allowance: a busy machine may hold up either thread, and counts must not depend on it.
TERMS = terms(
    tick_ns=5_000_000,
    ticks_per_sample=4,
    rate_baud=50.0,
    deadline_allowance_ns=500_000_000,
    downlink_budget_ns=0,
    lead_ticks=100,
    repeats=5,
)
IDENTITY = identity_of(CODEC)


class HeldUp(SimulatedRig):
    """Returns late from tick 194, so that the next tick is one after the last sample's first tick."""

    late_s = 0.017

    def write(self, tick: int, volts: Vector) -> None:
        super().write(tick, volts)
        if tick == TICKS - 6:
            time.sleep(self.late_s)


class HeldUpBeyond(HeldUp):
    """Returns from tick 194 when the flight's time is over."""

    late_s = 0.2


class LastCommandLate(Pid):
    """Takes longer over the last sample than the agreed time for its echo."""

    def command(self, tick: int, state: Vector) -> Vector:
        if tick == TICKS + TERMS.lead_ticks - 1:
            time.sleep(0.8)
        return super().command(tick, state)


def flight_over(
    link: MemoryLink,
    identity: Identity = IDENTITY,
    peer_timeout_s: float = 10.0,
    rig: type[SimulatedRig] = SimulatedRig,
) -> RealFlight:
    session = TransmitterSession(CODEC, TERMS, identity, 5)
    plant = PitchPlant(PitchParameters(), TICK_S)
    node = TransmitterNode(
        session,
        rig(plant, (Encoder(4096),), (0.0, 0.0)),
        Guard(CommandLimits.of(PITCH_SIGNALS, 5.0), GuardSettings(400, 10, (0.0, 0.0))),
        Scores(CODEC.model, 0, 1000, lambda _: ()),
    )
    endpoint = TransmitterEndpoint(node, Uplink(TERMS, CODEC.coder.alphabet))
    return RealFlight(endpoint, link, peer_timeout_s)


def endpoint(kind: type[Pid] = Pid) -> ReceiverEndpoint:
    controller = kind(PAPER_GAINS, Constant(0.5, TICK_S), TICK_S)
    return ReceiverEndpoint(ReceiverSession(CODEC, TERMS, controller, IDENTITY, 77))


class Service:
    """The receiver's driver in a separate thread; what it raised is kept."""

    def __init__(self, end: ReceiverEndpoint, link: MemoryLink, **options: Any) -> None:
        self.error: Exception | None = None
        self.stop = threading.Event()
        self._thread = threading.Thread(target=self._serve, args=(end, link), kwargs=options)

    def _serve(self, end: ReceiverEndpoint, link: MemoryLink) -> None:
        try:
            serve(end, link, peer_timeout_s=20.0, should_stop=self.stop.is_set)
        except Exception as error:
            self.error = error

    def __enter__(self) -> Service:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._thread.join(timeout=10.0)
        self.stop.set()
        self._thread.join(timeout=10.0)
        assert not self._thread.is_alive()


@pytest.mark.parametrize(
    ("rig", "controller"),
    [(SimulatedRig, Pid), (HeldUp, Pid), (HeldUpBeyond, Pid), (SimulatedRig, LastCommandLate)],
)
def test_when_a_flight_is_flown_in_real_time_then_every_sample_is_checked(
    rig: type[SimulatedRig], controller: type[Pid]
) -> None:
    near, far = memory_pair()
    flight, end = flight_over(near, rig=rig), endpoint(controller)
    node, session = flight.endpoint.node, flight.endpoint.node.session
    with Service(end, far) as service:
        flight.greet()
        assert session.phase is Phase.FLYING
        ticks = flight.run(TICKS)
        flight.finish(lambda: End(Ending.OVER, "landed"))
    assert service.error is None
    assert ticks == TICKS
    assert end.session.phase is ReceiverPhase.ENDED
    assert end.session.end == End(Ending.OVER, "landed", by_peer=True)
    # Whatever the machine did meanwhile, both ends have seen the same, and say so sample by sample.
    checked = session.counts["digest_checks"]
    assert checked == TICKS // 4 or session.counts["rejoins"]
    assert checked == session.confirmed_state.sample
    # What the receiver erases before the farewell comes was not flown.
    beyond = end.session.state.sample - checked
    assert beyond >= 0
    assert beyond or session.confirmed_state == end.session.state
    assert session.counts["desyncs"] == end.session.counts["desyncs"] == 0
    assert session.counts["erasures"] == end.session.counts["erasures"] - beyond
    meter, shaper = flight.endpoint.uplink.meter, flight.endpoint.uplink.shaper
    counts = end.session.counts
    assert meter.symbols == counts["samples"] - counts["erasures"]
    assert meter.symbols + session.counts["words_missed"] + shaper.refused == TICKS // 4
    assert flight.endpoint.lateness.count == TICKS - flight.endpoint.ticks_missed
    assert beyond or flight.endpoint.inlet.meter.wire_bytes == end.downlink.meter.wire_bytes
    assert end.inlet.meter.wire_bytes == meter.wire_bytes, "the farewell is counted too"
    assert flight.endpoint.inlet.malformed == end.inlet.malformed == 0
    assert not node.latched


def test_when_nobody_answers_then_greeting_ends_with_link_lost() -> None:
    near, _ = memory_pair()
    with pytest.raises(LinkLost, match="no receiver answered"):
        flight_over(near, peer_timeout_s=0.01).greet()


def test_when_the_configuration_differs_then_both_sides_know_and_nothing_flies() -> None:
    near, far = memory_pair()
    end = endpoint()
    flight = flight_over(near, identity=identity_of(CODEC, {"rate_baud": 11.0}))
    with Service(end, far) as service:
        flight.greet()
    assert service.error is None
    assert flight.endpoint.node.session.phase is Phase.GREETING
    assert "rate_baud: here 11.0, there 10.0" in str(flight.endpoint.node.session.refusal)
    assert "rate_baud" in str(end.session.refusal)
    assert flight.endpoint.uplink.meter.symbols == 0


def test_when_a_real_service_is_stepped_virtually_then_it_says_so() -> None:
    near, far = memory_pair()
    near.send(encode_step(Step(1, 0, None)))
    with pytest.raises(ConfigMismatch, match="virtual clock"):
        serve(endpoint(), far, peer_timeout_s=5.0)


def test_when_no_transmitter_comes_then_the_service_ends_with_link_lost() -> None:
    _, far = memory_pair()
    with pytest.raises(LinkLost, match="nothing came from a transmitter"):
        serve(endpoint(), far, peer_timeout_s=0.01)


def test_when_a_service_is_stopped_then_it_returns() -> None:
    _, far = memory_pair()
    serve(endpoint(), far, peer_timeout_s=5.0, should_stop=lambda: True)


def test_when_garbage_comes_in_greeting_then_it_is_counted_and_the_greeting_goes_on() -> None:
    near, far = memory_pair()
    flight, end = flight_over(near), endpoint()
    far.send(b"garbage")
    with Service(end, far):
        flight.greet()
        flight.finish(lambda: End(Ending.OVER))
    assert flight.endpoint.inlet.malformed == 1
    assert end.session.phase is ReceiverPhase.ENDED
