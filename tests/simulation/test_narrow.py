"""Flights with a narrow downlink: nothing is confirmed that the receiver did not fly."""

from __future__ import annotations

import math
import os
import random
import statistics

import pytest

from channel.codec.codec import Word
from channel.codec.downlink.coded import CodedDirection
from channel.codec.downlink.laws import MirroredFeedback, check_law
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay
from channel.codec.downlink.mirrored import MirroredLaw, SetPointRange
from receiver.controllers.pid import PAPER_GAINS, Pid
from receiver.controllers.references import Square
from receiver.controllers.state_feedback import StateFeedback
from reproduction.bothways.flights import Wants
from reproduction.bothways.lines import Faults
from tenbaud.build.codec import build_codec
from tenbaud.build.controllers import build_controller
from tenbaud.config.load import load_config
from tests.channel.codec.downlink.test_machine import SCHEMES, machine, wanted
from tests.simulation.confirmations import BLOCK, LINES, count_all, counted
from tests.simulation.narrow import (
    TICK_S,
    TICKS,
    NarrowFlight,
    coded,
    full,
    mirrored,
    paper_law,
    square,
    tuned_codec,
)
from transmitter.session.narrow.hypotheses import Hypotheses

LAYOUT, QUEUE = Layout(2, 1, 4), 15
DIRECTION = CodedDirection((0.5, -0.5), (1.0, -1.0))
BURSTS = Faults(burst_up=(0.02, 0.25), burst_down=(0.02, 0.25))


def announced(queue: int) -> Wants:
    return lambda tick, live: (square(tick + queue * TICKS),)


def pid() -> Wants:
    return Pid(PAPER_GAINS, Square(math.pi / 2, 25.0, TICK_S), TICK_S).command


def test_on_a_clean_line_every_sample_is_confirmed_as_it_was_flown() -> None:
    flight = NarrowFlight(mirrored(LAYOUT, QUEUE), announced(QUEUE), 1, keep=True)
    result = flight.fly(600)
    assert result.wrong == 0
    assert result.confirmed > 570
    assert result.rejoins == []
    assert [one.sample for one in flight.confirmed] == list(range(result.confirmed))
    assert flight.hypotheses.confirmed_state == flight.confirmed[-1].flown.state
    assert statistics.median(result.delays) <= 10
    own = full(tuned_codec(), paper_law(), 1, 600)
    assert result.error < 1.1**2 * own.error
    assert result.tracking < 1.02**2 * own.tracking


@pytest.mark.parametrize(
    "faults",
    [
        Faults.both(loss=0.01),
        Faults.both(loss=0.05),
        Faults.both(flip=0.005),
        Faults.both(loss=0.01, flip=0.003),
        Faults(loss_down=0.2),
        Faults(loss_up=0.1),
        BURSTS,
        Faults(burst_up=(0.01, 0.1), burst_down=(0.01, 0.1)),
    ],
)
def test_nothing_is_confirmed_that_the_receiver_did_not_fly(faults: Faults) -> None:
    result = NarrowFlight(mirrored(LAYOUT, QUEUE), announced(QUEUE), 1, faults).fly(300)
    assert (result.wrong, result.doubted) == (0, 0)
    assert result.confirmed > 200


@pytest.mark.parametrize(
    ("line", "seed"),
    [("loss 1 %", 0), ("loss 1 %", 1), ("loss 5 %", 0), ("loss 5 %", 1), ("bursts", 0)],
)
def test_in_a_hundred_thousand_samples_nothing_wrong_is_confirmed(line: str, seed: int) -> None:
    """Five blocks of 20,000."""
    found = counted(LINES[line], seed, BLOCK)
    assert found.wrong == 0
    assert found.doubted < 0.002 * found.confirmed
    assert found.confirmed > 0.95 * BLOCK
    assert found.rejoins <= (0.002 * found.confirmed if line == "bursts" else 1)


@pytest.mark.parametrize(("layout", "period"), [(Layout(2), 1), (Layout(1, 1, 2), 2), (Layout(4), 1)])
def test_coded_commands_of_any_controller_are_confirmed_as_sent(layout: Layout, period: int) -> None:
    faults = Faults.both(loss=0.01)
    result = NarrowFlight(coded(layout, DIRECTION), pid(), 1, faults).fly(200)
    assert result.wrong == 0
    assert result.confirmed > 150


@pytest.mark.parametrize(("round_trip", "lead_ticks"), [(1, 0), (1, 10), (1, 14), (4, 0), (4, 40)])
def test_symbols_may_come_samples_later(round_trip: int, lead_ticks: int) -> None:
    flight = NarrowFlight(
        mirrored(LAYOUT, QUEUE, lead_ticks),
        announced(QUEUE),
        1,
        Faults.both(loss=0.01),
        round_trip=round_trip,
    )
    result = flight.fly(300)
    assert result.wrong == 0
    assert result.confirmed > 240


@pytest.mark.parametrize("at", range(len(SCHEMES)))
def test_any_model_with_any_scheme_is_followed_through_erasures_and_flips(at: int) -> None:
    scheme, layout = SCHEMES[at]
    two_way: TwoWay = machine(scheme, layout, 5)
    hypotheses, state, chance = Hypotheses(two_way), two_way.initial(), random.Random(at)
    taken: list[Word] = []
    wrong = confirmed = 0
    loss = 0.03 if layout.symbols_per_sample > 1 else 0.005
    for sample in range(150):
        sent = (chance.choice((-1, 1)), chance.choice((-1, 1)))
        hypotheses.sent(sent)
        dice = chance.random()
        word: Word = None if dice < loss else (-sent[0], sent[1]) if dice < 1.3 * loss else sent
        taken.append(word)

        flown, symbols = two_way.fly(state, word, wanted)
        state = flown.state
        heard = [None if chance.random() < loss else symbol for symbol in symbols]
        for done in hypotheses.heard(sample, heard):
            confirmed += 1
            wrong += done.word != taken[done.sample]
    assert wrong == 0
    assert hypotheses.rejoin is None
    assert confirmed > 60


@pytest.mark.parametrize("preset", ["helicopter-20baud", "pendulum-16baud"])
def test_the_law_and_the_coder_of_a_preset_are_followed(preset: str) -> None:
    config = load_config(preset)
    codec, controller = build_codec(config), build_controller(config)
    assert isinstance(controller, StateFeedback)
    largest = controller._command_max
    law = MirroredFeedback(controller.law, largest, controller.tick_s)
    check_law(law, codec.model)
    rest = codec.model.measured(codec.model.initial())
    ranges = [SetPointRange(at, one - 1.0, one + 1.0, one) for at, one in enumerate(rest)]
    scheme = MirroredLaw(law, ranges, len(rest), 9, 20, LAYOUT)
    none = (0.0,) * len(largest)
    two_way = TwoWay(codec, scheme, LAYOUT, 0, none, largest, (math.inf,) * len(largest))
    hypotheses, state, chance = Hypotheses(two_way), two_way.initial(), random.Random(1)
    truth = []
    for sample in range(70):
        sent = (chance.choice((-1, 1)),)
        hypotheses.sent(sent)
        word: Word = None if chance.random() < 0.05 else sent
        flown, symbols = two_way.fly(
            state, word, lambda tick, live: (rest[0] + 0.3 * (tick > 40 * TICKS), *rest[1:])
        )
        truth.append((word, symbols, state))
        state = flown.state
        heard = [None if chance.random() < 0.05 else symbol for symbol in symbols]
        for done in hypotheses.heard(sample, heard):
            assert (done.word, done.symbols, done.before) == truth[done.sample]
    assert hypotheses.next_confirmed > 35


@pytest.mark.parametrize("at_receiver", [True, False])
def test_a_corrupt_state_is_found_within_twelve_samples_and_replaced(at_receiver: bool) -> None:
    flight = NarrowFlight(mirrored(LAYOUT, QUEUE), announced(QUEUE), 2)
    flight.fly(150)
    found = []
    for _ in range(15):
        flight.fly(20)
        flight.corrupt(at_receiver)
        begin, asked = flight.sample, len(flight.result.rejoins)
        while len(flight.result.rejoins) == asked:
            flight.fly(1)
            assert flight.sample < begin + 60
        found.append(flight.sample - begin)
        flight.fly(12)
    assert flight.result.wrong == 0
    assert statistics.median(found) <= 12


@pytest.mark.soak
@pytest.mark.parametrize("line", ["loss 1 %", "loss 5 %", "bursts"])
def test_in_ten_million_samples_nothing_wrong_is_confirmed(line: str) -> None:
    samples = int(1_000_000 * float(os.environ.get("MINUTES", "10")))
    found = count_all(line, samples)
    assert found.wrong == 0
    assert found.doubted < 0.001 * found.confirmed
    assert found.confirmed > 0.95 * samples


@pytest.mark.soak
@pytest.mark.parametrize("faults", [Faults.both(0.01), Faults.both(0.05), BURSTS, Faults.both(0, 0.01)])
def test_nothing_wrong_is_confirmed_in_long_flights_of_the_pitch_axis(faults: Faults) -> None:
    from tests.simulation.narrow_fast import fast_mirrored

    fast, plain = fast_mirrored(LAYOUT, QUEUE, 14), mirrored(LAYOUT, QUEUE, 14)
    one = other = plain.initial()
    for word in [(1,), (-1,), (1,), None] * 50:
        flown, symbols = plain.fly(one, word, announced(QUEUE))
        again, same = fast.fly(other, word, announced(QUEUE))
        assert (plain.pack(flown.state), symbols) == (fast.pack(again.state), same)
        one, other = flown.state, again.state
    samples = int(10_000 * float(os.environ.get("MINUTES", "10")))
    flight = NarrowFlight(fast_mirrored(LAYOUT, QUEUE), announced(QUEUE), 1, faults)
    result = flight.fly(samples)
    assert (result.wrong, result.doubted) == (0, 0)
    assert result.confirmed > 0.9 * samples
