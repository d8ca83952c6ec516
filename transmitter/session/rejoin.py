"""The transmitter's requests for a session: at the start, and after each loss of lockstep.

A request has a number and is repeated every sample period, or every 10 ms if that is longer, until an
answer with this number comes: both the request and its answer may be lost, late or doubled. Nothing of
the codec's state travels up the link; the answer brings the state to start from.
"""

from __future__ import annotations

from channel.codec.codec import Codec, CodecState, Vector
from channel.protocol.frames import Hello, Welcome, Why
from channel.protocol.identity import Identity
from channel.protocol.limits import from_steps
from channel.protocol.terms import Terms

ASK_AGAIN_NS = 10_000_000
"""Shortest time between two requests: a sample period may be shorter than the way to the receiver."""


REFUSALS_ACCEPTED = 3
"""Refusals of one request that end a flight. A receiver that means it refuses every repetition; one
forged request in this flight's name gets one refusal."""


class Asking:
    """The request that is open, and when it is to be repeated."""

    def __init__(self, identity: Identity, incarnation: int, terms: Terms) -> None:
        self._identity = identity
        self._incarnation = incarnation
        self._terms = terms
        self._period_ticks = terms.ticks_per_sample * terms.samples_in(ASK_AGAIN_NS, 1)
        self._request = 0
        self._refusals = 0
        self._why = Why.START
        self._next_tick = 0

    @property
    def why(self) -> Why:
        """Return why the last request was made."""
        return self._why

    def begin(self, why: Why, tick: int) -> None:
        """Open a new request; it is due at once."""
        self._request += 1
        self._refusals = 0
        self._why = why
        self._next_tick = tick

    def is_refused(self) -> bool:
        """Note a refusal of a flight that was admitted before; return whether it is to be accepted."""
        self._refusals += 1
        return self._refusals >= REFUSALS_ACCEPTED

    def due(self, tick: int) -> bool:
        """Return whether the request is to be sent at this tick, and count it as sent."""
        if tick < self._next_tick:
            return False
        self._next_tick = tick + self._period_ticks
        return True

    def hello(self, session: int, epoch: int, tick: int) -> Hello:
        """Return the request as asked at a tick; before tick 0 every sample can still be sent."""
        return Hello(
            self._incarnation,
            self._identity.version,
            self._identity.config_digest,
            self._identity.numerics_probe,
            self._request,
            session,
            epoch,
            tick // self._terms.ticks_per_sample + 1,
            self._why,
        )

    def is_answered_by(self, welcome: Welcome) -> bool:
        return (welcome.incarnation, welcome.request) == (self._incarnation, self._request)


def start_of(welcome: Welcome, codec: Codec, terms: Terms) -> tuple[CodecState, Vector]:
    """Return the common state of a Welcome within bounds, and the command to hold."""
    hold = terms.initial_command
    if welcome.hold_steps:
        hold = from_steps(welcome.hold_steps, terms.signals)
    if not welcome.state:
        return codec.initial()._replace(sample=welcome.first_sample), hold
    return codec.unpack(welcome.state), hold
