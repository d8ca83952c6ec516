"""The receiver's half of the protocol: the handshake and the end of a flight."""

from __future__ import annotations

import json
from typing import Any

import pytest

from channel.protocol import wire
from channel.protocol.endings import End, Ending
from channel.protocol.events import EventKind
from channel.protocol.frames import (
    Bye,
    Desync,
    ForeignVersion,
    Hello,
    Refuse,
    Welcome,
)
from channel.protocol.identity import Identity
from receiver.session.session import Phase
from tests.receiver.session.sessions import (
    CODEC,
    IDENTITY,
    MS,
    PEER,
    SESSION,
    flying,
    hello,
    kinds,
    receiver,
    symbol,
    word_numbers,
)

# The handshake


def test_when_the_ends_are_alike_then_the_session_begins() -> None:
    session = receiver()
    assert session.on_frame(hello(), 0) == [Welcome(SESSION, 0, 0, PEER)]
    assert session.phase is Phase.FLYING
    assert kinds(session) == [EventKind.STARTED]


def test_when_the_greeting_is_repeated_before_the_first_symbol_then_it_is_answered_again() -> None:
    session = flying()
    assert session.on_frame(hello(), 0) == [Welcome(SESSION, 0, 0, PEER)]
    session.on_frame(symbol(0), 0)
    assert session.on_frame(hello(), 0) == []
    assert session.counts["refused_hellos"] == 1
    assert session.phase is Phase.FLYING


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"config": json.dumps({"rate_baud": 20.0})}, ["shared configuration differs"]),
        ({"version": "2.0"}, ["versions differ", "transmitter 2.0", "receiver 1.0"]),
        ({"numerics_probe": bytes(8)}, ["numerics probe differs", "00" * 8, "do not compute alike"]),
    ],
    ids=["configuration", "version", "probe"],
)
def test_when_the_ends_differ_then_it_is_refused_and_said_in_what(
    changes: dict[str, Any], words: list[str]
) -> None:
    session = receiver()
    (answer,) = session.on_frame(hello(**changes), 0)
    assert isinstance(answer, Refuse)
    assert answer.incarnation == PEER
    assert answer.config == IDENTITY.config
    for word in words:
        assert word in answer.text
    assert session.phase is Phase.WAITING
    assert session.refusal == End(Ending.MISMATCH, answer.text)
    assert session.counts["refused_hellos"] == 1
    assert kinds(session) == [EventKind.REFUSED]
    assert session.on_frame(symbol(0), 0) == []
    assert session.state == CODEC.initial()


def test_when_a_refused_transmitter_explains_itself_then_the_session_ends_with_both_views() -> None:
    session = receiver()
    session.on_frame(hello(version="2.0"), 0)
    session.on_frame(Bye(0, Ending.OVER, "rate_baud: here 20, there 10"), 0)
    assert session.phase is Phase.ENDED
    assert session.refusal is not None
    assert "versions differ" in session.refusal.text
    assert session.refusal.answer == "rate_baud: here 20, there 10"


def test_when_the_transmitter_speaks_another_wire_version_then_both_are_named() -> None:
    session = receiver()
    assert session.on_frame(ForeignVersion(9), 0) == []
    assert "wire version 9, this end 2" in str(session.refusal)
    assert session.phase is Phase.WAITING


def test_when_a_second_transmitter_greets_then_it_is_refused_once_the_first_is_heard_again() -> None:
    session = flying()
    session.on_frame(symbol(0), 0)
    assert session.on_frame(hello(PEER + 1), 10 * MS) == []
    for slot in (1, 2, 3):
        assert word_numbers(session.on_frame(symbol(slot), 100 * slot * MS)) == [1]
    (answer,) = session.on_frame(hello(PEER + 1), 310 * MS)
    assert answer == Refuse(PEER + 1, Ending.BUSY, "", "")
    assert session.phase is Phase.FLYING
    assert session.refusal is None
    assert session.epoch == 0
    assert word_numbers(session.on_frame(symbol(4), 400 * MS)) == [1]


def test_when_a_second_transmitter_leaves_then_the_flight_goes_on() -> None:
    session = flying()
    session.on_frame(hello(PEER + 1), 0)
    session.on_frame(Bye(0, Ending.OVER, "this receiver is flying with another"), 0)
    assert session.phase is Phase.FLYING


def test_when_a_frame_of_another_version_comes_in_flight_then_it_is_no_refusal() -> None:
    session = flying()
    session.on_frame(ForeignVersion(9), 0)
    assert session.refusal is None


def test_when_a_right_transmitter_follows_a_refused_one_then_the_refusal_is_forgotten() -> None:
    session = receiver()
    session.on_frame(hello(version="2.0"), 0)
    assert session.on_frame(hello(PEER + 1), 0) == [Welcome(SESSION, 0, 0, PEER + 1)]
    assert session.refusal is None


def test_when_a_foreign_version_text_is_long_then_the_refusal_can_still_be_sent() -> None:
    (answer,) = receiver().on_frame(hello(version="v" * 16_340), 0)
    wire.encode(answer)


def test_when_the_session_has_ended_then_a_greeting_is_refused_with_the_reason() -> None:
    session = flying()
    session.bye(End(Ending.OVER, "landed"))
    (answer,) = session.on_frame(hello(PEER + 1), 0)
    assert isinstance(answer, Refuse)
    assert (answer.ending, answer.text) == (Ending.ALREADY_ENDED, "landed")


# Ends


def test_when_the_transmitter_reports_a_desync_then_both_digests_and_its_state_are_reported() -> None:
    session = flying()
    session.on_frame(symbol(0), 0)
    assert session.on_frame(Desync(SESSION + 1, 0, 0, 1, 2, b""), 0) == []
    answer = Desync(SESSION, 0, 0, 0xABC, 0xDEF, CODEC.pack(session.state))
    for _ in range(2):
        assert session.on_frame(Desync(SESSION, 0, 0, 0xABC, 0xDEF, b""), 0) == [answer]
    assert session.phase is Phase.FLYING
    assert session.counts["desyncs"] == 1
    (event,) = [event for event in session.events if event.kind is EventKind.DESYNC]
    assert (event.transmitter_digest, event.receiver_digest) == (0xABC, 0xDEF)


def test_when_the_transmitter_says_bye_then_the_flight_ends_with_its_reason() -> None:
    session = flying()
    session.on_frame(Bye(SESSION + 1, Ending.OVER, "not me"), 0)
    assert session.phase is Phase.FLYING
    session.on_frame(Bye(SESSION, Ending.OVER, "landed"), 0)
    assert session.phase is Phase.ENDED
    assert session.end == End(Ending.OVER, "landed", by_peer=True)


def test_when_bytes_are_no_frame_then_it_is_counted_and_reported() -> None:
    session = flying()
    session.on_malformed("checksum")
    assert session.counts["malformed"] == 1
    assert kinds(session)[-1] is EventKind.MALFORMED


def test_when_an_identity_is_compared_then_the_configuration_comes_first() -> None:
    other = Identity("2.0", "{}", bytes(8))
    session = receiver()
    message = Hello(1, other.version, other.config_digest, other.numerics_probe)
    (answer,) = session.on_frame(message, 0)
    assert isinstance(answer, Refuse)
    assert "configuration" in answer.text
