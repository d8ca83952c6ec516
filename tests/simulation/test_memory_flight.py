"""Whole flights in one process: lockstep, accuracy, losses, repeatability."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from channel.codec import numerics
from channel.codec.codec import Codec
from channel.codec.models import pitch
from channel.errors import ConfigMismatch
from channel.line.line import CleanLine, Delivery, Line
from channel.protocol.frames import Why
from tenbaud.sentences.events import event_text
from tests.channel.codec.parts import PAPER, THREE_SIGNS
from tests.events import event_fields
from tests.simulation.flight import assert_lockstep, largest_share, pitch_flight
from tests.simulation.lines import DelayingLine, JitterLine, LossyLine, SlowDownlink
from transmitter.session.session import Phase

MS = 1_000_000


@pytest.mark.parametrize(
    ("zoom", "ticks", "mismatch", "bound"),
    [
        (PAPER, 10, 0.1, 0.05),
        (PAPER, 5, 0.1, 0.05),
        pytest.param(PAPER, 10, -0.1, 0.05, marks=pytest.mark.soak),
        (THREE_SIGNS, 10, 0.1, 0.02),
        pytest.param(THREE_SIGNS, 10, 0.0, 0.02, marks=pytest.mark.soak),
        (THREE_SIGNS, 5, 0.0, 0.01),
        # With an exact model the window of two locks into ++--: see the reading notes.
        (PAPER, 10, 0.0, 0.15),
        pytest.param(PAPER, 5, 0.0, 0.08, marks=pytest.mark.soak),
    ],
)
def test_when_the_paper_is_flown_then_the_error_is_within_its_bound(
    zoom: object, ticks: int, mismatch: float, bound: float
) -> None:
    flight = pitch_flight(zoom, ticks_per_sample=ticks, mismatch=mismatch)
    result = flight.fly(50.0)  # type: ignore[arg-type]
    assert result.ticks == 5_000
    assert_lockstep(flight, 5_000 // ticks)
    assert 0.001 < largest_share(flight) < bound
    assert flight.node.scores.first.live.largest == flight.node.scores.first.coded.largest
    assert flight.node.scores.first.largest > 1.5
    assert flight.node.commands_late == 0
    assert flight.receiver.counts["erasures"] == 0


def test_when_ten_baud_are_flown_then_one_bit_per_sample_is_paid_and_measured() -> None:
    flight = pitch_flight()
    flight.fly(30.0)
    meter = flight.uplink.meter
    assert meter.coder_bits == 300
    assert flight.receiver.meter.baud == pytest.approx(10.0)
    assert flight.endpoint.inlet.meter.wire_bytes == meter.wire_bytes
    assert flight.endpoint.downlink.meter.wire_bytes == flight.loop.endpoint.inlet.meter.wire_bytes
    assert flight.uplink.refused == 0


def test_when_bits_arrive_at_the_end_of_their_slot_then_the_live_error_stays_bounded() -> None:
    flight = pitch_flight(THREE_SIGNS, mismatch=0.1, delivery="end", lead_ticks=13)
    flight.fly(50.0)
    assert_lockstep(flight, 500)
    scores = flight.node.scores
    assert scores.first.coded.largest < scores.first.live.largest < 0.05 * scores.first.largest
    assert largest_share(flight) < 0.02
    assert flight.node.commands_late == 0


def test_when_a_flight_is_flown_twice_then_every_digest_is_the_same() -> None:
    one, other = (pitch_flight(mismatch=0.1) for _ in range(2))
    assert one.fly(15.0).digests == other.fly(15.0).digests
    assert one.transmitter_rows.rows == other.transmitter_rows.rows
    assert one.receiver_rows.rows == other.receiver_rows.rows


@pytest.mark.parametrize(
    ("share", "bound"), [(0.1, 0.05), (0.3, 0.08), (0.5, 0.15)], ids=["tenth", "third", "half"]
)
def test_when_symbols_are_lost_then_both_ends_count_them_and_stay_in_lockstep(
    share: float, bound: float
) -> None:
    line = LossyLine(share)
    flight = pitch_flight(THREE_SIGNS, mismatch=0.1, lead_ticks=3, uplink_line=line)
    result = flight.fly(50.0)
    # The end of the flight may leave a lost last symbol undecided.
    samples = flight.receiver.state.sample
    assert 490 <= samples <= 500
    assert flight.transmitter.counts["digest_checks"] == samples
    assert flight.transmitter.counts["desyncs"] == 0
    assert flight.transmitter.confirmed_state == flight.receiver.state
    assert list(result.digests) == flight.receiver_rows.column("sample", "digest")
    erasures = flight.transmitter.counts["erasures"]
    assert erasures == flight.receiver.counts["erasures"]
    assert line.losses - (500 - samples) == erasures > 0.7 * share * 500
    assert largest_share(flight) < bound


def test_when_the_first_symbols_are_lost_then_their_samples_are_erased() -> None:
    line = LossyLine(lost=frozenset({0, 1}))
    flight = pitch_flight(THREE_SIGNS, lead_ticks=3, uplink_line=line)
    result = flight.fly(5.0)
    assert_lockstep(flight, 50)
    assert result.words[:2] == (None, None)
    assert None not in result.words[2:]
    assert flight.receiver.counts["erasures"] == 2


def test_when_symbols_miss_their_deadlines_then_they_are_erased_and_dropped() -> None:
    late = frozenset({10, 20, 21, 40})
    line = DelayingLine(late, 25 * MS)
    flight = pitch_flight(THREE_SIGNS, lead_ticks=3, uplink_line=line)
    result = flight.fly(10.0)
    assert_lockstep(flight, 100)
    assert flight.receiver.counts["symbols_late"] == 4
    assert flight.receiver.counts["erasures"] == flight.transmitter.counts["erasures"] == 4
    words = flight.receiver_rows.column("sample", "word")
    assert {sample for sample, word in enumerate(words) if word is None} == late
    assert None not in result.words_sent


def test_when_symbols_arrive_at_other_times_within_their_deadlines_then_states_are_equal() -> None:
    # A deadline counts from the last arrival, so the jitter may be as long as the allowance.
    delaying = DelayingLine(frozenset(range(3, 90, 7)), 20 * MS)
    lines: list[Line] = [CleanLine(), JitterLine(20 * MS), delaying]
    flights = [pitch_flight(mismatch=0.1, lead_ticks=3, uplink_line=line) for line in lines]
    results = [flight.fly(15.0) for flight in flights]
    assert_lockstep(flights[0], 150)
    arrivals = [flight.receiver_rows.column("sample", "arrival_s") for flight in flights]
    assert arrivals[0] != arrivals[1] != arrivals[2]
    for flight, result in zip(flights[1:], results[1:], strict=True):
        assert flight.receiver.counts["erasures"] == 0
        assert flight.node.commands_late == 0
        assert result.digests == results[0].digests
        np.testing.assert_array_equal(result.commands, results[0].commands)


@pytest.mark.parametrize(("delay_ms", "late"), [(10, False), (30, False), (31, True)])
def test_when_the_downlink_is_slow_then_commands_are_late_only_beyond_the_lead(
    delay_ms: int, late: bool
) -> None:
    flight = pitch_flight(lead_ticks=3, downlink_line=SlowDownlink(delay_ms * MS))
    result = flight.fly(10.0)
    assert (flight.node.commands_late > 0) is late
    assert flight.transmitter.counts["desyncs"] == 0
    assert (
        list(result.digests) == flight.receiver_rows.column("sample", "digest")[: len(result.digests)]
    )
    assert len(result.digests) >= 99


def test_when_the_downlink_is_slow_then_the_handshake_is_still_over_before_the_flight() -> None:
    line = CleanLine(delay_ns=10 * MS)
    flight = pitch_flight(lead_ticks=3, downlink_line=line)
    flight.fly(10.0)
    assert flight.transmitter.counts["words_missed"] == 0
    assert flight.receiver.counts["erasures"] == 0


class WrongSine:
    """The pitch model with a sine one ulp off, from a given call on."""

    def __init__(self, codec: Codec, first_tick: int) -> None:
        self._model = codec.model
        self._first_tick = first_tick
        self.ticks = 0
        self.state_size = codec.model.state_size
        self.correction_size = codec.model.correction_size
        self.input_size = codec.model.input_size
        self.initial = codec.model.initial
        self.measured = codec.model.measured

    def tick(self, state, command, held):  # type: ignore[no-untyped-def]

        self.ticks += 1
        if self.ticks <= self._first_tick:
            return self._model.tick(state, command, held)
        pitch.sin = lambda x: math.nextafter(numerics.sin(x), math.inf)
        try:
            return self._model.tick(state, command, held)
        finally:
            pitch.sin = numerics.sin


def test_when_one_end_computes_a_sine_one_ulp_off_then_it_is_reported_and_ends_safe() -> None:
    twin = pitch_flight(mismatch=0.1)
    codec = twin.receiver.codec
    wrong = WrongSine(codec, first_tick=1000)
    receiver_codec = Codec(wrong, codec.coder, codec.ticks_per_sample)
    flight = pitch_flight(mismatch=0.1, receiver_codec=receiver_codec, stop_on_desync=True)
    result = flight.fly(20.0)
    twin_result = twin.fly(20.0)

    report = flight.transmitter.desync
    assert report is not None
    assert report == flight.receiver.desync
    # The wrong sine acts from sample 100 on, and the last bit it changes may need a sample or two to
    # reach the state; the report comes with the first digest that differs, not later.
    assert 100 <= report.sample <= 103
    own = [int(str(digest), 16) for digest in flight.transmitter_rows.column("sample", "digest")]
    peer = [int(str(digest), 16) for digest in flight.transmitter_rows.column("sample", "peer_digest")]
    assert own[:-1] == peer[:-1]
    assert own[:-1] == [int(str(digest), 16) for digest in twin_result.digests[: len(own) - 1]]
    assert (own[-1], peer[-1]) == (report.transmitter_digest, report.receiver_digest)
    assert own[-1] != peer[-1]
    assert len(own) == report.sample + 1
    assert codec.digest(codec.unpack(report.state)) == report.transmitter_digest
    for session in (flight.transmitter, flight.receiver):
        assert session.counts["desyncs"] == 1
        text = " ".join(event_text(event_fields(event)) for event in session.events)
        assert f"{own[-1]:016x}" in text
        assert f"{peer[-1]:016x}" in text

    assert flight.transmitter.phase is Phase.ENDED
    assert flight.node.latched
    assert flight.node.guard.command == (0.0, 0.0)
    assert result.ticks <= report.sample * 10 + 60
    applied = flight.transmitter_rows.column("tick", "applied")
    assert applied[-1] == (0.0, 0.0)


def test_when_command_frames_are_lost_within_the_repeats_then_nothing_is_missing() -> None:
    class DownlinkLoss(CleanLine):
        def __init__(self) -> None:
            super().__init__()
            self.frames = 0

        def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
            self.frames += 1
            lost = self.frames > 1 and self.frames % 10 in (3, 4)
            return [Delivery(now_ns, None if lost else data)]

    flight = pitch_flight(lead_ticks=33, downlink_line=DownlinkLoss())
    flight.fly(20.0)
    assert_lockstep(flight, 200)
    assert flight.node.commands_late == 0


def test_when_more_command_frames_are_lost_than_repeated_then_the_ends_rejoin() -> None:
    class Gap(CleanLine):
        def __init__(self) -> None:
            super().__init__()
            self.frames = 0

        def carry(self, data: bytes, now_ns: int) -> list[Delivery]:
            self.frames += 1
            return [Delivery(now_ns, None if 50 <= self.frames < 53 else data)]

    flight = pitch_flight(lead_ticks=33, downlink_line=Gap())
    result = flight.fly(20.0)
    assert flight.transmitter.counts["desyncs"] == 0
    assert flight.transmitter.counts["rejoins"] == 1
    assert flight.transmitter.epoch == flight.receiver.epoch == 1
    assert any(event.cause is Why.GAP for event in flight.transmitter.events)
    assert result.ticks == 2000
    assert result.digests[-1] == flight.receiver_rows.column("sample", "digest")[-1]


def test_when_the_receivers_configuration_differs_then_no_symbol_leaves() -> None:
    flight = pitch_flight()
    other = json.dumps(json.loads(flight.receiver.identity.config) | {"rate_baud": 20.0})
    flight.receiver.identity = replace(flight.receiver.identity, config=other)
    with pytest.raises(ConfigMismatch, match=r"rate_baud: here 10\.0, there 20\.0"):
        flight.fly(1.0)
    assert flight.transmitter.phase is Phase.GREETING
    assert "rate_baud" in str(flight.receiver.refusal)
    assert flight.uplink.meter.symbols == 0
