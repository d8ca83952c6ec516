"""The first symbols of a serial flight whose transmitter is held up at its start, in virtual time."""

from __future__ import annotations

from collections import deque

import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from channel.line.line import Downlink, Uplink
from channel.links.base import Link
from channel.links.serial.slot_finder import START_NS
from channel.links.serial.wire import SerialWire
from channel.protocol.endings import End, Ending
from channel.protocol.events import EventKind
from channel.protocol.limits import CommandLimits
from plant_sim.encoder import Encoder
from plant_sim.pitch import PitchParameters, PitchPlant
from receiver.endpoint import ReceiverEndpoint
from receiver.session.session import ReceiverSession
from tests.channel.codec.parts import ConstantController, identity_of, pitch_codec, terms
from transmitter.endpoint import TransmitterEndpoint, TransmitterNode
from transmitter.guard import Guard, GuardSettings
from transmitter.loops import real
from transmitter.metrics.scores import Scores
from transmitter.rigs.simulated import SimulatedRig
from transmitter.session.session import TransmitterSession

MS = 1_000_000
CODEC = pitch_codec()
TERMS = terms(deadline_allowance_ns=20 * MS, lead_ticks=20)


class Clock:
    """Stands in for the module `time`."""

    def __init__(self) -> None:
        self.now_ns = 5_000 * MS

    def monotonic_ns(self) -> int:
        return self.now_ns

    def sleep(self, duration_s: float) -> None:
        self.now_ns += round(duration_s * 1e9)


class Line(Link):
    """Leads straight into a receiver; the process at its other end is held up by its first answers."""

    wire = SerialWire(2)
    start_ns = START_NS

    def __init__(self, clock: Clock, held_up_ns: deque[int]) -> None:
        super().__init__()
        controller = ConstantController(1.0, -1.0)
        session = ReceiverSession(CODEC, TERMS, controller, identity_of(CODEC), 77)
        self.receiver = ReceiverEndpoint(session, Downlink(self.wire))
        self._clock = clock
        self._held_up_ns = held_up_ns
        self._answers: deque[bytes] = deque()

    def send(self, data: bytes) -> None:
        self.counts.messages_out += 1
        self._answers += self.receiver.take(data, self._clock.now_ns)

    def receive(self, timeout_s: float) -> bytes | None:
        if not self._answers:
            self._clock.now_ns += round(timeout_s * 1e9)
            self._answers += self.receiver.take(None, self._clock.now_ns)
            return None
        if self._held_up_ns:
            self._clock.now_ns += self._held_up_ns.popleft()
        return self._answers.popleft()

    def peer_present(self) -> bool:
        return True

    def close(self) -> None: ...


@pytest.mark.parametrize("before_ms", [0, 200, 700, 780])
@pytest.mark.parametrize("after_ms", [0, 240, 700, 1500])
def test_when_the_transmitter_is_held_up_then_its_first_symbols_keep_their_slots(
    monkeypatch: pytest.MonkeyPatch, before_ms: int, after_ms: int
) -> None:
    clock = Clock()
    monkeypatch.setattr(real, "time", clock)
    line = Line(clock, deque([before_ms * MS]))
    session = TransmitterSession(CODEC, TERMS, identity_of(CODEC), 5)
    node = TransmitterNode(
        session,
        SimulatedRig(PitchPlant(PitchParameters(), 0.005), (Encoder(4096),), (0.0, 0.0)),
        Guard(CommandLimits.of(PITCH_SIGNALS, 5.0), GuardSettings(1000, 10, (0.0, 0.0))),
        Scores(CODEC.model, 0, 1000, lambda _: ()),
    )
    endpoint = TransmitterEndpoint(node, Uplink(TERMS, CODEC.coder.alphabet, wire=line.wire))
    flight = real.RealFlight(endpoint, line, 10.0)
    flight.greet()
    clock.now_ns += after_ms * MS
    flight.run(30 * TERMS.ticks_per_sample)
    flight.finish(lambda: End(Ending.OVER))
    counts = line.receiver.session.counts
    assert counts["symbols_late"] == counts["symbols_misplaced"] == counts["rejoins"] == 0
    assert session.counts["digest_checks"] == 30 == counts["samples"]
    assert counts["erasures"] == session.counts["words_missed"] <= 1 + after_ms // 100
    assert [one.kind for one in session.events].count(EventKind.STARTED) == 1
