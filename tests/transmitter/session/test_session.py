"""The transmitter's half of the protocol."""

from __future__ import annotations

import json
from typing import Any

import pytest

from channel.codec.codec import ERASED, WIRE_ERASED, Codec, CodecState, Vector, Word
from channel.codec.coders.zoom import ZoomCoder
from channel.protocol.endings import End, Ending
from channel.protocol.events import EventKind
from channel.protocol.frames import (
    Bye,
    Commands,
    Desync,
    Echo,
    ForeignVersion,
    Frame,
    Hello,
    Refuse,
    Symbol,
    Welcome,
    Why,
)
from channel.protocol.lockstep import HISTORY_SAMPLES
from tests.channel.codec.parts import identity_of, pitch_codec, terms
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes
from transmitter.session.session import Phase, TransmitterSession

CODEC = pitch_codec()
IDENTITY = identity_of(CODEC)
INCARNATION = 5
SESSION = 77
VOLTS: Vector = (1.0, -1.0)


def transmitter(*, stop_on_desync: bool = False, **changes: Any) -> TransmitterSession:
    return TransmitterSession(
        CODEC, terms(**changes), IDENTITY, INCARNATION, stop_on_desync=stop_on_desync
    )


def flying(**changes: Any) -> TransmitterSession:
    session = transmitter(**changes)
    assert session.on_frame(Welcome(SESSION, 3, 0, INCARNATION)) == []
    assert session.phase is Phase.FLYING
    return session


class Far:
    """A receiver that consumes given words, to make echoes with right digests."""

    def __init__(self) -> None:
        self.state: CodecState = CODEC.initial()

    def echo(self, word: Word = (1,), volts: Vector = VOLTS) -> Echo:
        sample = self.state.sample
        self.state = CODEC.step(self.state, word, [volts] * 10)
        number = CODEC.coder.alphabet.word_number(word)
        steps = tuple(round(1000 * value) for value in volts) * 10
        return Echo(sample, number, CODEC.digest(self.state), steps)


def frame(*echoes: Echo, session: int = SESSION, epoch: int = 3) -> Commands:
    return Commands(session, epoch, echoes)


def kinds(session: TransmitterSession) -> list[EventKind]:
    return [event.kind for event in session.events]


# The handshake


def test_when_it_greets_then_it_shows_who_it_is() -> None:
    hello = transmitter().hello()
    assert hello.incarnation == INCARNATION
    assert hello.version == IDENTITY.version
    assert hello.config_digest == IDENTITY.config_digest
    assert hello.numerics_probe == IDENTITY.numerics_probe


def test_when_it_is_welcome_then_it_flies_in_that_session_and_epoch() -> None:
    session = flying()
    assert (session.session_number, session.epoch) == (SESSION, 3)
    assert kinds(session) == [EventKind.STARTED]
    (symbol,) = session.on_measurement(0, (0.0,))
    assert symbol == Symbol(SESSION, 3, 0, 1)


def test_when_somebody_else_is_welcome_then_it_goes_on_waiting() -> None:
    session = transmitter()
    session.on_frame(Welcome(SESSION, 0, 0, INCARNATION + 1))
    session.on_frame(Refuse(INCARNATION + 1, Ending.MISMATCH, "no", ""))
    assert session.phase is Phase.GREETING
    assert session.refusal is None
    assert session.counts["stale_frames"] == 2


def test_when_a_second_welcome_comes_then_the_flight_is_not_begun_again() -> None:
    session = flying()
    session.on_frame(Welcome(SESSION + 1, 9, 0, INCARNATION))
    assert (session.session_number, session.epoch) == (SESSION, 3)


def test_when_it_has_not_been_welcomed_then_no_symbol_leaves() -> None:
    session = transmitter()
    assert session.on_measurement(0, (1.0,)) == []
    assert session.next_sample == 0


def test_when_it_is_refused_for_its_configuration_then_the_fields_are_named_to_both() -> None:
    session = transmitter()
    theirs = json.dumps({"rate_baud": 20.0})
    (answer,) = session.on_frame(Refuse(INCARNATION, Ending.MISMATCH, "differs", theirs))
    assert isinstance(answer, Bye)
    assert answer.session == 0
    assert "rate_baud: here 10.0, there 20.0" in answer.text
    assert session.refusal == End(Ending.MISMATCH, answer.text, by_peer=True)
    assert session.phase is Phase.GREETING


def test_when_the_receiver_speaks_another_wire_version_then_both_are_named() -> None:
    session = transmitter()
    session.on_frame(ForeignVersion(9))
    assert "wire version 9, this end 2" in str(session.refusal)


def test_when_a_frame_of_another_version_comes_in_flight_then_it_is_no_refusal() -> None:
    session = flying()
    session.on_frame(ForeignVersion(9))
    assert session.refusal is None


# Symbols


def test_when_angles_are_measured_then_a_symbol_leaves_at_the_first_tick_of_each_sample() -> None:
    session, far = flying(), Far()
    for tick in range(100):
        symbols = session.on_measurement(tick, (0.5 if tick < 50 else -0.5,))
        assert len(symbols) == (tick % 10 == 0)
        if symbols:
            assert symbols[0].slot == tick // 10
            word = ((-1, 1)[symbols[0].number],)
            assert word == CODEC.encode(far.state, (0.5 if tick < 50 else -0.5,))
            assert session.on_frame(frame(far.echo(word))) == []
    assert session.counts["digest_checks"] == 10
    assert session.confirmed_state == far.state


def test_when_ticks_were_missed_then_their_samples_send_nothing_and_nothing_is_made_up_for() -> None:
    session = flying()
    assert len(session.on_measurement(0, (1.0,))) == 1
    assert session.on_measurement(35, (1.0,)) == []
    assert session.counts["words_missed"] == 2
    assert session.on_measurement(39, (1.0,)) == []
    (symbol,) = session.on_measurement(40, (1.0,))
    assert symbol.slot == 4
    assert session.counts["words_missed"] == 3
    assert session.lag_samples == 5


def two_axes() -> TransmitterSession:
    """Return a session whose words have two symbols."""
    codec = Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), 10)
    session = TransmitterSession(codec, terms(symbols_per_word=2), IDENTITY, INCARNATION)
    session.on_frame(Welcome(SESSION, 0, 0, INCARNATION))
    return session


def test_when_the_last_samples_first_tick_was_missed_then_its_erasure_is_confirmed_as_well() -> None:
    session, far = flying(), Far()
    session.on_measurement(0, (0.0,))
    session.on_frame(frame(far.echo()))
    assert session.on_measurement(11, (0.0,)) == [], "tick 10 was missed"
    assert session.lag_samples == 0
    session.conclude(20)
    assert (session.counts["words_missed"], session.lag_samples) == (1, 1)
    session.on_frame(frame(far.echo(ERASED)))
    assert (session.counts["digest_checks"], session.counts["erasures"]) == (2, 1)
    session.on_frame(frame(far.echo(ERASED)))
    assert session.counts["digest_checks"] == 2, "that one was not flown"
    assert session.on_frame(frame(far.echo(ERASED))) == [], "nor was this one, so none is lost"
    assert session.counts["out_of_bounds"] == 0
    assert session.counts["desyncs"] == 0


def test_when_a_word_has_two_symbols_then_both_are_given_with_their_slots() -> None:
    session = two_axes()
    left = {}
    for tick in range(20):
        # Only the measurement of the first tick counts.
        angles = (0.5, -0.5) if tick == 0 else (-0.5, 0.5) if tick == 10 else (9.0, 9.0)
        symbols = session.on_measurement(tick, angles)
        if symbols:
            left[tick] = [(symbol.slot, symbol.number) for symbol in symbols]
    assert left == {0: [(0, 1), (1, 0)], 10: [(2, 0), (3, 1)]}


def test_when_the_first_tick_of_a_word_was_missed_then_none_of_its_symbols_leaves() -> None:
    session = two_axes()
    assert len(session.on_measurement(0, (0.5, 0.5))) == 2
    assert session.on_measurement(15, (0.5, 0.5)) == []
    assert [symbol.slot for symbol in session.on_measurement(20, (0.5, 0.5))] == [4, 5]
    assert session.counts["words_missed"] == 1


def test_when_samples_are_short_then_echoes_may_lag_by_a_time_and_requests_are_spaced() -> None:
    session = flying(lead_ticks=13, tick_ns=50_000, rate_baud=2000.0)
    sent = [symbol for tick in range(5000) for symbol in session.on_measurement(tick, (1.0,))]
    assert len(sent) == 500
    asked = [session.on_measurement(tick, (1.0,)) for tick in range(5000, 5450)]
    assert session.phase is Phase.REJOINING
    assert sum(isinstance(one, Hello) for frames in asked for one in frames) == 3


def test_when_echoes_stay_away_then_slots_do_not_wait_until_a_rejoin_is_asked_for() -> None:
    session = flying(lead_ticks=13)
    sent = [symbol for tick in range(640) for symbol in session.on_measurement(tick, (1.0,))]
    assert [symbol.slot for symbol in sent] == list(range(64))
    for tick in range(640, 660):
        sent += session.on_measurement(tick, (1.0,))
    assert session.phase is Phase.REJOINING
    asked = session.events[-1]
    assert (asked.kind, asked.cause, asked.number) == (EventKind.REJOIN_ASKED, Why.LAG, HISTORY_SAMPLES)
    symbols = [one for one in sent if isinstance(one, Symbol)]
    assert len(symbols) <= HISTORY_SAMPLES + 1
    requests = [one for one in sent if isinstance(one, Hello)]
    assert requests
    assert {request.why for request in requests} == {Why.LAG}


def test_when_a_slot_is_known_to_be_erased_before_its_tick_then_no_stale_symbol_leaves() -> None:
    session, far = flying(), Far()
    session.on_measurement(0, (1.0,))
    session.on_frame(frame(far.echo((1,))))
    session.on_frame(frame(far.echo(ERASED)))
    assert session.on_measurement(10, (-1.0,)) == []


# Echoes


def test_when_an_echo_comes_then_its_commands_are_due_after_the_lead() -> None:
    session, far = flying(lead_ticks=13, initial_command=(0.5, 0.25)), Far()
    session.on_measurement(0, (1.0,))
    far.state = CODEC.initial()
    after = CODEC.step(far.state, (1,), [(0.5, 0.25)] * 10)
    echo = Echo(0, 1, CODEC.digest(after), (1000, -1000, *(2000, -2000) * 9))
    assert session.on_frame(frame(echo)) == []
    commands = [session.command(tick) for tick in range(24)]
    assert commands == [(0.5, 0.25)] * 13 + [(1.0, -1.0)] + [(2.0, -2.0)] * 9 + [None]


def test_when_a_tick_has_no_command_then_later_ones_keep_their_place() -> None:
    session, far = flying(), Far()
    assert session.command(0) is None
    session.on_measurement(0, (1.0,))
    session.on_frame(frame(far.echo()))
    assert session.command(7) == VOLTS
    assert session.command(6) is None
    assert session.command(9) == VOLTS
    assert session.command(10) is None


def test_when_frames_repeat_samples_then_each_is_taken_once() -> None:
    session, far = flying(), Far()
    echoes: list[Echo] = []
    for sample in range(12):
        session.on_measurement(10 * sample, (1.0,))
        echoes.append(far.echo())
        if sample % 3 == 2:  # only every third frame arrives, with two repeated samples
            session.on_frame(frame(*echoes[-3:]))
            session.on_frame(frame(*echoes[-3:]))
    assert session.counts["digest_checks"] == 12
    assert session.confirmed_state == far.state


def test_when_a_sample_was_not_repeated_often_enough_then_a_rejoin_is_asked_for() -> None:
    session, far = flying(), Far()
    echoes = []
    for sample in range(4):
        session.on_measurement(10 * sample, (1.0,))
        echoes.append(far.echo())
    (request,) = session.on_frame(frame(*echoes[1:]))
    assert isinstance(request, Hello)
    assert (request.why, request.sample, request.session, request.epoch) == (Why.GAP, 4, SESSION, 3)
    assert session.phase is Phase.REJOINING
    asked = session.events[-1]
    assert (asked.kind, asked.cause, asked.sample) == (EventKind.REJOIN_ASKED, Why.GAP, 0)


def test_when_a_symbol_was_lost_then_the_copy_follows_what_was_received() -> None:
    session, far = flying(), Far()
    session.on_measurement(0, (1.0,))
    session.on_frame(frame(far.echo(ERASED)))
    session.on_measurement(10, (1.0,))
    session.on_frame(frame(far.echo((-1,))))  # flipped on its way
    assert session.counts["erasures"] == 1
    assert session.counts["desyncs"] == 0
    assert session.confirmed_state == far.state


@pytest.mark.parametrize("stale", [{"session": SESSION + 1}, {"epoch": 2}])
def test_when_commands_are_of_another_session_or_epoch_then_they_move_nothing(
    stale: dict[str, int],
) -> None:
    session, far = flying(), Far()
    session.on_measurement(0, (1.0,))
    assert session.on_frame(frame(far.echo(), **stale)) == []
    assert session.command(0) is None
    assert session.counts["stale_frames"] == 1
    assert session.counts["digest_checks"] == 0


@pytest.mark.parametrize(
    "echo",
    [
        Echo(0, 2, 0, (0,) * 20),
        Echo(0, 1, 0, (0,) * 18),
        Echo(0, 1, 0, ()),
        Echo(0, 0xFFFE, 0, (0,) * 20),
    ],
    ids=["unknown word", "too few commands", "no commands", "nearly erased"],
)
def test_when_an_echo_makes_no_sense_then_it_is_dropped_and_counted(echo: Echo) -> None:
    session = flying()
    session.on_measurement(0, (1.0,))
    assert session.on_frame(frame(echo)) == []
    assert session.counts["out_of_bounds"] == 1
    assert session.confirmed_state == CODEC.initial()
    assert session.phase is Phase.FLYING


def test_when_a_word_is_echoed_that_was_never_sent_then_it_is_dropped() -> None:
    session, far = flying(), Far()
    assert session.on_frame(frame(far.echo((1,)))) == []
    assert session.counts["out_of_bounds"] == 1
    assert session.confirmed_state == CODEC.initial()


def test_when_the_digests_differ_and_it_is_set_to_stop_then_it_reports_and_ends() -> None:
    session, far = flying(stop_on_desync=True), Far()
    session.on_measurement(0, (1.0,))
    echo = far.echo()
    wrong = Echo(echo.sample, echo.word_number, echo.digest ^ 1, echo.steps)
    report, goodbye = session.on_frame(frame(wrong))
    assert isinstance(goodbye, Bye)
    assert report == Desync(SESSION, 3, 0, echo.digest, echo.digest ^ 1, CODEC.pack(far.state))
    assert session.desync == report
    assert session.phase is Phase.ENDED
    assert session.counts["desyncs"] == 1
    (event,) = [event for event in session.events if event.kind is EventKind.DESYNC]
    assert (event.transmitter_digest, event.receiver_digest) == (echo.digest, echo.digest ^ 1)
    assert goodbye.ending is Ending.DESYNC
    assert session.on_measurement(10, (1.0,)) == []


def test_when_several_digests_differ_in_one_frame_then_the_first_is_reported() -> None:
    session, far = flying(), Far()
    echoes = []
    for sample in range(3):
        session.on_measurement(10 * sample, (1.0,))
        echo = far.echo()
        echoes.append(Echo(sample, echo.word_number, echo.digest ^ (sample > 0), echo.steps))
    answers: list[Frame] = session.on_frame(frame(*echoes))
    assert [answer.sample for answer in answers if isinstance(answer, Desync)] == [1]


# Ends


def test_when_either_side_says_bye_then_the_session_ends_once() -> None:
    session = flying()
    assert session.on_frame(Bye(SESSION + 1, Ending.OVER, "not mine")) == []
    assert session.phase is Phase.FLYING
    session.on_frame(Bye(SESSION, Ending.OVER, "tired"))
    assert session.phase is Phase.ENDED
    end = End(Ending.OVER, "tired", by_peer=True)
    assert session.end == end
    assert session.bye(End(Ending.OVER, "me too")) == []
    assert session.end == end


def test_when_it_says_bye_in_flight_then_the_receiver_is_informed() -> None:
    assert flying().bye(End(Ending.OVER, "landed")) == [Bye(SESSION, Ending.OVER, "landed")]
    assert transmitter().bye(End(Ending.OVER, "never flew")) == []


def test_when_erasures_are_echoed_then_their_number_is_the_erased_one() -> None:
    assert Far().echo(ERASED).word_number == WIRE_ERASED
