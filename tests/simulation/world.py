"""The whole system in one thread: production sessions, true time, lines, clocks, crashes, one seed.

Unlike a flight on the virtual clock, each end here lives on its own: it has its own clock, it can be
killed and started again, and each sender holds its own line.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count

from channel.codec.codec import Codec, Vector
from channel.codec.downlink.machine import TwoWay
from channel.errors import FrameError
from channel.line.clocks import SkewedClock
from channel.line.impairments import ImpairedLine, Impairments
from channel.line.line import Downlink, Uplink
from channel.line.slots import Departure
from channel.protocol.frames import Frame, Symbol
from channel.protocol.sabotage import Sabotage, SabotagedCodec
from channel.protocol.wire import decode
from plant_sim.encoder import Encoder
from plant_sim.pitch import PitchParameters, PitchPlant
from receiver.controllers.pid import PAPER_GAINS, Pid
from receiver.endpoint import ReceiverEndpoint
from receiver.session.session import ReceiverSession
from tenbaud.build.references import values_of
from tests.channel.codec.parts import TICK_NS, TICK_S, identity_of, pitch_codec
from tests.simulation.faults import Plan
from tests.simulation.flight import COUNTS_PER_TURN, REFERENCE
from tests.simulation.watch import Watch
from transmitter.endpoint import TransmitterNode
from transmitter.guard import Guard, GuardSettings
from transmitter.metrics.scores import Scores
from transmitter.rigs.base import Reading, Rig
from transmitter.session.copies import Confirmed
from transmitter.session.session import Phase, TransmitterSession

ALIVE_TICKS = 10**6
NEVER = Sabotage(-1, "coder", 0)

RECOVERY_SAMPLES_MAX = 13
"""From the last fault to lockstep, beside the round trip and the command lead."""

CALM_REJOINS_MAX = 4
"""After the last fault."""


class WorldRig(Rig):
    """A plant that outlives the transmitter's process: its ticks are counted from true time 0."""

    name = "world"

    def __init__(self, plant: PitchPlant, watch: Watch) -> None:
        self.plant = plant
        self.watch = watch
        self.encoder = Encoder(COUNTS_PER_TURN)
        self.volts: Vector = (0.0, 0.0)

    def read(self, tick: int) -> Reading:
        true = self.plant.measured
        counts = (self.encoder.counts(true[0]),)
        return Reading(counts, (self.encoder.angle_rad(counts[0]),), true)

    def write(self, tick: int, volts: Vector) -> None:
        self.watch.on_volts(volts)
        self.volts = volts


class BlindSession(TransmitterSession):
    """A faulty transmitter: it sees that the digests differ, and continues."""

    def _on_desync(self, done: Confirmed) -> list[Frame]:
        return []


class World:
    """One flight under a plan; `fly` raises `SafetyViolation` or `LivenessViolation`."""

    def __init__(self, plan: Plan, blind: bool = False) -> None:
        """`blind` makes a transmitter that stays silent about digests that differ: a canary."""
        self.plan = plan
        self.blind = blind
        self.terms = plan.terms
        self.codec = pitch_codec(plan.zoom, plan.terms.ticks_per_sample)
        self.identity = identity_of(self.codec)
        self.watch = Watch(self.codec, self.terms)
        self.faults: Counter[str] = Counter()
        self.clock = SkewedClock(plan.faults)
        plant = PitchPlant(PitchParameters().mismatched(plan.mismatch), TICK_S)
        self.rig = WorldRig(plant, self.watch)
        alphabet = self.codec.coder.alphabet
        self.up = ImpairedLine(plan.up, alphabet, f"{plan.seed} up")
        self.down = ImpairedLine(plan.down, alphabet, f"{plan.seed} down")
        self.now_ns = 0
        self.calm_ns = 0
        """when faults stop, true time"""
        self._sabotaged: list[SabotagedCodec] = []
        self._events: list[tuple[int, int, Callable[[], None]]] = []
        self._order = count()
        self._started = 0
        self._generation = 0
        self.node: TransmitterNode | None = None
        self.endpoint: ReceiverEndpoint | None = None
        self.uplink: Uplink | None = None
        self._origin_ns = 0
        self._greeted = False
        self.recovered_ns: int | None = None
        """from then until both ends were locked"""

    @property
    def recovery_ns_max(self) -> int:
        """Return how long lockstep may take to come back after the last fault."""
        waiting_ns = self.plan.round_trip_ns + self.terms.lead_ticks * self.terms.tick_ns
        return RECOVERY_SAMPLES_MAX * self.terms.sample_ns + waiting_ns

    @property
    def calm_rejoins_max(self) -> int:
        """Return how often the ends may rejoin after the last fault."""
        return CALM_REJOINS_MAX

    def two_way(self, codec: Codec) -> TwoWay | None:
        """Return the state machine of an end; None: echoes and commands go down."""
        return None

    # The two processes

    def start_receiver(self) -> None:
        self._started += 1
        codec = self._codec_of("receiver")
        controller = Pid(PAPER_GAINS, REFERENCE, TICK_S)
        recorder = self.watch.receiver_started(1000 + self._started)
        session = ReceiverSession(
            codec,
            self.terms,
            controller,
            self.identity,
            1000 + self._started,
            recorder,
            two_way=self.two_way(codec),
        )
        recorder.session = session
        self.endpoint = ReceiverEndpoint(session, Downlink(terms=self.terms))

    def start_transmitter(self) -> None:
        self._started += 1
        self._generation += 1
        recorder = self.watch.transmitter_started()
        kind = BlindSession if self.blind else TransmitterSession
        codec = self._codec_of("transmitter")
        session = kind(
            codec,
            self.terms,
            self.identity,
            self._started,
            recorder,
            overtaking_ticks=self.plan.overtaking_ticks,
            two_way=self.two_way(codec),
            line_delay_ns=self.plan.round_trip_ns,
        )
        guard = Guard(self.terms.limits, GuardSettings(self.plan.watchdog_ticks, 50, (0.0, 0.0)))
        scores = Scores(self.codec.model, 0, 2000, values_of((REFERENCE,)))
        self.node = TransmitterNode(session, self.rig, guard, scores, recorder, ALIVE_TICKS)
        self.watch.node = self.node
        self.uplink = Uplink(self.terms, self.codec.coder.alphabet, self.up)
        self._greeted = False
        self._origin_ns = self.now_ns
        self.rig.volts = (0.0, 0.0)
        self._greet(self._generation)

    def _codec_of(self, end: str) -> Codec:
        codec = self.codec
        for which, sabotage in self.plan.sabotage:
            if which == end:
                codec = SabotagedCodec(codec, sabotage)
                self._sabotaged.append(codec)
        return codec

    # Time

    def at(self, time_ns: int, action: Callable[[], None]) -> None:
        heapq.heappush(self._events, (time_ns, next(self._order), action))

    def fly(self) -> World:
        """Fly both phases, checking at every step."""
        plan = self.plan
        self.start_receiver()
        self.start_transmitter()
        for (start_ns, which), outage_ns in zip(plan.restarts, plan.outages_ns, strict=True):
            self.at(start_ns, lambda which=which: self._kill(which))
            self.at(start_ns + outage_ns, lambda which=which: self._revive(which))
        for start_ns, end_ns, direction in plan.partitions:
            self.at(start_ns, lambda direction=direction: self._cut(direction, 1.0))
            self.at(end_ns, lambda direction=direction: self._cut(direction, 0.0))
        outages = zip(plan.restarts, plan.outages_ns, strict=True)
        last_ns = max((at + outage_ns for (at, _), outage_ns in outages), default=0)
        self.calm_ns = max(round(plan.faulty_s * 1e9), last_ns + 1)
        self.at(self.calm_ns, self._calm)
        tick_end_ns = self.calm_ns + round(plan.quiet_s * 1e9)
        for index in range(tick_end_ns // TICK_NS):
            self.at(index * TICK_NS, self._plant_tick)
        self._run(tick_end_ns)
        self.watch.check_locked(self)
        return self

    def _run(self, end_ns: int) -> None:
        while self._events:
            due_ns = self._deadline_ns()
            time_ns = self._events[0][0]
            if due_ns is not None and due_ns < time_ns:
                self.now_ns = max(due_ns, self.now_ns)
                self._receive(None)
                continue
            if time_ns > end_ns:
                return
            self.now_ns = time_ns
            heapq.heappop(self._events)[2]()

    def _deadline_ns(self) -> int | None:
        shown = self.endpoint.session.next_deadline() if self.endpoint is not None else None
        return None if shown is None else self.clock.reached(shown, self.now_ns)

    def _plant_tick(self) -> None:
        self.rig.plant.advance(self.rig.volts)
        if self.now_ns > self.calm_ns:
            self.watch.on_calm_tick(self)
            if self.recovered_ns is None and self.watch.is_locked(self):
                self.recovered_ns = self.now_ns - self.calm_ns

    # The transmitter's driver

    def _greet(self, generation: int) -> None:
        node = self.node
        if node is None or generation != self._generation:
            return
        if node.session.phase is Phase.GREETING:
            self._offer([node.session.hello()])
            self.at(self.now_ns + self.terms.sample_ns, lambda: self._greet(generation))

    def _begin(self) -> None:
        assert self.node is not None
        self._greeted = True
        first = self.node.session.epoch_tick
        self._origin_ns = self.now_ns + TICK_NS - first * TICK_NS
        self._tick(first, self._generation)

    def _tick(self, tick: int, generation: int) -> None:
        if generation != self._generation or self.node is None:
            return
        if self._origin_ns + tick * TICK_NS > self.now_ns:
            self.at(self._origin_ns + tick * TICK_NS, lambda: self._tick(tick, generation))
            return
        frames = self.node.measure(tick)
        self._offer(frames or [])
        self.node.flush_records()
        self.watch.on_delivered(self.node)
        self.node.actuate(tick)
        self.watch.on_tick(tick, self.node)
        self._tick(tick + 1, generation)

    def _offer(self, frames: Sequence[Frame]) -> None:
        assert self.uplink is not None
        flight_ns = self.now_ns - self._origin_ns
        for frame in frames:
            deliveries = self.uplink.offer(frame, flight_ns)
            if deliveries and isinstance(frame, Symbol):
                self.watch.on_symbol_sent(self.now_ns)
            for arrival_ns, data in deliveries:
                if data is not None:
                    self.at(arrival_ns + self._origin_ns, lambda data=data: self._receive(data))

    def _take(self, data: bytes) -> None:
        node = self.node
        if node is None:
            return
        try:
            frame = decode(data)
        except FrameError:
            self.faults["downlink frames dropped by their check"] += 1
            return
        answers = node.deliver(frame)
        node.flush_records()
        self.watch.on_delivered(node)
        if not self._greeted and node.session.phase is Phase.FLYING:
            self._begin()
        self._offer(answers)

    # The receiver's driver

    def _receive(self, data: bytes | None) -> None:
        if self.endpoint is None:
            return
        shown_ns = self.clock.shown(self.now_ns)
        reply = self.endpoint.step(shown_ns, data)
        self.endpoint.session.flush_records()
        at_once = [Departure(shown_ns, message) for message in reply.frames]
        for leaves_ns, message in (*at_once, *reply.later):
            for arrival_ns, out in self.down.carry(message, self.now_ns + leaves_ns - shown_ns):
                if out is not None:
                    self.at(arrival_ns, lambda out=out: self._take(out))

    # Faults

    def _kill(self, which: str) -> None:
        self.faults[f"{which} killed"] += 1
        if which == "receiver":
            self.endpoint = None
        else:
            self.node = None
            self._generation += 1
            self.rig.volts = (0.0, 0.0)

    def _revive(self, which: str) -> None:
        if which == "receiver" and self.endpoint is None:
            self.start_receiver()
        elif which == "transmitter" and self.node is None:
            self.start_transmitter()

    def _cut(self, direction: str, loss: float) -> None:
        self.faults["partitions"] += loss > 0.0
        for name, line, usual in (("up", self.up, self.plan.up), ("down", self.down, self.plan.down)):
            if direction in (name, "both"):
                line.impairments = replace(line.impairments, loss=max(loss, usual.loss))

    def _calm(self) -> None:
        """Nothing goes wrong any more; the line is as slow as it was, evenly."""
        for line, usual in ((self.up, self.plan.up), (self.down, self.plan.down)):
            for name, number in line.counts.items():
                self.faults[name] += number
            line.impairments = Impairments(delay_ns=usual.delay_ns)
        for codec in self._sabotaged:
            # An end that was started again may not have come to the sample yet.
            codec.arm(NEVER)
