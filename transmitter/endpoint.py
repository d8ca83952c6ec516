"""The sensor node without time and transport: messages and times in, messages and arrivals out.

`TransmitterNode` joins rig, session, guard and scores for one tick at a time; `TransmitterEndpoint`
adds the way in and the way out. A loop (`transmitter.loops`) asks when the next tick is due, gives it
what came, and carries what it returns. All times are flight times.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import asdict, astuple, replace

from channel.codec.codec import Vector
from channel.line.line import Delivery, Inlet, Uplink, no_compact_commands
from channel.line.meters import BaudMeter, LatenessMeter
from channel.links.serial.slot_finder import SlotFinder
from channel.protocol.endings import End
from channel.protocol.events import Dropped, Event, EventKind, write_event
from channel.protocol.frames import DownSymbol, Frame, ShortCommands, ShortSymbol, Why
from channel.protocol.recording import NullRecorder, Recorder
from transmitter.encoder_watch import EncoderWatch
from transmitter.guard import Guard, GuardCause, GuardReason, GuardState
from transmitter.metrics.gap import GAP_CHANNEL, GAP_EVERY_S, GapGauge
from transmitter.metrics.scores import Scores
from transmitter.rigs.base import Reading, Rig
from transmitter.session.copies import Confirmed
from transmitter.session.rate_watch import RateWatch
from transmitter.session.records import DEVICE_CHANNEL, TICK_CHANNEL
from transmitter.session.session import Phase, TransmitterSession

RESTLESS_SAMPLES_MAX = 32
"""Samples that may be confirmed before they are scored even if no driver finds the time."""


class TransmitterNode:
    """Everything of the sensor node but time and transport.

    `rearm_ticks`: re-arm the guard by itself, with a rejoin, after commands have stayed away, for as
    long as the receiver has been silent for no more than this many ticks. None: never; for every rig
    that could hurt somebody the way back is to start the node again.
    """

    def __init__(
        self,
        session: TransmitterSession,
        rig: Rig,
        guard: Guard,
        scores: Scores,
        recorder: Recorder | None = None,
        rearm_ticks: int | None = None,
        gauge: GapGauge | None = None,
    ) -> None:
        self.session = session
        self.rig = rig
        self.guard = guard
        self.scores = scores
        self.gauge = gauge
        self.commands_late = 0
        self.ticks_commanded = 0
        """whose own command passed the guard"""
        self.ticks_at_limit = 0
        """of these, with an input at its limit"""
        self.ticks_down = 0
        """with the guard at the safe voltage, or on its way there"""
        self.sensor_fault: GuardReason | None = None
        self.tick = 0
        self.rearmed = 0
        self._before_tick: Callable[[int], None] = lambda _: None
        self._rearm_ticks = rearm_ticks
        self._gauge_samples = max(1, round(GAP_EVERY_S * 1e9 / session.terms.sample_ns))
        self._recorder = recorder or NullRecorder()
        self._reading: Reading | None = None
        self._watch: EncoderWatch | None = None
        if not rig.is_recorded:
            self._watch = EncoderWatch(session.codec, session.terms.tick_ns / 1e9)
        self._applied = guard.command
        self._guard_reported = guard.state

    def before_every_tick(self, act: Callable[[int], None]) -> None:
        """Have this called before every tick: where a person's commands take hold."""
        self._before_tick = act

    def measure(self, tick: int) -> list[Frame] | None:
        """Read the rig; return the frames to send, or None when the rig has no more to read."""
        self.tick = tick
        self._before_tick(tick)
        reading = self.rig.read(tick)
        if reading is None:
            return None
        self._reading = reading
        if reading.device is not None:
            time_ns = tick * self.session.terms.tick_ns
            self._recorder.write(DEVICE_CHANNEL, time_ns, (tick, *astuple(reading.device)))
        self._check(tick, reading)
        self.scores.on_outputs(tick, reading.true or reading.measured)
        if self.gauge is not None:
            self.gauge.on_outputs(tick, reading.measured)
        asking: list[Frame] = []
        if self.guard.stopped:
            if not self._may_rearm:
                return []
            asking = self.session.rejoin(Why.GUARD)
        return asking + self.session.on_measurement(tick, reading.measured)

    def deliver(self, frame: Frame) -> list[Frame]:
        """Hand an arrived frame to the session; return the answers. `rest` has what it confirmed."""
        answers = self.session.on_frame(frame)
        if self.session.following.unrecorded >= RESTLESS_SAMPLES_MAX:
            self.flush_records()
        if self.guard.stopped and self._may_rearm and self.session.phase is Phase.FLYING:
            self.guard.rearm()
            self.rearmed += 1
        return answers

    def flush_records(self) -> None:
        """Score and record confirmed samples: work for the time after the next symbol is sent."""
        if not self.session.following.unrecorded:
            return
        per_sample = self.session.terms.ticks_per_sample
        for done in self.session.following.take_confirmed():
            pairs = zip(done.flown.coded, done.live, strict=True)
            self.scores.on_word(done.word, done.about)
            for tick, (coded, live) in enumerate(pairs, done.sample * per_sample):
                self.scores.on_estimate(tick, coded, live)
            if self.gauge is not None:
                self._gauge(self.gauge, done)

    def _gauge(self, gauge: GapGauge, done: Confirmed) -> None:
        gauge.on_confirmed(done)
        if (done.sample + 1) % self._gauge_samples == 0:
            time_ns = done.sample * self.session.terms.sample_ns
            self._recorder.write(GAP_CHANNEL, time_ns, gauge.row(done.sample))

    def actuate(self, tick: int, lateness_ns: int = 0) -> Vector:
        """Put the tick's voltages on the motors; return them."""
        reading = self._reading
        if reading is None:
            raise RuntimeError(f"tick {tick} is actuated before it was measured")
        session = self.session
        if session.phase is Phase.ENDED:
            self.guard.trip(GuardReason(GuardCause.SESSION_ENDED, tick))
        asleep = session.phase in (Phase.GREETING, Phase.ENDED)
        command = None if asleep else session.command(tick)
        owed = session.phase is Phase.FLYING and tick >= session.epoch_tick
        late = command is None and owed and not self.guard.stopped
        self.commands_late += late
        volts = self.guard.apply(tick, command, session.owing.owed_ticks(tick))
        stopped = self.guard.stopped
        self.ticks_down += stopped
        if command is not None and not stopped:
            self.ticks_commanded += 1
            self.ticks_at_limit += session.terms.limits.reached(command)
        self.rig.write(tick, volts)
        self._applied = volts if reading.applied_volts is None else reading.applied_volts
        time_ns = tick * self.session.terms.tick_ns
        self._recorder.write(
            TICK_CHANNEL,
            time_ns,
            (
                tick,
                time_ns / 1e9,
                reading.measured,
                reading.true,
                command,
                self._applied,
                late,
                lateness_ns / 1e6,
                self.guard.state.value,
            ),
        )
        if self.guard.state is not self._guard_reported:
            self._tell_guard()
        return volts

    @property
    def latched(self) -> bool:
        """Return whether the guard has reached the safe voltage and stays there."""
        return self.guard.state is GuardState.LATCHED

    @property
    def over(self) -> bool:
        """Return whether the flight is over: latched, and nothing left to wait for."""
        return self.latched and not self._may_rearm

    @property
    def _may_rearm(self) -> bool:
        session = self.session
        return (
            self._rearm_ticks is not None
            and self.guard.timed_out
            and session.phase in (Phase.FLYING, Phase.REJOINING)
            and self.tick - session.heard_tick <= self._rearm_ticks
        )

    def conclude(self, tick: int) -> None:
        """Note that the flight ends before `tick`."""
        self.session.conclude(tick, withheld=self.guard.stopped)

    def stop(self) -> None:
        """Take the motors down because a person or a signal asked for it."""
        self.guard.trip(GuardReason(GuardCause.STOPPED, self.tick))

    def tell(self, event: Event) -> None:
        time_ns = self.tick * self.session.terms.tick_ns
        event = replace(event, time_ns=time_ns, sample=self.session.confirmed_state.sample)
        self.session.events.append(event)
        write_event(self._recorder, event)

    def on_malformed(self, why: str) -> None:
        self.tell(Event(EventKind.MALFORMED, detail=why))

    def _check(self, tick: int, reading: Reading) -> None:
        session, fault = self.session, reading.fault
        if fault is None and self._watch is not None:
            fault = self._watch.check(reading.counts, self._applied, session.reliable_state)
        if fault is not None and not self.guard.stopped:
            self.sensor_fault = GuardReason(GuardCause.SENSOR, tick, detail=fault)
            self.tell(Event(EventKind.SENSOR, tick=tick, detail=fault))
            self.guard.trip(self.sensor_fault)
        self.guard.check_outputs(tick, reading.measured)

    def _tell_guard(self) -> None:
        self._guard_reported = self.guard.state
        if self.guard.state is not GuardState.RUNNING:
            reason = self.guard.reason
            event = Event(EventKind.GUARD, state=self.guard.state)
            self.tell(event if reason is None else replace(event, **asdict(reason)))


def _down_slots(session: TransmitterSession) -> SlotFinder | None:
    """Return what finds the slots of symbol bytes that come down; None where none come."""
    if not session.terms.is_narrow:
        return None
    finder = SlotFinder(session.terms.down_grid)
    finder.expect(session.line_delay_ns)
    return finder


class TransmitterEndpoint:
    """A node with its way in and its way out."""

    def __init__(self, node: TransmitterNode, uplink: Uplink) -> None:
        self.node = node
        self.uplink = uplink
        self.inlet = Inlet(uplink.wire, node.on_malformed, self._require_whole)
        self.down_baud = BaudMeter()
        """of the symbols of a narrow downlink"""
        self._down_slots = _down_slots(node.session)
        self.lateness = LatenessMeter()
        """of the ticks; on the virtual clock none is late"""
        self.ticks_missed = 0
        self.rate = RateWatch(node.session.terms)
        """whether the symbol rate is kept; a real loop looks at it"""
        self.tick = 0
        """the next one, or the one in hand"""
        self._end_tick = 0
        self._tick_ns = node.session.terms.tick_ns
        self._lateness_ns = 0

    def _require_whole(self, frame: ShortCommands) -> None:
        session = self.node.session
        if session.compact is None:
            no_compact_commands(frame)
        else:
            session.compact.require_whole(frame, session.session_number)

    @property
    def greeting(self) -> bool:
        """Return whether neither a session nor a refusal has come."""
        session = self.node.session
        return session.phase is Phase.GREETING and session.refusal is None

    def hello(self, now_ns: int) -> list[Delivery]:
        """Ask for a session; to be repeated while `greeting`."""
        return self._offer([self.node.session.hello()], now_ns)

    def begin(self, ticks: int) -> None:
        """Plan the given number of ticks.

        The first one is that of the session's first sample, which is not 0 when the receiver has been
        flying before.
        """
        self.tick = self.node.session.epoch_tick
        self._end_tick = self.tick + ticks

    @property
    def next_due_ns(self) -> int | None:
        return self.tick * self._tick_ns if self.tick < self._end_tick else None

    def begin_tick(self, now_ns: int) -> list[Delivery] | None:
        """Read the rig at the tick that is due; return what leaves, or None at the end of the flight.

        Ticks that have passed by `now_ns` are gone.
        """
        self._lateness_ns = now_ns - self.tick * self._tick_ns
        if self._lateness_ns:
            missed = min(self._lateness_ns // self._tick_ns, self._end_tick - self.tick)
            self.ticks_missed += missed
            self.tick += missed
            if self.tick == self._end_tick:
                return None
            self.lateness.add(self._lateness_ns)
        frames = None if self.node.over else self.node.measure(self.tick)
        return None if frames is None else self._offer(frames, now_ns)

    def end_tick(self) -> None:
        """Put the tick's voltages on the motors."""
        self.node.actuate(self.tick, self._lateness_ns)
        self.tick += 1

    def take(self, data: bytes, now_ns: int) -> list[Delivery]:
        """Take a message that arrived; return the answers."""
        frame = self.inlet.take(data)
        if isinstance(frame, ShortSymbol):
            frame = self._located(frame, now_ns)
        if frame is None:
            return []
        counts = self.node.session.counts
        before = counts["down_came"]
        answers = self.node.deliver(frame)
        if counts["down_came"] > before:
            self.down_baud.on_slot(now_ns, came=True)
        return self._offer(answers, now_ns)

    def _located(self, symbol: ShortSymbol, now_ns: int) -> DownSymbol | None:
        """Return the down symbol in a byte of a serial line; None, counted, where it fits no slot."""
        session = self.node.session
        if self._down_slots is None or session.phase is not Phase.FLYING:
            session.counts["stale_frames"] += 1
            return None
        place = self._down_slots.find(symbol, 0, now_ns)
        if place.in_time and place.slot is not None:
            return DownSymbol(session.session_number, session.epoch, place.slot, symbol.number)
        session.counts["symbols_misplaced"] += 1
        self.node.tell(Event(EventKind.STALE, slot=symbol.slot_low, cause=Dropped.NOT_DUE))
        return None

    def farewell(self, end: End) -> list[bytes]:
        """End the session; return the messages that tell the receiver.

        They bypass the line's delay and impairments: this process is about to end.
        """
        return [self.uplink.encoded(frame) for frame in self.node.session.bye(end)]

    def _offer(self, frames: Iterable[Frame], now_ns: int) -> list[Delivery]:
        return [one for frame in frames for one in self.uplink.offer(frame, now_ns)]
