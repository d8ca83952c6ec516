"""A whole flight in one process: both sessions, a simulated rig, and the virtual clock between them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from channel.codec.codec import Codec, Vector
from channel.codec.coders.zoom import ZoomParameters
from channel.line.downlink import Downlink
from channel.line.line import CleanLine, Line
from channel.line.uplink import Uplink
from channel.protocol.terms import Terms
from channel.protocol.wire import DATAGRAM, Wire
from plant_sim.encoder import Encoder
from plant_sim.pitch import PitchParameters, PitchPlant
from plant_sim.plant import Plant
from receiver.controllers.base import Controller
from receiver.controllers.pid import PAPER_GAINS, Pid
from receiver.controllers.references import Square
from receiver.endpoint import ReceiverEndpoint
from receiver.session.session import ReceiverSession
from tests.channel.codec.parts import PAPER, TICK_S, ListRecorder, identity_of, pitch_codec, terms
from transmitter.endpoint import TransmitterEndpoint
from transmitter.guard import Guard, GuardSettings
from transmitter.loops.virtual import VirtualFlight
from transmitter.metrics.scores import Scores
from transmitter.node import TransmitterNode
from transmitter.rigs.simulated import SimulatedRig
from transmitter.session.session import TransmitterSession

SESSION_NUMBER = 7
INCARNATION = 5
COUNTS_PER_TURN = 4096
REFERENCE = Square(math.pi / 2, 25.0, TICK_S)


@dataclass
class Flight:
    """Everything of one flight, to fly it and to look at it afterwards."""

    transmitter: TransmitterSession
    receiver: ReceiverSession
    node: TransmitterNode
    virtual: VirtualFlight
    endpoint: ReceiverEndpoint
    sent: ListRecorder
    received: ListRecorder
    ticks: int = 0

    def fly(self, seconds: float) -> Flight:
        """Greet, fly and finish; return the flight itself."""
        self.virtual.greet()
        self.ticks = self.virtual.run(round(seconds * 1e9 / self.transmitter.terms.tick_ns))
        self.virtual.finish(lambda: "done")
        return self

    @property
    def digests(self) -> list[object]:
        """Digests of the confirmed samples, as the transmitter computed them."""
        return self.sent.column("sample", "digest")

    @property
    def largest_share(self) -> float:
        """Largest coded error as a share of the largest angle, in the scored window."""
        return self.node.scores.coded.largest / self.node.scores.angle_max_rad


def assemble(
    codec: Codec,
    flight_terms: Terms,
    plant: Plant,
    controller: Controller,
    *,
    receiver_codec: Codec | None = None,
    uplink_line: Line | None = None,
    downlink_line: Line | None = None,
    window_start_tick: int = 0,
    safe_volts: Vector = (0.0, 0.0),
    counts_per_turn: int = COUNTS_PER_TURN,
    stop_on_desync: bool = False,
    wire: Wire = DATAGRAM,
) -> Flight:
    """Join the two ends; `receiver_codec` is for a receiver that computes otherwise."""
    identity = identity_of(codec)
    sent, received = ListRecorder(), ListRecorder()
    receiver = ReceiverSession(
        receiver_codec or codec, flight_terms, controller, identity, SESSION_NUMBER, received
    )
    transmitter = TransmitterSession(
        codec, flight_terms, identity, INCARNATION, sent, stop_on_desync=stop_on_desync
    )
    encoders = tuple(Encoder(counts_per_turn) for _ in plant.measured_rad)
    scores = Scores(
        codec.model, window_start_tick, 64 * codec.ticks_per_sample, controller.reference_rad
    )
    node = TransmitterNode(
        transmitter,
        SimulatedRig(plant, encoders, safe_volts),
        Guard(flight_terms.limits, GuardSettings(50, 50, safe_volts)),
        scores,
        sent,
    )
    uplink = Uplink(flight_terms, codec.coder.alphabet, uplink_line, wire)
    endpoint = ReceiverEndpoint(receiver, Downlink(wire))
    virtual = VirtualFlight(TransmitterEndpoint(node, uplink), downlink_line or CleanLine(), endpoint)
    return Flight(transmitter, receiver, node, virtual, endpoint, sent, received)


def pitch_flight(
    zoom: ZoomParameters = PAPER,
    *,
    ticks_per_sample: int = 10,
    mismatch: float = 0.0,
    uplink_line: Line | None = None,
    downlink_line: Line | None = None,
    receiver_codec: Codec | None = None,
    window_start_s: float = 25.0,
    stop_on_desync: bool = False,
    wire: Wire = DATAGRAM,
    **term_changes: Any,
) -> Flight:
    """Return the paper's flight: its plant (off by `mismatch`), its PID law, its square wave."""
    codec = pitch_codec(zoom, ticks_per_sample)
    flight_terms = terms(
        ticks_per_sample=ticks_per_sample, rate_baud=100.0 / ticks_per_sample, **term_changes
    )
    flight_terms.check("virtual")
    return assemble(
        codec,
        flight_terms,
        PitchPlant(PitchParameters().mismatched(mismatch), TICK_S),
        Pid(PAPER_GAINS, REFERENCE, TICK_S),
        receiver_codec=receiver_codec,
        uplink_line=uplink_line,
        downlink_line=downlink_line,
        window_start_tick=round(window_start_s / TICK_S),
        stop_on_desync=stop_on_desync,
        wire=wire,
    )


def assert_lockstep(flight: Flight, samples: int) -> None:
    """One digest check per sample, every one of them equal, and nothing left over."""
    assert flight.transmitter.counts["digest_checks"] == samples
    assert flight.transmitter.counts["desyncs"] == 0
    assert flight.receiver.counts["desyncs"] == 0
    assert flight.transmitter.copies.confirmed == flight.receiver.state
    assert flight.transmitter.copies.lag_samples == 0
    assert flight.digests == flight.received.column("sample", "digest")
    assert len(set(flight.digests)) == samples
    assert flight.transmitter.counts["stale_frames"] == flight.receiver.counts["stale_frames"] == 0
