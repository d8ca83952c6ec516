"""Whole flights of models that are not the paper's: no commands at all, and words of two symbols."""

from __future__ import annotations

import pytest

from channel.codec.codec import WIRE_ERASED, Alphabet, Codec
from channel.codec.coders.zoom import ZoomCoder
from channel.codec.signals import signals_of
from channel.protocol.limits import CommandLimits
from tenbaud import MemoryFlight
from tests.channel.codec.chua import (
    CHUA_TICK_S,
    CHUA_TICKS_PER_SAMPLE,
    CHUA_ZOOM,
    ChuaModel,
    ChuaPlant,
)
from tests.channel.codec.parts import ConstantController, terms
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes, TwoAxesPlant
from tests.simulation.flight import assert_lockstep
from tests.simulation.lines import LossyLine

MS = 1_000_000


def test_when_chua_is_flown_through_both_sessions_then_no_command_is_needed() -> None:
    codec = Codec(ChuaModel(CHUA_TICK_S), ZoomCoder(CHUA_ZOOM), CHUA_TICKS_PER_SAMPLE)
    flight_terms = terms(
        tick_ns=5 * MS,
        rate_baud=20.0,
        initial_command=(),
        limits=CommandLimits((), ()),
        signals=signals_of(codec.model),
        lead_ticks=7,
    )
    flight_terms.check("real")
    flight = MemoryFlight(
        codec,
        flight_terms,
        ChuaPlant(CHUA_TICK_S),
        ConstantController(),
        uplink_line=LossyLine(0.05),
        scored_from_s=20.0,
        encoder_counts_per_turn=100_000,
    )
    result = flight.fly(60.0)
    assert result.ticks == 12_000
    assert flight.transmitter.counts["digest_checks"] == flight.receiver.state.sample >= 1190
    assert flight.transmitter.counts["desyncs"] == 0
    assert flight.node.commands_late == 0
    assert flight.node.scores.first.largest > 1.5
    assert flight.node.scores.first.coded.largest < 0.2


@pytest.mark.parametrize("ticks", [4, 5])
def test_when_two_axes_are_flown_then_a_word_takes_two_slots(ticks: int) -> None:
    codec = Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), ticks)
    flight_terms = terms(
        ticks_per_sample=ticks, symbols_per_word=2, rate_baud=50.0, lead_ticks=2 * ticks
    )
    flight_terms.check("real")

    class Damper(ConstantController):
        def command(self, tick, state):  # type: ignore[no-untyped-def]
            return (-4.0 * state[0] - 4.0 * state[2], -4.0 * state[1] - 4.0 * state[3])

    flight = MemoryFlight(
        codec, flight_terms, TwoAxesPlant(0.01, (0.4, -0.2, 0.0, 0.3)), Damper(), scored_from_s=10.0
    )
    flight.fly(20.0)
    samples = 2000 // ticks
    assert_lockstep(flight, samples)
    assert flight.receiver.counts["erasures"] == 0
    assert flight.uplink.meter.symbols == 2 * samples
    assert flight.node.scores.first.coded.largest < 0.05
    assert flight.node.scores.first.largest < 0.2


def test_when_one_symbol_of_a_word_of_two_is_lost_then_both_ends_see_the_word_erased() -> None:
    codec = Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), 4)
    flight_terms = terms(ticks_per_sample=4, symbols_per_word=2, rate_baud=50.0, lead_ticks=8)
    lost = frozenset({20, 31, 40, 41})
    flight = MemoryFlight(
        codec,
        flight_terms,
        TwoAxesPlant(0.01, (0.1, 0.0, 0.0, 0.0)),
        ConstantController(0.0, 0.0),
        uplink_line=LossyLine(lost=lost),
    )
    result = flight.fly(2.0)
    assert_lockstep(flight, 50)
    words = list(result.words)
    assert [sample for sample, word in enumerate(words) if word is None] == [10, 15, 20]
    assert flight.receiver.counts["erasures"] == flight.transmitter.counts["erasures"] == 3
    assert Alphabet((-1, 1), 2).word(WIRE_ERASED) is None
