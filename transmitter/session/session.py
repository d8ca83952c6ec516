"""The sensor node's half of the protocol, without a socket, a clock or a thread.

Inputs: a measurement at every tick (`on_measurement`), a frame that arrived (`on_frame`), and requests
for a tick's command (`command`). A slot's symbol depends on the measurement at its sample's first tick
and on what is known of the receiver's state (`transmitter.session.following`). After a loss of lockstep
(the states differ, echoes are lost or too old, the receiver was restarted) the session sends no symbols
until the answer has a common state.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import replace
from enum import Enum

from channel.codec.codec import Codec, CodecState, Vector
from channel.codec.downlink.machine import TwoWay
from channel.protocol.bounds import Bounds, shown, within_text_bounds
from channel.protocol.compact import compact_form
from channel.protocol.endings import End, Ending
from channel.protocol.events import ASKED, Event, EventKind, ended_event, write_event
from channel.protocol.frames import (
    Bye,
    Claim,
    Commands,
    Desync,
    DownSymbol,
    ForeignVersion,
    Frame,
    Hello,
    Refuse,
    ShortCommands,
    Symbol,
    Unknown,
    Welcome,
    Why,
)
from channel.protocol.identity import Identity, differing_fields
from channel.protocol.lockstep import difference_event, is_answer, write_failure
from channel.protocol.recording import NullRecorder, Recorder
from channel.protocol.terms import Terms
from channel.protocol.wire import foreign_version_text
from transmitter.session.copies import CANNOT_FLY, Confirmed
from transmitter.session.down_symbols import NarrowFollowing
from transmitter.session.echoes import EchoFollowing, diverged
from transmitter.session.following import Following, Lost, Parts
from transmitter.session.owing import Owing
from transmitter.session.rejoin import Asking
from transmitter.session.state_observer import StateObserver, default_observer
from transmitter.session.takeover import Takeover


class Phase(Enum):
    """Phase of the transmitter's session."""

    GREETING = "greeting"  # waiting for a receiver
    FLYING = "flying"
    REJOINING = "rejoining"  # asking for a common state
    ENDED = "ended"


class TransmitterSession:
    """Converts measurements to symbols and echoes to commands; see the module's text.

    `incarnation` is drawn by the caller (32 bits), so that the session itself stays deterministic.
    `stop_on_desync`: end the flight at the first digest that differs, instead of rejoining.
    `state_observer`: finds the states for a coder that uses rates; None: that of angle and rate.
    `overtaking_ticks`: how long after a command frame one may come that was sent before it.
    `two_way`: the state machine of the narrow downlink; `line_delay_ns`: by how much the two lines may
    delay its symbols beyond what is agreed.
    """

    def __init__(
        self,
        codec: Codec,
        terms: Terms,
        identity: Identity,
        incarnation: int,
        recorder: Recorder | None = None,
        *,
        stop_on_desync: bool = False,
        state_observer: StateObserver | None = None,
        overtaking_ticks: int = 0,
        two_way: TwoWay | None = None,
        line_delay_ns: int = 0,
    ) -> None:
        self.codec = codec
        self.terms = terms
        self.line_delay_ns = line_delay_ns
        self.identity = identity
        self.incarnation = incarnation
        self.phase = Phase.GREETING
        self.session_number = 0
        self.epoch = 0
        self.counts: Counter[str] = Counter()
        """confirmed, digest_checks, desyncs, rejoins, stale_frames, words_missed, erasures,
        claims_refused, take_overs, out_of_bounds, diverged; narrow: hash_symbols (that came, of
        confirmed samples), down_came, down_late and down_erased (symbols)"""
        self.rejoins_asked: Counter[Why] = Counter()
        self.end: End | None = None
        self.refusal: End | None = None
        self.desync: Desync | None = None
        """the last one"""
        self._report_answered = False
        self.heard_tick = 0
        """when the receiver last sent something new in the present epoch"""
        self.epoch_tick = 0
        """first tick of the present epoch"""
        self.owing = Owing(terms)
        self.events: deque[Event] = deque(maxlen=1000)
        self._asking = Asking(identity, incarnation, terms)
        self._takeover = Takeover(terms)
        self._bounds = Bounds(codec, terms, self.counts, self._emit, two_way)
        self._stop_on_desync = stop_on_desync
        self._observer = state_observer or default_observer(codec, terms.tick_ns / 1e9)
        self._recorder = recorder or NullRecorder()
        self._tick = -1
        self.compact = compact_form(codec, terms)
        parts = Parts(
            codec, terms, self.counts, self._bounds, self.owing, self._recorder, self._on_heard
        )
        self._parts = parts
        self.following: Following = (
            EchoFollowing(parts, overtaking_ticks)
            if two_way is None
            else NarrowFollowing(parts, two_way, line_delay_ns)
        )

    # What happens at a tick

    def hello(self) -> Hello:
        """Return the frame that requests a session; to be repeated until there is one."""
        return self._asking.hello(self.session_number, self.epoch, self._tick)

    def on_measurement(self, tick: int, measurement: Vector) -> list[Frame]:
        """Take the measurement of a tick; return the frames that leave with it.

        These are the symbols of the sample that begins with it, or the request for a new epoch. A word
        has a slot for each of its symbols; the sender holds each until its slot. A tick that
        was never seen, because the process was held up, sent no symbol: its sample's word counts as
        not sent, and the next sample starts afresh.
        """
        self._tick = tick
        if self._observer is not None:
            measurement = self._observer.look(tick, measurement, self.following.last_command)
        if self.phase is Phase.REJOINING:
            return self._ask()
        if self.phase is not Phase.FLYING:
            return []
        sample, offset = divmod(tick, self.terms.ticks_per_sample)
        if lost := self.following.at_tick(tick):
            return self._lose(lost)
        if offset != 0 or self.following.next_sample != sample:
            return []
        try:
            word = self.following.encode(measurement)
        except CANNOT_FLY as error:
            return self._lose(diverged(self._parts, error))
        first = sample * self.terms.symbols_per_word
        number = self.codec.coder.alphabet.symbol_number
        here = (self.session_number, self.epoch)
        return [Symbol(*here, slot, number(symbol)) for slot, symbol in enumerate(word, first)]

    def conclude(self, tick: int, *, withheld: bool = False) -> None:
        """End the flight before `tick`; last words that were missed, not `withheld`, are erasures."""
        withheld = withheld or self.phase is not Phase.FLYING
        if not withheld:
            self._tick = max(self._tick, tick - 1)
        self.following.conclude(-(-tick // self.terms.ticks_per_sample), withheld=withheld)

    def rejoin(self, why: Why, details: Event = ASKED) -> list[Frame]:
        """Stop sending symbols and ask for a new epoch; return the frames that do."""
        if self.phase is not Phase.FLYING:
            return []
        self.phase = Phase.REJOINING
        self.following.pause()
        self.rejoins_asked[why] += 1
        self._asking.begin(why, self._tick)
        self._emit(replace(details, epoch=self.epoch, cause=why))
        return self._ask()

    def _ask(self) -> list[Frame]:
        if not self._asking.due(self._tick):
            return []
        report = self.desync if self._asking.why is Why.DESYNC else None
        return [self.hello()] if report is None else [report, self.hello()]

    def command(self, tick: int) -> Vector | None:
        """Return the command of this tick, None when it has not come; earlier ones are forgotten."""
        return self.following.command(tick)

    # What arrives

    def on_frame(self, frame: Frame) -> list[Frame]:
        """Take one frame; return the frames to send."""
        frame = within_text_bounds(frame)
        match frame:
            case Commands() | DownSymbol() if self._is_present(frame.session, frame.epoch):
                return self._follow(frame)
            case ShortCommands() if commands := self._unpacked(frame):
                return self._follow(commands)
            case Welcome() if self._asking.is_answered_by(frame):
                return self._on_welcome(frame)
            case Welcome() if self._is_current(frame.session) and self._is_left_behind(frame):
                detail = f"the receiver has begun epoch {frame.epoch}, unasked"
                return self.rejoin(Why.UNKNOWN, replace(ASKED, detail=detail))
            case Unknown() if self._is_present(frame.session, frame.epoch):
                return self._on_unknown()
            case Claim() if self._is_present(frame.session, frame.epoch):
                return self._on_claim(frame)
            case Desync() if not self._report_answered and is_answer(frame, self.desync):
                self._report_answered = True
                write_failure(
                    self._recorder, self.terms.sample_ns, self.following.history, frame, frame.state
                )
            case Refuse() if frame.incarnation == self.incarnation:
                return self._on_refuse(frame)
            case Bye() if self._has_session and frame.session == self.session_number:
                self._end(End(frame.ending, frame.text, by_peer=True))
            case ForeignVersion() if self.phase is Phase.GREETING:
                text = foreign_version_text("receiver", frame.version)
                self.refusal = End(Ending.WIRE_VERSION, text)
            case _:
                self.counts["stale_frames"] += 1
        return []

    def bye(self, end: End) -> list[Frame]:
        had_session = self._has_session
        self._end(end)
        return [Bye(self.session_number, end.ending, end.text)] if had_session else []

    def _on_unknown(self) -> list[Frame]:
        """Accept it from a receiver that has stopped commanding; refuse it from a second one."""
        if self._takeover.is_lost(self._tick, self.heard_tick):
            return self.rejoin(Why.UNKNOWN)
        if not self._takeover.is_second():
            return []
        self.counts["claims_refused"] += 1
        self._emit(Event(EventKind.REFUSED, cause=Ending.SECOND_RECEIVER))
        return [Bye(0, Ending.SECOND_RECEIVER)]

    def _on_claim(self, claim: Claim) -> list[Frame]:
        self._takeover.name_successor(claim.by, self._tick)
        return self.rejoin(Why.TAKEN_OVER, replace(ASKED, session=claim.by))

    def _on_welcome(self, welcome: Welcome) -> list[Frame]:
        newer = welcome.session == self.session_number and welcome.epoch > self.epoch
        successor = self._takeover.successor(self._tick)
        foreign = successor is not None and welcome.session != successor
        if foreign or self.phase is Phase.ENDED or (self.phase is Phase.FLYING and not newer):
            self.counts["stale_frames"] += 1
            return []
        again = self.phase is not Phase.GREETING
        if self._bounds.drops(self._bounds.of_welcome(welcome, self._sample if again else None)):
            return []
        farewell: list[Frame] = []
        if successor is not None and welcome.session != self.session_number:
            self.counts["take_overs"] += 1
            farewell = [Bye(self.session_number, Ending.TAKEN_OVER)]
        self._takeover.settle()
        self.session_number = welcome.session
        self.epoch = welcome.epoch
        self.heard_tick = self._tick
        self.epoch_tick = welcome.first_sample * self.terms.ticks_per_sample
        held = self.owing.begin(self.epoch_tick, self._tick, self._asking.why)
        self.following.restart(welcome, held)
        self.phase = Phase.FLYING
        self.counts["rejoins"] += again
        kind = EventKind.REJOIN if again else EventKind.STARTED
        self._emit(Event(kind, welcome.first_sample, session=welcome.session, epoch=welcome.epoch))
        return farewell

    def _on_refuse(self, refuse: Refuse) -> list[Frame]:
        if self.phase not in (Phase.GREETING, Phase.REJOINING):
            return []
        refused = Event(EventKind.REFUSED, cause=refuse.ending, by_peer=True)
        successor = self._takeover.successor(self._tick)
        if successor is not None:
            # The present receiver has been asked too, and goes on instead.
            self._takeover.settle()
            self._emit(replace(refused, session=successor, detail=refuse.text))
            return []
        if self.phase is Phase.REJOINING and not self._asking.is_refused():
            return []
        lines = [refuse.text] if refuse.text else []
        if refuse.config and refuse.config != self.identity.config:
            lines += differing_fields(self.identity.config, refuse.config)
        refusal = End(refuse.ending, shown("\n  ".join(lines)), by_peer=True)
        self.refusal = refusal
        self._emit(replace(refused, detail=refusal.text))
        if self.phase is Phase.REJOINING:
            self._end(refusal)
        return [Bye(0, refusal.ending, refusal.text)]

    def _unpacked(self, frame: ShortCommands) -> Commands | None:
        if self.compact is None or self.phase is not Phase.FLYING:
            return None
        return self.compact.unpacked(frame, self.session_number, self.epoch, self._sample)

    def _follow(self, frame: Frame) -> list[Frame]:
        lost = self.following.take(frame, self._tick)
        return [] if lost is None else self._lose(lost)

    def _on_heard(self) -> None:
        self.heard_tick = self._tick
        self._takeover.on_command()

    def _lose(self, lost: Lost) -> list[Frame]:
        if lost.differing is not None:
            return self._on_desync(lost.differing)
        if lost.why is Why.REST and self._stop_on_desync:
            return self.bye(End(Ending.DESYNC))
        return self.rejoin(lost.why, lost.details)

    def _on_desync(self, done: Confirmed) -> list[Frame]:
        self.counts["desyncs"] += 1
        self._report_answered = False
        state = self.codec.pack(done.flown.state)
        digests = (done.digest, done.peer_digest)
        self.desync = Desync(self.session_number, self.epoch, done.sample, *digests, state)
        self._emit(difference_event(self.desync))
        write_failure(self._recorder, self.terms.sample_ns, self.following.history, self.desync, b"")
        if self._stop_on_desync:
            return [self.desync, *self.bye(End(Ending.DESYNC))]
        return self.rejoin(Why.DESYNC, replace(ASKED, sample=done.sample))

    # Reports

    @property
    def _sample(self) -> int:
        """Return the sample at this end's clock."""
        return max(0, self._tick) // self.terms.ticks_per_sample

    def _is_left_behind(self, welcome: Welcome) -> bool:
        """Return whether another transmitter was answered in our name, and commands are missing."""
        later = welcome.incarnation == self.incarnation and welcome.epoch > self.epoch
        return later and self._takeover.is_lost(self._tick, self.heard_tick)

    def _is_current(self, session: int) -> bool:
        return self.phase is Phase.FLYING and session == self.session_number

    def _is_present(self, session: int, epoch: int) -> bool:
        return self._is_current(session) and epoch == self.epoch

    @property
    def confirmed_state(self) -> CodecState:
        """Return the last codec state that is certainly the receiver's."""
        return self.following.confirmed_state

    @property
    def next_sample(self) -> int:
        """Return the sample whose word is sent next."""
        return self.following.next_sample

    @property
    def lag_samples(self) -> int:
        """Return how many samples were sent of which nothing has been heard."""
        return self.following.lag_samples

    @property
    def reliable_state(self) -> Vector | None:
        """Return the model state to check encoders against; None: none can be relied on."""
        return self.following.reliable_state(self._tick) if self.phase is Phase.FLYING else None

    @property
    def _has_session(self) -> bool:
        return self.phase in (Phase.FLYING, Phase.REJOINING)

    def _end(self, end: End) -> None:
        if self.phase is not Phase.ENDED:
            self.phase = Phase.ENDED
            self.end = end
            self._emit(ended_event(end))

    def _emit(self, event: Event) -> None:
        now_ns = self._tick * self.terms.tick_ns
        at = self.confirmed_state.sample if event.sample is None else event.sample
        event = replace(event, time_ns=now_ns, sample=at)
        self.events.append(event)
        write_event(self._recorder, event)
