"""What the transmitter's session does with frames that hold what they must not."""

from __future__ import annotations

import json
import math
import struct

import pytest

from channel.protocol.endings import Ending
from channel.protocol.events import ASKED
from channel.protocol.frames import Echo, Hello, Refuse, Welcome, Why
from channel.protocol.wire import encode
from tests.transmitter.session.test_session import INCARNATION, SESSION, Far, flying, frame, transmitter
from transmitter.session.rejoin import REFUSALS_ACCEPTED
from transmitter.session.session import Phase, TransmitterSession


def rejoining() -> TransmitterSession:
    session = flying()
    session.on_measurement(1000, (0.0,))
    assert session.phase is Phase.REJOINING
    return session


@pytest.mark.parametrize("value", [1e36, -1e300, 5e4, math.nan])
def test_when_an_answer_brings_an_invalid_state_then_it_is_dropped_and_the_next_taken(
    value: float,
) -> None:
    session = rejoining()
    state = struct.pack("<q6d", 101, value, *[0.0] * 3, 0.5, 0.0)
    assert session.on_frame(Welcome(SESSION, 4, 101, INCARNATION, 1, (), state)) == []
    assert session.counts["out_of_bounds"] == 1
    assert session.phase is Phase.REJOINING
    session.on_frame(Welcome(SESSION, 4, 101, INCARNATION, 1))
    assert session.phase is Phase.FLYING


def test_when_an_answer_begins_far_ahead_then_it_is_dropped() -> None:
    session = rejoining()
    session.on_frame(Welcome(SESSION, 4, 2**31 - 1, INCARNATION, 1))
    assert session.counts["out_of_bounds"] == 1
    assert session.phase is Phase.REJOINING


@pytest.mark.parametrize("rate", [4.9e4, -4.9e4])
def test_when_a_state_within_bounds_cannot_be_flown_then_another_is_asked_for(rate: float) -> None:
    session = rejoining()
    state = struct.pack("<q6d", 101, rate, rate, 0.0, 0.0, 0.5, 0.0)
    session.on_frame(Welcome(SESSION, 4, 101, INCARNATION, 1, (), state))
    assert session.phase is Phase.FLYING
    asked = [frame for tick in range(1010, 1100) for frame in session.on_measurement(tick, (0.0,))]
    assert session.counts["diverged"] == 1
    assert session.phase is Phase.REJOINING
    assert any(isinstance(frame, Hello) for frame in asked)
    assert session.reliable_state is None


def test_when_the_digest_does_not_agree_then_the_commands_move_no_motor() -> None:
    session, far = flying(), Far()
    session.on_measurement(0, (1.0,))
    echo = far.echo()
    session.on_frame(frame(Echo(0, 1, echo.digest ^ 1, (5000, -5000) * 10)))
    assert session.counts["desyncs"] == 1
    assert [session.command(tick) for tick in range(20)] == [None] * 20


def test_when_a_flight_is_refused_then_it_ends_at_the_third_refusal_of_a_request() -> None:
    session = rejoining()
    for _ in range(REFUSALS_ACCEPTED - 1):
        assert session.on_frame(Refuse(INCARNATION, Ending.MISMATCH, "no", "")) == []
    assert session.phase is Phase.REJOINING
    session.on_frame(Welcome(SESSION, 4, 101, INCARNATION, 1))
    session.rejoin(Why.GUARD, ASKED)
    for _ in range(REFUSALS_ACCEPTED - 1):
        session.on_frame(Refuse(INCARNATION, Ending.MISMATCH, "no", ""))
    assert session.phase is Phase.REJOINING
    session.on_frame(Refuse(INCARNATION, Ending.MISMATCH, "no", ""))
    assert session.phase is Phase.ENDED


def test_when_a_refusal_is_longer_than_a_frame_then_the_answer_still_fits_one() -> None:
    session = transmitter()
    theirs = json.dumps({f"field {number}": number for number in range(600)})
    (answer,) = session.on_frame(Refuse(INCARNATION, Ending.MISMATCH, "differs", theirs))
    encode(answer)


def test_when_the_receiver_has_begun_an_epoch_for_somebody_else_then_another_is_asked_for() -> None:
    session = flying()
    session.on_measurement(10, (0.0,))
    elsewhere = Welcome(SESSION, 9, 2, INCARNATION, 77)
    assert session.on_frame(elsewhere) == [], "commands may still come"
    session.on_measurement(20, (0.0,))
    (request,) = session.on_frame(elsewhere)
    assert isinstance(request, Hello)
    assert request.why is Why.UNKNOWN
    assert session.phase is Phase.REJOINING
