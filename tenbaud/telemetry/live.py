"""Commands of viewers, applied by the loop between two ticks or two messages, and recorded.

The recording of a steered flight holds every command as an event, with the sample before which it
took hold. Which of them were obeyed where:

    set_point      receiver
    pause, step, pace   transmitter, on the virtual clock, whose time is its own
    impair         the owner of the line: the transmitter both ways on the virtual clock, else each end
                   what it sends
    corrupt        the end named; the transmitter also notes that a difference is now expected
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

from channel.line.impairments import impair, parse_impairments
from channel.links.base import Role
from channel.protocol.events import ByHand, Event, EventKind, write_event
from channel.protocol.recording import Recorder
from channel.protocol.sabotage import SabotagedCodec, parse_sabotage
from receiver.controllers.references import SteeredReference
from receiver.endpoint import ReceiverEndpoint
from tenbaud.build.transmitter_run import Stop, TransmitterRun
from tenbaud.sentences.quantities import amount
from tenbaud.telemetry.command_queue import CommandQueue
from tenbaud.telemetry.schema import Command, Corrupt, Impair, Pace, Pause, SetPoint, Step

PAUSE_POLL_S = 0.02
KEEP_ALIVE_S = 0.5
"""How often a paused flight tells the receiver that it is still there."""


class LiveTransmitter:
    """Commands to the sensor node; its loop calls `at_tick` before every tick.

    `pace`: virtual seconds per second at most, None for no limit. `keep_alive` is called now and then
    while the flight is paused.
    """

    def __init__(
        self,
        run: TransmitterRun,
        queue: CommandQueue | None,
        should_stop: Stop,
        pace: float | None = None,
        keep_alive: Callable[[], object] = lambda: None,
    ) -> None:
        self.queue = queue
        self.pace = pace
        self.impairments = run.agreement.config.link.impairments
        self.keep_alive = keep_alive
        self._run = run
        self._should_stop = should_stop
        self._virtual = run.agreement.clock == "virtual"
        self._pause_tick: int | None = None
        self._anchor: tuple[int, float] | None = None
        """tick and wall-clock time that the pace counts from"""
        self.paused = False

    def at_tick(self, tick: int) -> None:
        """Obey what has been asked, and wait as long as the pace or a pause wants."""
        self._obey(tick)
        if not self._virtual:
            return
        if self._pause_tick is not None:
            self._stand_still(tick)
        if self.pace is not None and not self._should_stop():
            self._keep_pace(tick, self.pace)

    def _obey(self, tick: int) -> None:
        while self.queue is not None and (command := self.queue.take()) is not None:
            event = self._one(command, tick)
            if event is not None:
                self._run.node.tell(replace(event, tick=tick))

    def _one(self, command: Command, tick: int) -> Event | None:
        """Obey one command; return what to write down, None where it is the other end's alone."""
        match command:
            case Pause() | Step() | Pace() if not self._virtual:
                return _ignored("a real clock can be neither stopped nor paced")
            case Pause(paused=True):
                self._pause_tick = self._next_sample_tick(tick)
                return _by_hand(ByHand.PAUSE, number=self._pause_tick)
            case Pause():
                self._pause_tick = None
                return _by_hand(ByHand.GO_ON)
            case Step(samples=samples):
                per_sample = self._run.agreement.terms.ticks_per_sample
                self._pause_tick = self._next_sample_tick(tick) + samples * per_sample
                return _by_hand(ByHand.PAUSE, number=self._pause_tick)
            case Pace(factor=factor):
                self.pace, self._anchor = factor, None
                return _by_hand(ByHand.PACE, value=factor)
            case Impair(text=text):
                return self._impair(text)
            case Corrupt(end=end, field=field):
                return self._corrupt(end, field)
            case SetPoint():
                self._run.node.scores.forget_reference()
        return None

    def _impair(self, text: str) -> Event:
        faults = parse_impairments(text)
        self.impairments = text
        impair(self._run.uplink.line, faults.up)
        impair(self._run.downlink, faults.down)
        if faults.up.raw or faults.down.raw:
            self._run.expect_desyncs(math.inf)
        return _by_hand(ByHand.IMPAIR, detail=text)

    def _corrupt(self, end: Role, field: str) -> Event | None:
        session = self._run.node.session
        # Both codecs are the same kind: what this one cannot do, the receiver's refuses too.
        event = corrupt(session, field, session.next_sample, end == "transmitter")
        if event.cause is ByHand.CORRUPT:
            self._run.expect_desyncs(1)
        return event if end == "transmitter" else None

    def _next_sample_tick(self, tick: int) -> int:
        per_sample = self._run.agreement.terms.ticks_per_sample
        return -(-tick // per_sample) * per_sample

    def _stand_still(self, tick: int) -> None:
        sent_at = time.monotonic()
        while self._pause_tick is not None and tick >= self._pause_tick and not self._should_stop():
            self.paused = True
            time.sleep(PAUSE_POLL_S)
            if time.monotonic() - sent_at >= KEEP_ALIVE_S:
                sent_at = time.monotonic()
                self.keep_alive()
            self._obey(tick)
        if self.paused:
            self.paused, self._anchor = False, None

    def _keep_pace(self, tick: int, pace: float) -> None:
        now_s = time.monotonic()
        if self._anchor is None:
            self._anchor = (tick, now_s)
        first, since_s = self._anchor
        due_s = since_s + (tick - first) * self._run.agreement.terms.tick_ns / 1e9 / pace
        if now_s < due_s:
            time.sleep(due_s - now_s)
        elif now_s - due_s > 0.5:
            # Held up: go on from here instead of rushing after the time that was lost.
            self._anchor = (tick, now_s)


class LiveReceiver:
    """Commands to the controller node; its loop calls `should_stop` between messages."""

    def __init__(
        self,
        endpoint: ReceiverEndpoint,
        queue: CommandQueue | None,
        should_stop: Stop,
        recorder: Recorder,
        steering: tuple[SteeredReference | None, ...] | None,
        impairments: str,
    ) -> None:
        self.queue = queue
        self.steering = steering
        self.impairments = impairments
        self._endpoint = endpoint
        self._should_stop = should_stop
        self._recorder = recorder

    def __call__(self) -> bool:
        """Obey what has been asked; return whether the flight was asked to stop."""
        while self.queue is not None and (command := self.queue.take()) is not None:
            event = self._one(command)
            if event is not None:
                self._tell(event)
        return self._should_stop()

    def _one(self, command: Command) -> Event | None:
        session = self._endpoint.session
        match command:
            case SetPoint(value=value, output=place):
                return self._steer(place, value)
            case Impair(text=text):
                self.impairments = text
                if impair(self._endpoint.downlink.line, parse_impairments(text).down):
                    return _by_hand(ByHand.IMPAIR, detail=text)
            case Corrupt(end="receiver", field=field):
                return corrupt(session, field, session.state.sample)
        return None

    def _steer(self, place: int, value: float | None) -> Event:
        outputs = self._endpoint.session.terms.signals.outputs
        steering = self.steering[place] if self.steering and place < len(self.steering) else None
        if steering is None or place >= len(outputs):
            return _ignored("this controller has no such set-point")
        output = outputs[place]
        low, high = max(output.low, steering.stops[0]), min(output.high, steering.stops[1])
        if value is not None and not low <= value <= high:
            ends = " and ".join(amount(end, output.unit) for end in (low, high))
            return _ignored(f"{output.words} is within {ends}")
        steering.steer(value)
        if value is None:
            return _by_hand(ByHand.FOLLOW)
        detail = f"{output.unit} of {output.name}" if len(outputs) > 1 else output.unit
        return _by_hand(ByHand.SET_POINT, value=value, detail=detail.strip())

    def _tell(self, event: Event) -> None:
        session = self._endpoint.session
        sample = session.state.sample
        time_ns = sample * session.terms.sample_ns
        event = replace(event, time_ns=time_ns, sample=sample)
        session.events.append(event)
        write_event(self._recorder, event)


def corrupt(session: object, field: str, sample: int, arm: bool = True) -> Event:
    """Change one field of a session's codec in one bit after a sample; `arm` False: only look.

    Return the event; its cause is IGNORED for a codec without such a field: a person's command must not
    end the flight.
    """
    codec = getattr(session, "codec", None)
    if not isinstance(codec, SabotagedCodec):
        return _ignored("this codec cannot be changed")
    sabotage = parse_sabotage(f"sample={sample},field={field}")
    try:
        # Arming checks too.
        (codec.arm if arm else codec.check)(sabotage)
    except ValueError as error:
        return _ignored(str(error))
    return _by_hand(ByHand.CORRUPT, detail=field)


def _by_hand(
    cause: ByHand, *, value: float | None = None, number: int | None = None, detail: str | None = None
) -> Event:
    return Event(EventKind.CONTROL, cause=cause, value=value, number=number, detail=detail)


def _ignored(why: str) -> Event:
    return _by_hand(ByHand.IGNORED, detail=why)
