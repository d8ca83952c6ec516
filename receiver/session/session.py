"""The controller node's half of the protocol, without a socket, a clock or a thread.

Three things drive it: a frame that arrived (`on_frame`), a deadline that passed (`on_deadline`) and
the end of the flight (`bye`). Each returns the frames to send. The receiver decides, once per slot,
what was received: the symbol, or nothing by the time of a later one or of the deadline. What it
decided goes back with every command frame, and that echo is what the transmitter's copy consumes.

A transmitter that asks for a session gets one, and one that asks again a new epoch of it: a start
sample, the state to start from, and the command to hold until the first one decided (`rejoin`).
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import replace
from enum import Enum

from channel.codec.codec import ERASED, Codec, CodecState
from channel.codec.downlink.machine import TwoWay
from channel.codec.lead import Fly, fly_sample
from channel.line.meters import BaudMeter
from channel.protocol.bounds import Bounds, within_text_bounds
from channel.protocol.endings import End, Ending
from channel.protocol.events import Dropped, Event, EventKind, Presence, ended_event, write_event
from channel.protocol.frames import (
    Bye,
    Desync,
    ForeignVersion,
    Frame,
    Hello,
    LocatedSymbol,
    Refuse,
    Symbol,
    Unknown,
    Welcome,
)
from channel.protocol.identity import Identity
from channel.protocol.lockstep import History, difference_event, write_failure
from channel.protocol.recording import NullRecorder, Recorder
from channel.protocol.terms import Terms
from channel.protocol.wire import foreign_version_text
from receiver.controllers.base import Controller
from receiver.session.asking import Asker
from receiver.session.commander import Begins, Commander, EchoCommander
from receiver.session.narrow import NarrowCommander
from receiver.session.records import write_symbol
from receiver.session.rejoin import Greeter, Takeover, Verdict, desync_answer, difference, first_sample
from receiver.session.schedule import Proven, Schedule, SlotClock, Timing

EPOCH_MAX = 0xFFFF


class Phase(Enum):
    """Phase of the receiver's session."""

    WAITING = "waiting"  # for a transmitter
    FLYING = "flying"
    ENDED = "ended"


class ReceiverSession:
    """Converts symbols to commands; see the module's text.

    `session_number` is drawn by the caller (32 bits, not zero), so that the session itself stays
    deterministic. `take_over`: claim a flight that another receiver has. `two_way`: the state machine
    of the narrow downlink. `fly`: what computes the samples of another downlink.
    """

    def __init__(
        self,
        codec: Codec,
        terms: Terms,
        controller: Controller,
        identity: Identity,
        session_number: int,
        recorder: Recorder | None = None,
        *,
        take_over: bool = False,
        begins: Begins | None = None,
        two_way: TwoWay | None = None,
        fly: Fly = fly_sample,
    ) -> None:
        self.codec = codec
        self.terms = terms
        self.identity = identity
        self.session_number = session_number
        self.phase = Phase.WAITING
        self.epoch = 0
        self.meter = BaudMeter()
        self.counts: Counter[str] = Counter()
        """samples (flown), samples_skipped (between epochs), erasures (words), symbols_late,
        symbols_misplaced, stale_frames, malformed, refused_hellos, bad_commands, bad_references,
        desyncs, rejoins, out_of_bounds"""
        self.end: End | None = None
        self.refusal: End | None = None
        self.desync: Desync | None = None
        self.events: deque[Event] = deque(maxlen=1000)
        self._greeter = Greeter(terms)
        self._takeover = Takeover(session_number, take_over)
        self._recorder = recorder or NullRecorder()
        asker = Asker(controller, len(terms.signals.outputs), self.counts, self._emit)
        self._commander: Commander = (
            EchoCommander(codec, terms, asker, self._recorder, begins, fly)
            if two_way is None
            else NarrowCommander(two_way, terms, asker, self._recorder, begins)
        )
        self._clock = SlotClock(terms)
        self._word: list[int | None] = []
        self._advanced = False
        """whether a symbol of this epoch has been received"""
        self._bounds = Bounds(codec, terms, self.counts, self._emit)
        self._schedule = Schedule(terms)
        self._proven = Proven(self._commander.standing, self._schedule, 0, None)

    @property
    def state(self) -> CodecState:
        """Return the codec's state before the next sample."""
        return self._commander.state

    @property
    def controller_problem(self) -> str:
        """Return what was wrong with the controller's first bad command; empty without one."""
        return self._commander.first_problem

    @property
    def due_slot(self) -> int | None:
        """Return the slot that is not settled yet; None while no flight is on."""
        return self._clock.slot if self.phase is Phase.FLYING else None

    def flight_ns(self, now_ns: int) -> int:
        """Return the flight time by which down symbols have their slots."""
        return self._schedule.flight_ns(now_ns)

    @property
    def history(self) -> History:
        """Return the last states, for a failure to be looked into."""
        return self._commander.history

    # What arrives

    def on_frame(self, frame: Frame, now_ns: int) -> list[Frame]:
        """Take one frame that arrived at `now_ns` of this end's clock; return the frames to send."""
        if isinstance(frame, Symbol):
            return self._on_symbol(frame, now_ns)
        frame = within_text_bounds(frame)
        match frame:
            case LocatedSymbol() if self.phase is Phase.FLYING:
                return self._on_located_symbol(frame, now_ns)
            case Hello():
                return self._on_hello(frame, now_ns)
            case Desync() if self._is_current(frame.session):
                return self._on_desync(frame)
            case Bye() if self._is_current(frame.session):
                self._end(End(frame.ending, frame.text, by_peer=True))
            case Bye() if frame.session == 0 and self._takeover.asked and self.phase is Phase.WAITING:
                self._end(End(frame.ending, frame.text, by_peer=True))
            case Bye() if self.refusal is not None and frame.session == 0:
                self.refusal = replace(self.refusal, answer=frame.text)
                self._end(self.refusal)
            case ForeignVersion() if self.phase is Phase.WAITING:
                text = foreign_version_text("transmitter", frame.version)
                self._refuse(End(Ending.WIRE_VERSION, text))
            case _:
                self.counts["stale_frames"] += 1
        return []

    def next_deadline(self) -> int | None:
        """Return when the slot that is due is taken for erased; None while none is."""
        return self._clock.deadline_ns if self.phase is Phase.FLYING else None

    def on_deadline(self, now_ns: int) -> list[Frame]:
        """Erase the slots whose deadline has passed by `now_ns`; return the frames to send."""
        frames: list[Frame] = []
        if self.phase is not Phase.FLYING:
            return frames
        for slot in self._clock.expired(now_ns):
            frames += self._settle(slot, None, now_ns)
            if self._clock.is_silent:
                self._clock.anchor(None)
                number = self.terms.history_samples
                self._emit(Event(EventKind.PEER, cause=Presence.SILENT, number=number))
        return frames

    def bye(self, end: End) -> list[Frame]:
        was_flying = self.phase is Phase.FLYING
        self._end(end)
        return [Bye(self.session_number, end.ending, end.text)] if was_flying else []

    def on_malformed(self, why: str) -> None:
        self.counts["malformed"] += 1
        self._emit(Event(EventKind.MALFORMED, detail=why))

    def flush_records(self) -> None:
        """Do the work that can wait until the frames are sent: the recording."""
        self._commander.write_down()

    # The handshake

    def _on_hello(self, hello: Hello, now_ns: int) -> list[Frame]:
        if self.phase is Phase.ENDED:
            return [
                Refuse(hello.incarnation, Ending.ALREADY_ENDED, self.end.text if self.end else "", "")
            ]
        if self._bounds.drops(self._bounds.of_hello(hello)):
            return []
        schedule = self._schedule if self._advanced else self._proven.schedule
        in_reach = schedule.reaches(hello.sample, now_ns)
        silent = self._clock.silent_slots
        verdict = self._greeter.judge(hello, self.identity, self._advanced, silent, in_reach)
        if verdict is Verdict.REPEAT and self._greeter.welcome is not None:
            return [self._greeter.welcome]
        if verdict is Verdict.BEGIN:
            return self._begin(hello, now_ns)
        self.counts["refused_hellos"] += 1
        match verdict:
            case Verdict.BUSY:
                return [Refuse(hello.incarnation, Ending.BUSY, "", "")]
            case Verdict.IGNORE if not in_reach:
                self._bounds.drops(f"a request for sample {hello.sample}, ahead of the clock")
            case Verdict.REFUSE:
                problem = difference(hello, self.identity) or ""
                self._refuse(End(Ending.MISMATCH, problem))
                return [Refuse(hello.incarnation, Ending.MISMATCH, problem, self.identity.config)]
        return []

    def _begin(self, hello: Hello, now_ns: int) -> list[Frame]:
        """Begin a session, or a new epoch of it; return the answer."""
        last = self._greeter.welcome
        own = self._stand_where_proven(last)
        proven = self._proven.incarnation
        lead = self._greeter.lead_samples(hello)
        first = first_sample(hello, own, lead, begun=proven is not None)
        count = self.terms.symbols_per_word
        same = hello.incarnation == (last and last.incarnation if proven is None else proven)
        if last is None:
            self.phase = Phase.FLYING
            self.refusal = None
            self._commander.restart(first)
        elif self.epoch >= EPOCH_MAX:
            self._end(End(Ending.REJOINS))
            return [Bye(self.session_number, Ending.REJOINS)]
        else:
            self.epoch += 1
            self.counts["rejoins"] += 1
            self.counts["samples_skipped"] += max(0, first - self.state.sample)
            if same:
                self._commander.carry_on(first, self._proven.silent_slots // count)
            else:
                # A restarted rig is at rest, and so is its estimate.
                self._commander.restart(first)
        self._clock, self._word, self._advanced = SlotClock(self.terms, first * count), [], False
        self._schedule = Schedule(self.terms)
        self._schedule.begin(first * count, now_ns)
        start = self._commander.begin(self.epoch, afresh=last is None or not same)
        asked = (hello.incarnation, hello.request)
        welcome = Welcome(self.session_number, self.epoch, first, *asked, *start)
        self._greeter.answer_with(welcome)
        kind = EventKind.STARTED if last is None else EventKind.REJOIN
        self._emit(Event(kind, first, session=self.session_number, epoch=self.epoch))
        return [welcome]

    def _stand_where_proven(self, last: Welcome | None) -> int:
        """Undo an offer that was never flown; return this end's next sample."""
        if self._advanced and last is not None:
            standing, silent = self._commander.standing, self._clock.silent_slots
            self._proven = Proven(standing, self._schedule, silent, last.incarnation)
            return self.state.sample + (1 if self._word else 0)
        self._commander.go_back(self._proven.standing)
        return self.state.sample

    def _refuse(self, refusal: End) -> None:
        if self.refusal is None:
            self._emit(Event(EventKind.REFUSED, cause=refusal.ending, detail=refusal.text))
        if self.phase is Phase.WAITING:
            self.refusal = refusal

    # Symbols, slots, words

    def _on_symbol(self, symbol: Symbol, now_ns: int) -> list[Frame]:
        if not self._is_current(symbol.session) or symbol.epoch != self.epoch:
            self.counts["stale_frames"] += 1
            return self._on_foreign_symbol(symbol)
        if self._bounds.drops(self._bounds.of_symbol(symbol)):
            return []
        if symbol.slot < self._clock.slot:
            return self._on_late_symbol(symbol, now_ns)
        timing = self._schedule.timing(symbol.slot, now_ns)
        if timing is Timing.EARLY:
            self._bounds.drops(f"slot {symbol.slot} is not due yet")
            return []
        return self._take_symbol(symbol, now_ns, anew=timing is Timing.NEW)

    def _take_symbol(self, symbol: Symbol, now_ns: int, *, anew: bool) -> list[Frame]:
        """Consume a symbol of a slot that is due. `anew`: it replaces the schedule."""
        if not self._clock.bridges(symbol.slot):
            ahead = symbol.slot - self._clock.slot
            self.counts["stale_frames"] += 1
            self._emit(Event(EventKind.STALE, slot=symbol.slot, cause=Dropped.FAR_AHEAD, number=ahead))
            return [Unknown(symbol.session, symbol.epoch)]
        self._advanced = True
        self._greeter.on_symbol()
        frames: list[Frame] = []
        for slot in self._clock.take(symbol.slot):
            frames += self._settle(slot, None, now_ns)
        self._clock.anchor(self._schedule.take(symbol.slot, now_ns, anew=anew))
        write_symbol(self._recorder, self.terms, symbol, now_ns, taken=True)
        value = self.codec.coder.alphabet.symbols[symbol.number]
        return frames + self._settle(symbol.slot, value, now_ns)

    def _on_late_symbol(self, symbol: Symbol, now_ns: int) -> list[Frame]:
        """Drop a symbol of a slot that is settled; a row of them means that the schedule is wrong."""
        self.counts["symbols_late"] += 1
        write_symbol(self._recorder, self.terms, symbol, now_ns, taken=False)
        self._emit(Event(EventKind.LATE_SYMBOL, slot=symbol.slot, cause=Dropped.SETTLED))
        near = self._clock.bridges(symbol.slot)
        if near and self._schedule.is_replaced_by(symbol.slot, now_ns):
            self._clock.anchor(self._schedule.take(symbol.slot, now_ns, anew=True))
        return []

    def _on_foreign_symbol(self, symbol: Symbol) -> list[Frame]:
        """Answer a transmitter that flies in a session or an epoch that is not the present one."""
        if self.phase is Phase.WAITING and self.refusal is None:
            return self._takeover.on_symbol(symbol)
        welcome = self._greeter.welcome
        current = self._is_current(symbol.session)
        if current and symbol.epoch > self.epoch:
            # This end has begun no such epoch: somebody else has answered in its name.
            return [Unknown(symbol.session, symbol.epoch)]
        missed = current and symbol.epoch < self.epoch
        if missed and not self._advanced and welcome is not None:
            # It flies on without knowing of the new epoch: the answer was lost.
            return [welcome]
        return []

    def _on_located_symbol(self, place: LocatedSymbol, now_ns: int) -> list[Frame]:
        """Take a symbol without a session number as one of this session."""
        frames: list[Frame] = []
        if place.slot is None:
            self.counts["symbols_misplaced"] += 1
            self._emit(Event(EventKind.STALE, slot=place.slot_low, cause=Dropped.NOT_DUE))
        elif place.in_time:
            symbol = Symbol(self.session_number, self.epoch, place.slot, place.number)
            if not self._bounds.drops(self._bounds.of_symbol(symbol)):
                frames = self._take_symbol(symbol, now_ns, anew=True)
        else:
            self.counts["symbols_late"] += 1
            self._emit(Event(EventKind.LATE_SYMBOL, slot=place.slot, cause=Dropped.PAST_DEADLINE))
        if place.anchor is not None:
            self._clock.anchor(place.anchor)
        return frames

    def _settle(self, slot: int, symbol: int | None, now_ns: int) -> list[Frame]:
        """Decide what this slot's symbol was; at the end of a word, fly its sample."""
        self.meter.on_slot(now_ns, came=symbol is not None)
        if symbol is None:
            self._emit(Event(EventKind.ERASED, slot=slot))
        self._word.append(symbol)
        if len(self._word) < self.terms.symbols_per_word:
            return []
        symbols = [value for value in self._word if value is not None]
        whole = len(symbols) == len(self._word)
        self._word = []
        word = tuple(symbols) if whole else ERASED
        self.counts["samples"] += 1
        self.counts["erasures"] += not whole
        return self._commander.fly(word, self.session_number, self.epoch, now_ns)

    # Ends and reports

    def _on_desync(self, theirs: Desync) -> list[Frame]:
        """Record a failure and answer with this end's state; the request that follows rejoins."""
        if self._bounds.drops(self._bounds.of_report(theirs, self.epoch, self.state.sample)):
            return []
        answer = desync_answer(theirs, self.history, self.codec)
        last = self.desync
        if last is None or (theirs.epoch, theirs.sample) > (last.epoch, last.sample):
            self.desync = theirs
            self.counts["desyncs"] += 1
            self._emit(difference_event(theirs))
            period_ns = self.terms.sample_ns
            write_failure(self._recorder, period_ns, self.history, theirs, theirs.state, received=True)
        return [answer]

    def _is_current(self, session: int) -> bool:
        return self.phase is Phase.FLYING and session == self.session_number

    def _end(self, end: End) -> None:
        if self.phase is not Phase.ENDED:
            self.phase = Phase.ENDED
            self.end = end
            self.flush_records()
            self._emit(ended_event(end))

    def _emit(self, event: Event) -> None:
        at = self.state.sample if event.sample is None else event.sample
        flight_ns = self.state.sample * self.terms.sample_ns
        event = replace(event, time_ns=flight_ns, sample=at)
        self.events.append(event)
        write_event(self._recorder, event)
