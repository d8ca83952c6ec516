"""The confirmed copy and the provisional one."""

from __future__ import annotations

import random

import pytest

from channel.codec.codec import ERASED, CodecState, Vector, Word
from tests.channel.codec.parts import PAPER, pitch_codec, terms
from transmitter.session.copies import Copies

CODEC = pitch_codec(PAPER, ticks_per_sample=5)
SEED = 20240619
SAMPLES = 60


def copies(lead_ticks: int = 0) -> Copies:
    return Copies(CODEC, terms(ticks_per_sample=5, rate_baud=20.0, lead_ticks=lead_ticks))


def words(seed: int = SEED) -> list[Word]:
    chooser = random.Random(seed)
    return [(chooser.choice((-1, 1)),) for _ in range(SAMPLES)]


def commands(seed: int = SEED) -> list[list[Vector]]:
    """Return the commands of each sample's echo."""
    chooser = random.Random(seed)
    return [
        [(chooser.randrange(-5000, 5001) / 1000.0, 0.5) for _ in range(5)] for _ in range(SAMPLES + 20)
    ]


def states_of(all_words: list[Word], echoed: list[list[Vector]], lead_ticks: int) -> list[CodecState]:
    """Return the codec states before each sample, computed at once from all inputs."""
    flat = [(0.0, 0.0)] * lead_ticks + [command for sample in echoed for command in sample]
    states = [CODEC.initial()]
    for sample, word in enumerate(all_words):
        states.append(CODEC.step(states[-1], word, flat[5 * sample : 5 * sample + 5]))
    return states


@pytest.mark.parametrize("lag", range(1, 11))
def test_when_echoes_lag_and_commands_are_known_then_the_next_symbol_rests_on_the_true_state(
    lag: int,
) -> None:
    lead = 5 * lag  # so that the commands of every unconfirmed sample are known
    pair, sent, echoed = copies(lead), words(), commands()
    truth = states_of(sent, echoed, lead)
    for sample in range(SAMPLES):
        assert pair.next_sample == sample
        assert pair.state_before_next() == truth[sample]
        pair.sent(sent[sample])
        if pair.lag_samples > lag:
            pytest.fail("more samples wait than were meant to")
        if sample >= lag - 1:
            done = pair.confirm(sent[sample - lag + 1], echoed[sample - lag + 1], 0)
            assert done.lag_samples == lag
            assert done.flown.state == pair.confirmed == truth[done.sample + 1]
            assert done.digest == CODEC.digest(truth[done.sample + 1])
    assert pair.lag_samples == lag - 1


@pytest.mark.parametrize("lag", range(1, 11))
def test_when_commands_stay_the_same_then_unknown_ones_are_guessed_right(lag: int) -> None:
    pair, sent = copies(0), words()
    echoed: list[list[Vector]] = [[(0.0, 0.0)] * 5] * SAMPLES
    truth = states_of(sent, echoed, 0)
    for sample in range(SAMPLES):
        assert pair.state_before_next() == truth[sample]
        pair.sent(sent[sample])
        if sample >= lag:
            pair.confirm(sent[sample - lag], echoed[sample - lag], 0)


@pytest.mark.parametrize("lag", [1, 3, 10])
def test_when_a_symbol_was_lost_then_its_echo_replaces_the_wrong_guess(lag: int) -> None:
    lead = 5 * (lag + 1)
    pair, sent, echoed = copies(lead), words(), commands()
    received = [ERASED if sample % 7 == 3 else word for sample, word in enumerate(sent)]
    wrong = 0
    for sample in range(SAMPLES):
        # What is known at this moment: echoes up to sample - lag - 1, words sent beyond.
        known = received[: max(sample - lag, 0)] + sent[max(sample - lag, 0) : sample]
        assert pair.state_before_next() == states_of(known, echoed, lead)[sample]
        wrong += known != received[:sample]
        pair.sent(sent[sample])
        if sample >= lag:
            done = pair.confirm(received[sample - lag], echoed[sample - lag], 0)
            assert done.word_sent == sent[sample - lag]
            assert done.word == received[sample - lag]
    assert pair.confirmed == states_of(received, echoed, lead)[SAMPLES - lag]
    assert wrong > 0


def test_when_unknown_commands_were_guessed_wrong_then_the_echo_replaces_them() -> None:
    pair, sent, echoed = copies(0), words(), commands()
    truth = states_of(sent, echoed, 0)
    for sample in range(SAMPLES):
        pair.sent(sent[sample])
        guess = pair.state_before_next()
        assert guess.sample == sample + 1
        assert guess != truth[sample + 1]
        pair.confirm(sent[sample], echoed[sample], 0)
        assert pair.state_before_next() == truth[sample + 1] == pair.confirmed


@pytest.mark.parametrize("lead", [0, 3, 5, 8, 20])
@pytest.mark.parametrize("lag", [1, 2, 3, 5])
def test_when_some_commands_are_known_then_only_the_others_are_guessed(lead: int, lag: int) -> None:
    pair, sent = copies(lead), words()
    # Each command lasts for some samples, so that guesses are right now and then.
    echoed = [[((sample // 3) % 5 / 2.0, 0.5)] * 5 for sample in range(SAMPLES)]
    known = [(0.0, 0.0)] * lead
    last: Vector = (0.0, 0.0)
    for sample in range(SAMPLES):
        assumed = known + [last] * (5 * sample + 5)
        state = CODEC.initial()
        for index in range(sample):
            state = CODEC.step(state, sent[index], assumed[5 * index : 5 * index + 5])
        assert pair.state_before_next() == state
        pair.sent(sent[sample])
        if sample >= lag:
            pair.confirm(sent[sample - lag], echoed[sample - lag], 0)
            known += echoed[sample - lag]
            last = known[-1]


def test_when_the_confirmed_copy_moves_then_what_was_sent_has_no_part_in_it() -> None:
    honest, wrong = copies(10), copies(10)
    sent, echoed = words(), commands()
    for sample in range(SAMPLES):
        honest.sent(sent[sample])
        wrong.sent((1,))
        wrong.state_before_next()
        one = honest.confirm(sent[sample], echoed[sample], 1)
        other = wrong.confirm(sent[sample], echoed[sample], 1)
        assert one.flown == other.flown
        assert one.digest == other.digest


def test_when_an_erasure_is_heard_of_before_its_sample_was_sent_then_the_sample_is_over() -> None:
    pair = copies(10)
    done = pair.confirm(ERASED, commands()[0], 0)
    assert done.word_sent is ERASED
    assert pair.next_sample == 1
    assert pair.lag_samples == 0


@pytest.mark.parametrize("lead", [0, 3, 5, 13])
def test_when_samples_are_confirmed_then_live_states_belong_to_their_own_ticks(lead: int) -> None:
    pair, sent, echoed = copies(lead), words(), commands()
    predicted: list[Vector | None] = [None] * lead
    given: list[Vector | None] = []
    for sample in range(SAMPLES):
        pair.sent(sent[sample])
        done = pair.confirm(sent[sample], echoed[sample], 0)
        predicted += done.flown.live
        given += done.live
        assert len(done.live) == 5
        if lead == 0:
            assert done.live == done.flown.coded
    assert given == predicted[: len(given)]
