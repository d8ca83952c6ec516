"""Words with more symbols than their sample has ticks: each symbol still waits for its slot."""

from __future__ import annotations

from channel.codec.codec import Codec
from channel.codec.coders.pcm import PcmCoder, PcmParameters
from channel.codec.models.hold import HoldModel
from plant_sim.pitch import PitchParameters, PitchPlant
from receiver.controllers.pid import PAPER_GAINS, Pid
from tenbaud import MemoryFlight
from tests.channel.codec.parts import TICK_S, terms
from tests.simulation.flight import REFERENCE


def test_when_a_word_of_ten_symbols_goes_up_per_tick_then_every_word_arrives_on_the_grid() -> None:
    codec = Codec(HoldModel(TICK_S), PcmCoder(PcmParameters()), 1)
    agreed = terms(ticks_per_sample=1, symbols_per_word=10, rate_baud=1000.0, lead_ticks=4)
    agreed.check("virtual")
    flight = MemoryFlight(
        codec,
        agreed,
        PitchPlant(PitchParameters(), TICK_S),
        Pid(PAPER_GAINS, REFERENCE, TICK_S),
        encoder_counts_per_turn=1024,
    )
    flight.fly(10.0)
    assert flight.transmitter.counts["digest_checks"] == 1000
    assert flight.transmitter.counts["desyncs"] == 0
    assert flight.receiver.counts["erasures"] == 0
    assert flight.uplink.refused == 0
    assert flight.receiver.meter.baud is not None
    assert abs(flight.receiver.meter.baud - 1000.0) < 1e-6
    assert flight.node.scores.first.coded.largest < 0.02 / 2
