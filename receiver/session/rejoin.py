"""The answers to requests for a session, and the state from which the ends start again.

* An unanswered request is repeated by the transmitter, so equal requests get equal answers for as
  long as nothing was flown on them, unless the answer has grown too old to begin with.
* A second transmitter is refused while the first one sends. When the first is silent, the second is
  treated as the same rig, restarted.
* A request that contradicts what is known, older than one that was answered or for a sample that the
  clock cannot have reached, is accepted when it persists: one forged or delayed request does nothing.
* An answer on which no symbol has come is no more than an offer: the next request is answered from
  where the flight stood before it (`receiver.session.commander.Standing`).
* The first sample is `max(own next sample, first sample that the transmitter can still send + m)`,
  `m` being the command lead in whole samples. The request names a sample whose slot lies ahead of it,
  and no symbol leaves while it is open, so no slot is used twice; symbols of the old epoch that are
  still on the line are dropped by their epoch. The lead is as long as the round trip, so the answer
  is there before the start, and the command to hold lasts until the first one decided. A start that
  has passed all the same costs erasures, never lockstep.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from enum import Enum, auto
from itertools import chain, repeat

from channel.codec.codec import ERASED, Codec, CodecState, Vector, is_coder_state
from channel.errors import CodecDiverged
from channel.protocol.bounds import shown
from channel.protocol.frames import Claim, Desync, Frame, Hello, Symbol, Unknown, Welcome
from channel.protocol.identity import Identity
from channel.protocol.lockstep import HISTORY_SAMPLES, History
from channel.protocol.terms import Terms

ANSWER_AGE_SAMPLES_MAX = 4
ANSWER_AGE_NS = 50_000_000
"""A start that lies further back than both is not offered again: the motors would have no command for
so long. In samples alone, every request of a fast flight would begin a new epoch before the
answer to the one before can have arrived."""

PERSISTENT_REQUESTS = 3
"""Repetitions, each for a later sample, after which a request that contradicts what is known is
accepted, as long as the transmitter is not heard."""

AHEAD_SAMPLES_MAX = 8
"""This end counts samples by its own clock, so it is hardly ahead of the transmitter. If it is by more,
symbols that nobody sent have moved it on, and the start is the transmitter's."""

LEAD_SAMPLES_MAX = 32
"""How far ahead of its request an answer begins at most, beyond the command lead."""

KNOWN_MAX = 64
"""Transmitters remembered as admitted."""

SILENT_SLOTS = 2
"""Slots missed in a row after which a transmitter may be taken for gone, if another one asks."""

ALIVE_SYMBOLS = 3
"""Symbols of the present transmitter, after another one's request, that prove it alive."""

KEEP_CODER_SAMPLES = 10
"""After a pause longer than this the coder starts from its initial range: the plant has moved on."""

VERSION_SHOWN = 40
"""Characters of a peer's version text that are quoted back."""


class Verdict(Enum):
    """The decision about a request."""

    IGNORE = auto()
    REPEAT = auto()
    BUSY = auto()
    REFUSE = auto()
    BEGIN = auto()


class Greeter:
    """Decides on requests; remembers the transmitter and the answers."""

    def __init__(self, terms: Terms) -> None:
        self._answer_age_max = terms.samples_in(ANSWER_AGE_NS, ANSWER_AGE_SAMPLES_MAX)
        self._lead_agreed = _lead_samples(terms)
        self._may_double = terms.is_narrow
        self._lead = 0
        """of the last answer, in samples"""
        self._answered: Hello | None = None
        """the request that the last answer was for"""
        self.welcome: Welcome | None = None
        """last answer given"""
        self._unknown_incarnation: int | None = None
        self._symbols_since = 0
        self._known: deque[int] = deque(maxlen=KNOWN_MAX)
        """incarnations that were admitted"""
        self._doubted: Hello | None = None
        """last request that contradicted what is known"""
        self._persisted = 0

    def answer_with(self, welcome: Welcome) -> None:
        self.welcome = welcome

    def lead_samples(self, hello: Hello) -> int:
        """Return how far ahead of a request its answer is to begin.

        That is the command lead, which is as long as a round trip. The narrow downlink may have none:
        there a request that is repeated although it was answered is answered further and further ahead.
        """
        before, self._answered = self._answered, hello
        lead = self._lead_agreed
        if self._may_double:
            asked = (hello.incarnation, hello.request)
            if before is not None and (before.incarnation, before.request) == asked:
                lead = max(lead, min(2 * self._lead + ANSWER_AGE_SAMPLES_MAX, LEAD_SAMPLES_MAX))
        self._lead = lead
        return lead

    def judge(
        self, hello: Hello, identity: Identity, advanced: bool, silent_slots: int, in_reach: bool
    ) -> Verdict:
        """Return the verdict on a request to an end of this identity.

        `advanced`: a symbol was received on the last answer. `silent_slots`: slots missed in a row.
        `in_reach`: the clock can have reached the request's sample.
        """
        last = self.welcome
        if difference(hello, identity) is not None and hello.incarnation in self._known:
            # A process does not change its identity: somebody else asks in its name.
            return Verdict.IGNORE
        if last is None:
            return self._admit(hello, identity)
        if hello.incarnation != last.incarnation:
            return self._judge_unknown_peer(hello, identity, advanced, silent_slots)
        if not in_reach or hello.request < last.request or (hello.request == last.request and advanced):
            heard = advanced and silent_slots < SILENT_SLOTS
            return Verdict.BEGIN if self._persists(hello) and not heard else Verdict.IGNORE
        if hello.request == last.request and self._still_stands(last.first_sample, hello):
            return Verdict.REPEAT
        return Verdict.BEGIN

    def _still_stands(self, first: int, hello: Hello) -> bool:
        """Return whether a transmitter that asks like this can still begin at this sample."""
        ahead = first - hello.sample
        ahead_max = AHEAD_SAMPLES_MAX + max(self._lead_agreed, self._lead)
        return -self._answer_age_max <= ahead and (not hello.sample or ahead <= ahead_max)

    def _admit(self, hello: Hello, identity: Identity) -> Verdict:
        if difference(hello, identity) is not None:
            return Verdict.REFUSE
        if hello.incarnation not in self._known:
            self._known.append(hello.incarnation)
        return Verdict.BEGIN

    def _persists(self, hello: Hello) -> bool:
        """Note a request that contradicts what is known; return whether it has been repeated enough."""
        before, self._doubted = self._doubted, hello
        same = before is not None and replace(before, sample=hello.sample) == hello
        if not same or before is None:
            self._persisted = 0
        elif hello.sample and hello.sample <= before.sample:
            # A copy. One that has not flown yet asks for sample 0 every time.
            self._doubted = before
            return False
        self._persisted += 1
        return self._persisted >= PERSISTENT_REQUESTS

    def on_symbol(self) -> None:
        self._symbols_since += 1

    def _judge_unknown_peer(
        self, hello: Hello, identity: Identity, advanced: bool, silent_slots: int
    ) -> Verdict:
        if hello.incarnation != self._unknown_incarnation or silent_slots >= SILENT_SLOTS:
            # Old symbols on the line do not prove for long that the present one is alive.
            self._unknown_incarnation, self._symbols_since = hello.incarnation, 0
        if self._symbols_since >= ALIVE_SYMBOLS:
            return Verdict.BUSY
        if advanced and silent_slots < SILENT_SLOTS:
            return Verdict.IGNORE
        return self._admit(hello, identity)


def difference(hello: Hello, ours: Identity) -> str | None:
    """Return the difference for which a transmitter is refused; None: no difference."""
    if hello.config_digest != ours.config_digest:
        return (
            "the shared configuration differs: transmitter "
            f"{hello.config_digest.hex()[:12]}, receiver {ours.config_digest.hex()[:12]}"
        )
    if hello.version != ours.version:
        version = shown(hello.version, VERSION_SHOWN)
        return f"versions differ: transmitter {version}, receiver {ours.version}"
    if hello.numerics_probe != ours.numerics_probe:
        return (
            "the numerics probe differs: transmitter "
            f"{hello.numerics_probe.hex()}, receiver {ours.numerics_probe.hex()}; the "
            "two machines do not compute alike, so their codecs would drift apart"
        )
    return None


def first_sample(hello: Hello, own: int, lead_samples: int, begun: bool) -> int:
    """Return where a session or an epoch begins; `own` is this end's next sample.

    At the very start of both there is no line to wait for: tick 0 has not come yet. A transmitter that
    has not flown begins where this end stands; one that has knows better than an end far ahead of it.
    """
    if not begun and hello.sample == 0:
        return own
    first = hello.sample + lead_samples
    return first if hello.sample and own - first > AHEAD_SAMPLES_MAX else max(own, first)


def _lead_samples(terms: Terms) -> int:
    return -(-terms.lead_ticks // terms.ticks_per_sample)


def desync_answer(theirs: Desync, history: History, codec: Codec) -> Desync:
    """Return the answer to the report of a lockstep failure: the same, with this end's state."""
    own = history.state_after(theirs.sample)
    return replace(theirs, state=b"" if own is None else codec.pack(own))


def carried_to(
    codec: Codec,
    state: CodecState,
    sample: int,
    known: Sequence[Vector],
    hold: Vector,
    silent_samples: int,
    carried_samples_max: int = HISTORY_SAMPLES,
) -> CodecState:
    """Return a state carried on without corrections to a later sample.

    `known` are the commands of its first ticks, `hold` that of all others; `silent_samples` had no
    symbol before. At most `carried_samples_max` samples are computed; beyond, as for a state that
    diverges, only the index moves on, and the initial state is what is left.
    """
    paused = sample - state.sample
    if not 0 <= paused <= carried_samples_max:
        return codec.initial()._replace(sample=sample)
    commands = chain(known, repeat(hold))
    try:
        for _ in range(paused):
            ticks = [next(commands) for _ in range(codec.ticks_per_sample)]
            state = codec.step(state, ERASED, ticks)
    except (CodecDiverged, ArithmeticError, ValueError):
        return codec.initial()._replace(sample=sample)
    if paused + silent_samples > KEEP_CODER_SAMPLES or not is_coder_state(codec.coder, state.coder):
        return state._replace(coder=codec.coder.initial())
    return state


class Takeover:
    """Answers the symbols of an unknown session."""

    def __init__(self, session_number: int, take_over: bool) -> None:
        self._session_number = session_number
        self._take_over = take_over
        self.asked = False
        """whether a transmitter was asked for its flight, so that its refusal is meant for us"""

    def on_symbol(self, symbol: Symbol) -> list[Frame]:
        """Return the answer to the transmitter of a symbol."""
        self.asked = True
        if self._take_over:
            return [Claim(symbol.session, symbol.epoch, self._session_number)]
        return [Unknown(symbol.session, symbol.epoch)]
