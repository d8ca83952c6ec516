"""Which request gets which answer, and where the ends begin anew."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from channel.protocol.endings import Ending
from channel.protocol.frames import (
    Bye,
    Commands,
    Desync,
    Frame,
    Hello,
    Refuse,
    Symbol,
    Unknown,
    Welcome,
    Why,
)
from channel.protocol.lockstep import HISTORY_SAMPLES
from receiver.session.rejoin import (
    ANSWER_AGE_SAMPLES_MAX,
    KEEP_CODER_SAMPLES,
    PERSISTENT_REQUESTS,
    carried_to,
)
from receiver.session.session import ReceiverSession
from tests.receiver.session.sessions import CODEC, MS, PEER, SESSION, flying, hello, receiver, symbol

VOLTS = (1.0, -1.0)


def request(number: int, sample: int, peer: int = PEER, **changes: Any) -> Hello:
    identity = hello(peer)
    values = {"request": number, "sample": sample, "session": SESSION, "why": Why.GAP, **changes}
    return replace(identity, **values)


def flown(samples: int, **changes: Any) -> ReceiverSession:
    session = flying(*VOLTS, **changes)
    for slot in range(samples):
        session.on_frame(symbol(slot), slot * 100 * MS)
    return session


def only_welcome(frames: list[Frame]) -> Welcome:
    (welcome,) = frames
    assert isinstance(welcome, Welcome)
    return welcome


def test_when_a_rejoin_is_asked_for_then_a_new_epoch_begins_ahead_of_both() -> None:
    session = flown(10, lead_ticks=13)
    welcome = only_welcome(session.on_frame(request(1, 12), 12 * 100 * MS))
    # 13 ticks of lead are two samples.
    assert (welcome.epoch, welcome.first_sample, welcome.request) == (1, 14, 1)
    assert welcome.hold_steps == (1000, -1000)
    assert CODEC.unpack(welcome.state) == session.state
    assert session.state.sample == 14
    assert session.next_deadline() is None


def test_when_the_receiver_is_ahead_then_the_start_is_its_own_next_sample() -> None:
    session = flown(20)
    assert only_welcome(session.on_frame(request(1, 12), 1_950 * MS)).first_sample == 20


def test_when_the_request_is_repeated_then_so_is_the_answer_until_it_is_used_or_old() -> None:
    session = flown(10)
    first = only_welcome(session.on_frame(request(1, 12), 12 * 100 * MS))
    for later in range(1, ANSWER_AGE_SAMPLES_MAX + 1):
        assert session.on_frame(request(1, 12 + later), (12 + later) * 100 * MS) == [first]
    second = only_welcome(session.on_frame(request(1, 13 + ANSWER_AGE_SAMPLES_MAX), 1_800 * MS))
    assert second.epoch == 2
    assert second.first_sample == 13 + ANSWER_AGE_SAMPLES_MAX
    session.on_frame(symbol(second.first_sample, epoch=2), 1_900 * MS)
    assert session.on_frame(request(1, 40), 40 * 100 * MS) == []
    assert session.epoch == 2
    assert only_welcome(session.on_frame(request(2, 40), 40 * 100 * MS)).epoch == 3
    assert session.on_frame(request(1, 41), 41 * 100 * MS) == []


def test_when_samples_are_short_then_an_answer_on_its_way_is_not_replaced_by_another() -> None:
    session = flown(10, tick_ns=MS // 20, rate_baud=2000.0)
    first = only_welcome(session.on_frame(request(1, 12), 902 * MS))
    assert session.on_frame(request(1, 12 + 90), 947 * MS) == [first]
    assert only_welcome(session.on_frame(request(1, 13 + 100), 953 * MS)).epoch == 2


def test_when_symbols_are_of_an_old_epoch_then_they_are_not_consumed() -> None:
    session = flown(10)
    welcome = only_welcome(session.on_frame(request(1, 12), 12 * 100 * MS))
    before = session.state
    # The transmitter seems not to have the answer, so it gets it again.
    assert session.on_frame(symbol(12, epoch=0), 12 * 100 * MS) == [welcome]
    assert session.state == before
    (commands,) = session.on_frame(symbol(12, epoch=1), 12 * 100 * MS)
    assert isinstance(commands, Commands)
    assert commands.epoch == 1
    assert [echo.sample for echo in commands.echoes] == [12]
    assert session.on_frame(symbol(13, epoch=0), 13 * 100 * MS) == []


def test_when_a_fresh_receiver_hears_a_symbol_then_it_says_that_it_knows_nothing() -> None:
    session = receiver()
    assert session.on_frame(Symbol(99, 4, 1000, 1), 0) == [Unknown(99, 4)]
    welcome = only_welcome(session.on_frame(request(3, 1001, session=99, why=Why.UNKNOWN), 0))
    assert (welcome.session, welcome.epoch, welcome.first_sample) == (SESSION, 0, 1001)
    assert welcome.state == b""
    (commands,) = session.on_frame(symbol(1001), 0)
    assert isinstance(commands, Commands)


def test_when_the_transmitter_was_started_again_then_it_flies_on_in_the_receivers_time() -> None:
    session = flown(20)
    stranger = request(0, 0, PEER + 1, session=0, why=Why.START)
    assert session.on_frame(stranger, 1910 * MS) == []
    session.on_deadline(2_130 * MS)  # two slots stayed empty
    welcome = only_welcome(session.on_frame(stranger, 2_140 * MS))
    assert (welcome.session, welcome.epoch, welcome.first_sample) == (SESSION, 1, 22)
    assert welcome.state == b""
    assert welcome.hold_steps == ()
    assert session.state == CODEC.initial()._replace(sample=22)
    # The first transmitter was only asleep: nobody listens to it any more.
    assert Commands not in {type(frame) for frame in session.on_frame(symbol(22), 2_150 * MS)}
    for slot in (22, 23, 24):
        session.on_frame(symbol(slot, epoch=1), slot * 100 * MS)
    refused = session.on_frame(request(5, 30), 2_500 * MS)
    assert refused == []
    for slot in (25, 26, 27):
        session.on_frame(symbol(slot, epoch=1), slot * 100 * MS)
    (answer,) = session.on_frame(request(5, 31), 2_800 * MS)
    assert isinstance(answer, Refuse)
    assert session.on_frame(Bye(0, Ending.OVER, "so be it"), 0) == []


def test_when_nothing_comes_for_long_then_erasures_are_not_counted_for_ever() -> None:
    session = flown(5)
    session.on_deadline(10**15)
    assert session.counts["erasures"] == HISTORY_SAMPLES
    assert session.next_deadline() is None
    assert session.on_frame(symbol(10_000), 10**15) == [Unknown(SESSION, 0)]


def test_when_the_pause_is_long_then_the_coder_begins_again_but_not_the_model() -> None:
    session = flown(40)
    state = session.state
    short = carried_to(CODEC, state, 40 + KEEP_CODER_SAMPLES, (), VOLTS, 0)
    assert short.coder != CODEC.coder.initial()
    long = carried_to(CODEC, state, 41 + KEEP_CODER_SAMPLES, (), VOLTS, 0)
    assert long.coder == CODEC.coder.initial()
    assert long.model == CODEC.step(short, None, [VOLTS] * 10).model
    silent = carried_to(CODEC, state, 40, (), VOLTS, KEEP_CODER_SAMPLES + 1)
    assert silent == state._replace(coder=CODEC.coder.initial())
    far = carried_to(CODEC, state, 41 + HISTORY_SAMPLES, (), VOLTS, 0)
    assert far == CODEC.initial()._replace(sample=41 + HISTORY_SAMPLES)


def test_when_the_request_comes_in_the_middle_of_a_word_then_the_word_is_given_up() -> None:
    from tests.receiver.session.sessions import two_axes

    session = two_axes()
    session.on_frame(symbol(0), 0)
    assert only_welcome(session.on_frame(request(1, 0), 0 * 100 * MS)).first_sample == 1


# Requests that make no sense


def test_when_one_request_is_for_a_sample_far_ahead_then_it_is_dropped_and_the_flight_goes_on() -> None:
    session = flown(10)
    assert session.on_frame(request(1, 2**31), 950 * MS) == []
    assert session.counts["out_of_bounds"] == 1
    assert session.epoch == 0
    assert Commands in {type(frame) for frame in session.on_frame(symbol(10), 1_000 * MS)}
    assert only_welcome(session.on_frame(request(1, 12), 1_150 * MS)).first_sample == 12


def test_when_a_fresh_receiver_is_asked_for_a_sample_beyond_all_counters_then_it_waits() -> None:
    session = receiver()
    assert session.on_frame(request(0, 2**32 - 1, session=0), 0) == []
    assert session.counts["out_of_bounds"] == 1
    assert only_welcome(session.on_frame(hello(), 0)).first_sample == 0


def test_when_a_fresh_receiver_was_sent_far_ahead_then_the_next_request_brings_it_back() -> None:
    session = receiver()
    assert only_welcome(session.on_frame(request(3, 2**30, PEER + 1), 0)).first_sample == 2**30
    assert only_welcome(session.on_frame(request(1, 50), 10 * MS)).first_sample == 50


def test_when_an_answer_is_for_a_sample_far_ahead_then_it_is_not_repeated_for_another() -> None:
    session = receiver()
    forged = only_welcome(session.on_frame(request(3, 2**30), 0))
    assert session.on_frame(request(3, 2**30 + 1), 100 * MS) == [forged]
    assert only_welcome(session.on_frame(request(3, 50), 100 * MS)).first_sample == 50


def test_when_an_answer_is_never_used_then_the_next_one_follows_from_the_flight_before_it() -> None:
    session = flown(10)
    flown_state = session.state
    for number in range(1, 6):
        only_welcome(session.on_frame(request(number, 13), 1_000 * MS + number * MS))
    welcome = only_welcome(session.on_frame(request(9, 12), 1_100 * MS))
    assert welcome.first_sample == 12
    expected = carried_to(CODEC, flown_state, 12, (), VOLTS, 0)
    assert CODEC.unpack(welcome.state) == expected


def test_when_requests_go_on_against_what_is_known_then_they_are_accepted_if_nobody_is_heard() -> None:
    session = flown(10)
    only_welcome(session.on_frame(request(2**32 - 1, 12), 950 * MS))
    # The transmitter's own requests have lower numbers.
    for later in range(PERSISTENT_REQUESTS - 1):
        assert session.on_frame(request(1, 13 + later), (1_000 + 100 * later) * MS) == []
        assert session.on_frame(request(1, 13 + later), (1_001 + 100 * later) * MS) == [], "a copy"
    welcome = only_welcome(session.on_frame(request(1, 20), 1_700 * MS))
    assert (welcome.request, welcome.first_sample) == (1, 20)
    assert only_welcome(session.on_frame(request(2, 30), 2_700 * MS)).request == 2


def test_when_old_requests_are_played_back_while_symbols_come_then_the_flight_goes_on() -> None:
    session = flown(10)
    only_welcome(session.on_frame(request(5, 10), 950 * MS))
    for slot in range(10, 40):
        (commands,) = session.on_frame(symbol(slot, epoch=1), slot * 100 * MS)
        assert isinstance(commands, Commands)
        assert session.on_frame(request(3, slot - 5), (slot * 100 + 10) * MS) == []
    assert session.epoch == 1


def test_when_the_transmitters_name_comes_with_another_configuration_then_it_is_ignored() -> None:
    session = flown(10)
    assert session.on_frame(request(1, 12, config_digest=bytes(16)), 950 * MS) == []
    assert session.counts["refused_hellos"] == 1
    assert only_welcome(session.on_frame(request(1, 12), 960 * MS)).epoch == 1


def test_when_this_end_is_too_far_ahead_of_the_transmitter_then_its_own_count_is_wrong() -> None:
    session = flying(*VOLTS)
    for slot in range(300):
        session.on_frame(symbol(slot, slot % 2), slot * 100 * MS)
    assert only_welcome(session.on_frame(request(1, 20), 30_000 * MS)).first_sample == 20
    assert session.state == CODEC.initial()._replace(sample=20)


def test_when_a_report_is_of_a_sample_that_this_end_has_not_flown_then_it_is_dropped() -> None:
    session = flown(10)
    assert session.on_frame(Desync(SESSION, 0, 10, 1, 2, b""), 950 * MS) == []
    assert session.counts["out_of_bounds"] == 1
    (answer,) = session.on_frame(Desync(SESSION, 0, 8, 1, 2, b""), 950 * MS)
    assert isinstance(answer, Desync)
    for _ in range(3):
        session.on_frame(Desync(SESSION, 0, 7, 1, 2, b""), 950 * MS)
    assert session.counts["desyncs"] == 1
