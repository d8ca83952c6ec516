"""A flight from objects, both ends in this process, on the virtual clock: no configuration, no file."""

from __future__ import annotations

import json
from dataclasses import asdict

from channel.codec.codec import Codec, Vector
from channel.codec.downlink.machine import TwoWay
from channel.codec.models.learned import plant_model
from channel.codec.models.linear import LinearModel
from channel.errors import ConfigMismatch, LinkLost
from channel.line.impairments import LineFaults
from channel.line.line import CleanLine, Downlink, Line, Uplink
from channel.protocol.endings import End, Ending
from channel.protocol.identity import Identity, numerics_probe
from channel.protocol.recording import Recorder
from channel.protocol.terms import Terms
from channel.protocol.wire import DATAGRAM, Wire
from plant_sim.encoder import Encoder
from plant_sim.plant import Plant
from receiver.controllers.base import Controller
from receiver.endpoint import ReceiverEndpoint
from receiver.session.session import ReceiverSession
from tenbaud.build.downlink import with_codec
from tenbaud.build.liveness import round_trip, watchdog_ticks
from tenbaud.build.parts import PartError, Parts, check_codec
from tenbaud.config.version import software_version
from tenbaud.flight.memory_result import FlightResult, result_of
from tenbaud.recording.memory import MemoryRecorder
from tenbaud.sentences.endings import end_text, refusal_text
from tenbaud.sentences.events import guard_text
from transmitter.endpoint import TransmitterEndpoint, TransmitterNode
from transmitter.guard import Guard, GuardSettings
from transmitter.loops.virtual import VirtualFlight
from transmitter.metrics.scores import Scores
from transmitter.rigs.simulated import SimulatedRig
from transmitter.session.session import Phase, TransmitterSession
from transmitter.session.state_observer import StateObserver

INCARNATION, SESSION_NUMBER = 1, 1
"""Fixed: a separate process would draw them, and a flight in memory is the same every time."""
RAMP_TICKS = 50
REARM_S = 10.0
"""A guard that stopped for want of commands is armed again, by a rejoin, within this time: the plant is
simulated and hurts nobody."""
SPAN_SAMPLES = 2
"""Samples beyond the history that an angle waits for its estimate."""


class MemoryFlight:
    """Both ends of one flight, from objects that fulfil the protocols of their parts.

    `codec` and `terms` are what both ends share, `plant` is what is flown, and `controller` turns
    estimates into commands. The plant and the controller move with the flight, so a MemoryFlight
    flies once. PartError, naming the member, for an object that lacks something; ValueError for terms
    that do not go with the codec.

    `receiver_codec`: a separate codec for the receiver, for studies of lost lockstep.
    `uplink_line`, `downlink_line`: lines that delay, lose or change messages; clean ones without.
    `encoder_counts_per_turn`: what each measured angle is rounded to.
    `scored_from_s`: flight time at which `node.scores` begins to count errors.
    `stop_on_desync`: end the flight at the first digest that differs, instead of a new epoch.
    `two_way`: the state machine of the narrow downlink, of this codec.
    `recorder`, `receiver_recorder`: take every row of the transmitter and of the receiver as well.

    The parts of the two ends are attributes, to be looked at before, during and after the flight.
    """

    def __init__(
        self,
        codec: Codec,
        terms: Terms,
        plant: Plant,
        controller: Controller,
        *,
        receiver_codec: Codec | None = None,
        uplink_line: Line | None = None,
        downlink_line: Line | None = None,
        encoder_counts_per_turn: int = 4096,
        safe_command: Vector | None = None,
        scored_from_s: float = 0.0,
        stop_on_desync: bool = False,
        recorder: Recorder | None = None,
        receiver_recorder: Recorder | None = None,
        wire: Wire = DATAGRAM,
        two_way: TwoWay | None = None,
    ) -> None:
        _check(codec, terms, plant, controller)
        _check_two_way(terms, two_way)
        self.codec = codec
        self.terms = terms
        self.plant = plant
        self.controller = controller
        self.transmitter_rows = MemoryRecorder(recorder)
        self.receiver_rows = MemoryRecorder(receiver_recorder)
        uplink_line = uplink_line or CleanLine()
        downlink_line = downlink_line or CleanLine()
        identity = Identity(
            software_version(),
            json.dumps(asdict(terms), sort_keys=True),
            numerics_probe(codec, two_way),
        )
        self.transmitter = TransmitterSession(
            codec,
            terms,
            identity,
            INCARNATION,
            self.transmitter_rows,
            stop_on_desync=stop_on_desync,
            state_observer=_observer(codec, encoder_counts_per_turn),
            two_way=two_way,
            line_delay_ns=uplink_line.longest_delay_ns + downlink_line.longest_delay_ns,
        )
        self.receiver = ReceiverSession(
            receiver_codec or codec,
            terms,
            controller,
            identity,
            SESSION_NUMBER,
            self.receiver_rows,
            two_way=with_codec(two_way, receiver_codec or codec),
        )
        up_ns = uplink_line.longest_delay_ns + terms.symbol_delay_ns
        delay_ns = max(up_ns, downlink_line.longest_delay_ns)
        self.node = self._node(
            encoder_counts_per_turn, safe_command, round(scored_from_s * 1e9), delay_ns
        )
        self.uplink = Uplink(terms, codec.coder.alphabet, uplink_line, wire)
        downlink = Downlink(wire, None, terms, self.receiver_rows)
        self.endpoint = ReceiverEndpoint(self.receiver, downlink)
        self.loop = VirtualFlight(
            TransmitterEndpoint(self.node, self.uplink), downlink_line, self.endpoint
        )
        self._flown = False

    def _node(
        self, counts_per_turn: int, safe_command: Vector | None, scored_from_ns: int, delay_ns: int
    ) -> TransmitterNode:
        terms = self.terms
        if safe_command is None:
            safe_command = (0.0,) * self.codec.model.input_size
        encoders = tuple(Encoder(counts_per_turn) for _ in self.plant.measured)
        trip = round_trip(terms, LineFaults(), "virtual")
        timeout_ticks = watchdog_ticks(None, terms, trip) - (-delay_ns // terms.tick_ns)
        return TransmitterNode(
            self.transmitter,
            SimulatedRig(
                self.plant, encoders, safe_command, [one.name for one in terms.signals.outputs]
            ),
            Guard(terms.limits, GuardSettings(timeout_ticks, RAMP_TICKS, safe_command)),
            Scores(
                self.codec.model,
                scored_from_ns // terms.tick_ns,
                (terms.confirmation_samples + SPAN_SAMPLES) * terms.ticks_per_sample,
                self.controller.references,
            ),
            self.transmitter_rows,
            round(REARM_S * 1e9) // terms.tick_ns,
        )

    def fly(self, seconds: float) -> FlightResult:
        """Fly the given number of seconds of flight time; return everything that was seen at both ends.

        A flight that ends before its time (the guard, a lost lockstep with `stop_on_desync`) returns
        too: `ended_by` says why. Raises ConfigMismatch where the receiver refuses, and LinkLost where
        no request for a session came through the line.
        """
        ticks = round(seconds * 1e9 / self.terms.tick_ns)
        if ticks < 1:
            raise ValueError(
                f"seconds = {seconds:g} is less than one tick, {self.terms.tick_ns / 1e9:g} s"
            )
        if self._flown:
            raise RuntimeError("a MemoryFlight flies once: make another, of a new plant and controller")
        self._flown = True
        self.loop.greet()
        if self.transmitter.refusal is not None:
            raise ConfigMismatch(f"the receiver refused: {refusal_text(self.transmitter.refusal)}")
        if self.transmitter.phase is Phase.GREETING:
            raise LinkLost("no request for a session came through the line")
        flown = self.loop.run(ticks)
        ended_by, end = "", End(Ending.OVER)
        if flown != ticks:
            cause = self.transmitter.end
            ended_by = end_text(cause, "receiver") if cause else guard_text(self.node.guard.reason)
            end = cause or End(Ending.SAFETY_STOP)
        self.loop.finish(lambda: end)
        self.receiver.flush_records()
        rows = (self.transmitter_rows, self.receiver_rows)
        return result_of(
            self.codec.model, self.terms, self.transmitter, self.receiver, rows, flown, ended_by
        )


def _observer(codec: Codec, counts_per_turn: int) -> StateObserver | None:
    """Return the observer of all states of a linear model; None: the session's own."""
    if not (codec.uses_rates and isinstance(plant_model(codec.model), LinearModel)):
        return None
    from tenbaud.design.observer import observer_of_coder

    return observer_of_coder(codec, counts_per_turn)


def _check_two_way(terms: Terms, two_way: TwoWay | None) -> None:
    """Raise ValueError for a state machine that is not that of the terms' downlink."""
    if terms.is_narrow is not (two_way is not None):
        raise ValueError(
            f"terms.downlink is {terms.downlink!r} and two_way is {two_way}; the narrow downlink needs "
            "one, and no other downlink has one"
        )
    if two_way is None:
        return
    for name, ours, theirs in (
        ("down_symbols", terms.down_symbols, two_way.layout.symbols_per_sample),
        ("lead_ticks", terms.lead_ticks, two_way.lead_ticks),
        ("initial_command", terms.initial_command, two_way.initial_command),
    ):
        if ours != theirs:
            raise ValueError(f"terms.{name} is {ours}, and that of two_way is {theirs}")


def _check(codec: Codec, terms: Terms, plant: Plant, controller: Controller) -> None:
    """Raise PartError or ValueError for parts that do not make a flight."""
    if not isinstance(codec, Codec):
        raise PartError(
            f"the codec ({type(codec).__name__}) is no Codec: give Codec(model, coder, "
            "ticks_per_sample)"
        )
    Parts(codec.model, codec.coder, plant, controller).check()
    for name, ours, theirs in (
        ("ticks_per_sample", terms.ticks_per_sample, codec.ticks_per_sample),
        ("symbols_per_word", terms.symbols_per_word, codec.coder.alphabet.symbols_per_word),
    ):
        if ours != theirs:
            raise ValueError(
                f"terms.{name} is {ours}, and the codec's is {theirs}; Terms.for_codec(codec, tick_s) "
                "makes terms that agree"
            )
    check_codec("the codec", codec)
    predicted, measured = codec.model.measured(codec.model.initial()), plant.measured
    if len(predicted) != len(measured):
        raise PartError(
            f"the plant ({type(plant).__name__}) measures {len(measured)} angle(s) and the model "
            f"({type(codec.model).__name__}) predicts {len(predicted)}; they must be the same ones"
        )
