"""A receiver that hears a flight which it does not have."""

from __future__ import annotations

from channel.protocol.endings import End, Ending
from channel.protocol.frames import Bye, Claim, Symbol, Unknown
from receiver.session.session import Phase
from tests.receiver.session.sessions import SESSION, receiver

FOREIGN = Symbol(99, 4, 1000, 1)
REFUSAL = Bye(0, Ending.SECOND_RECEIVER)


def test_when_it_is_refused_then_it_ends_and_says_what_the_transmitter_said() -> None:
    session = receiver()
    assert session.on_frame(FOREIGN, 0) == [Unknown(99, 4)]
    assert session.on_frame(REFUSAL, 0) == []
    assert session.phase is Phase.ENDED
    assert session.end == End(Ending.SECOND_RECEIVER, by_peer=True)


def test_when_it_has_not_asked_then_a_refusal_is_for_somebody_else() -> None:
    session = receiver()
    session.on_frame(REFUSAL, 0)
    assert session.phase is Phase.WAITING
    assert session.counts["stale_frames"] == 1


def test_when_it_is_to_take_over_then_it_claims_the_flight_for_its_own_session() -> None:
    session = receiver(take_over=True)
    assert session.on_frame(FOREIGN, 0) == [Claim(99, 4, SESSION)]
