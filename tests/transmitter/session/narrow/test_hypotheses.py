"""The list of hypotheses: how it branches, what it applies, what it drops, when it gives up."""

from __future__ import annotations

import math
from collections.abc import Sequence

import pytest

from channel.codec.codec import ERASED, Alphabet, Codec, Vector, Word
from channel.codec.downlink.coded import CodedCommands, held_inputs
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay, TwoWaySample, TwoWayState
from channel.protocol.frames import Why
from reproduction.bothways.lines import Faults
from tenbaud.build.codec import build_codec
from tenbaud.config.load import load_config
from tests.simulation.narrow import NarrowFlight, mirrored, square
from transmitter.session.narrow.hypotheses import (
    AHEAD_MAX,
    Confirmed,
    Hypotheses,
    Settings,
    longest_list,
)
from transmitter.session.narrow.paths import Node, Paths
from transmitter.session.narrow.priors import Priors


def wanted(tick: int, live: Vector) -> Vector:
    return (square(tick),)


def flown(
    machine: TwoWay, words: list[Word], taken: list[Word], settings: Settings | None = None
) -> tuple[Hypotheses, list[Confirmed]]:
    """Return the list after these words were sent and those consumed, all down symbols having come."""
    hypotheses, state, done = Hypotheses(machine, settings), machine.initial(), []
    for sample, (sent, word) in enumerate(zip(words, taken, strict=True)):
        hypotheses.sent(sent)
        flown, symbols = machine.fly(state, word, wanted)
        state = flown.state
        done += hypotheses.heard(sample, symbols)
    return hypotheses, done


def test_one_hash_bit_shows_an_erasure_at_once() -> None:
    machine = mirrored(Layout(2), 12)
    words: list[Word] = [(1,), (-1,), (1,), (1,)]
    hypotheses, _ = flown(machine, words, [(1,), (-1,), (1,), ERASED])
    state = machine.initial()
    for word in ((1,), (-1,), (1,), ERASED):
        state = machine.fly(state, word, wanted)[0].state
    weight, best = max(hypotheses.members())
    assert best == state
    assert weight > 0.5
    assert hypotheses.state_before_next() == state.codec


def test_a_flip_of_the_word_is_found_from_later_hash_bits() -> None:
    machine = mirrored(Layout(2), 12)
    words: list[Word] = [(1,) if place % 3 else (-1,) for place in range(40)]
    taken = list(words)
    taken[4] = (1,) if words[4] == (-1,) else (-1,)
    hypotheses, done = flown(machine, words, taken)
    assert [one.word for one in done] == taken[: len(done)]
    assert len(done) > 10
    assert hypotheses.rejoin is None


def test_a_sample_is_confirmed_only_below_the_limit_and_with_what_the_receiver_flew() -> None:
    machine = mirrored(Layout(2), 12)
    words: list[Word] = [(1,)] * 12
    _, soon = flown(machine, words, words, Settings(confirmed_below=2.0**-8, unexplained=2.0**-20))
    _, later = flown(machine, words, words, Settings(confirmed_below=2.0**-24, unexplained=2.0**-20))
    assert len(soon) > len(later)
    state = machine.initial()
    for one in soon:
        assert (one.before, one.digest) == (state, machine.digest(state))
        state = machine.fly(state, one.word, wanted)[0].state
        assert one.flown.state == state


def test_what_is_applied_is_the_weighted_mean_of_what_the_hypotheses_command() -> None:
    machine = mirrored(Layout(2), 12)
    hypotheses = Hypotheses(machine)
    hypotheses.sent((1,))
    hypotheses.heard(0, None)
    assert [node.is_flown for _, node in hypotheses._members] == [False] * 6
    assert len(hypotheses.members()) == 6
    mean = [0.0, 0.0]
    for weight, node in hypotheses._members:
        for place in (0, 1):
            mean[place] += weight * node.commands[3][place]
    commands = {node.commands[3] for _, node in hypotheses._members}
    assert len(commands) == 3
    assert hypotheses.command(3) == pytest.approx(tuple(mean), abs=0.005)
    assert hypotheses.command(3) not in commands
    assert hypotheses.command(10) == pytest.approx(hypotheses.command(9))


def test_commands_of_words_on_their_way_are_predicted_and_replaced_by_what_comes() -> None:
    machine = mirrored(Layout(2), 12)
    hypotheses, state = Hypotheses(machine), machine.initial()
    hypotheses.sent((1,))
    flown, symbols = machine.fly(state, (1,), wanted)
    assert [hypotheses.command(tick) for tick in range(10)] == flown.commands
    assert hypotheses.state_before_next() == flown.state.codec
    hypotheses.heard(0, symbols)
    assert hypotheses.command(9) == pytest.approx(flown.commands[9], abs=0.02)


class ThreeByTwo:
    """Two symbols of three a word, each a step of the angle."""

    alphabet = Alphabet((-1, 0, 1), 2)
    impulse = True
    uses_rates = False

    def initial(self) -> Vector:
        return (0.1,)

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        return (1, 1) if measurement[0] > predicted[0] else (-1, -1)

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        first, second = word or (0, 0)
        return (coder[0] * (first + 0.3 * second), 0.0), coder

    def ranges(self, coder: Vector) -> Vector:
        return coder


def test_where_hypotheses_ask_for_different_words_the_likely_and_large_error_decides() -> None:
    machine = mirrored(Layout(2), 12)
    hypotheses = Hypotheses(machine)
    hypotheses.sent((1,))
    hypotheses.heard(0, (0, None))
    angles = sorted(state.codec.model[0] for weight, state in hypotheses.members() if weight > 0.004)
    assert len(angles) == 3
    likeliest = hypotheses.state_before_next().model[0]
    assert likeliest == angles[-1]
    assert hypotheses.encode((angles[-1] + 1e-3,)) == (1,)
    assert hypotheses.encode((angles[-1] - 5e-3,)) == (-1,)
    assert hypotheses.encode((angles[0] - 1e-3,)) == (-1,)
    near = angles[-1] - 1e-6
    assert machine.codec.encode(hypotheses.state_before_next(), (near,)) == (-1,)
    assert hypotheses.encode((near,)) == (1,)


class Forgetful(ThreeByTwo):
    """Remembers its last word alone."""

    alphabet = Alphabet((-1, 1), 1)

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        return (0.0, 0.0), (0.0 if word is None else float(word[0]),)


def test_histories_that_come_to_one_state_are_confirmed_together_and_say_so() -> None:
    codec = Codec(mirrored(Layout(2), 12).codec.model, Forgetful(), 10)
    scheme = CodedCommands((0.0, 0.0), held_inputs((5.0, 5.0)))
    machine = TwoWay(codec, scheme, Layout(2), 0, (0.0, 0.0), (5.0, 5.0), (math.inf, math.inf))
    hypotheses, state, found = Hypotheses(machine), machine.initial(), {}
    for sample in range(60):
        hypotheses.sent((1,))
        flown, symbols = machine.fly(
            state, ERASED if sample == 20 else (1,), lambda tick, live: (1.0, 1.0)
        )
        state = flown.state
        # Nothing that depends on the word of sample 20 arrives.
        heard = (symbols[0], None) if sample in (20, 21) else symbols
        found.update({one.sample: one for one in hypotheses.heard(sample, heard)})
    assert len(found) > 40
    others = [one.doubt for sample, one in found.items() if sample > 10 and not 18 < sample < 24]
    assert 5.0 * max(others) < found[20].doubt < 0.1
    assert found[20].word == (1,)
    assert found[22].before == found[21].flown.state


def test_a_word_of_several_symbols_branches_into_one_changed_symbol_and_the_rest() -> None:
    base = mirrored(Layout(3), 12)
    codec = Codec(base.codec.model, ThreeByTwo(), 10)
    machine = TwoWay(codec, base.scheme, Layout(3), 0, (0.0, 0.0), (5.0, 5.0), (math.inf, math.inf))
    hypotheses = Hypotheses(machine)
    hypotheses.sent((1, 1))
    hypotheses.heard(0, None)
    words = {node.word for _, node in hypotheses._members}
    assert words == {(1, 1), ERASED, (0, 1), (-1, 1), (1, 0), (1, -1)}
    assert hypotheses.rest == pytest.approx(2.0 * hypotheses.priors.flipped.value**2 / 4, rel=0.1)
    hypotheses, state = Hypotheses(machine), machine.initial()
    for sample in range(40):
        word: Word = (1, 1) if sample % 2 else (-1, -1)
        hypotheses.sent(word)
        taken: Word = (1, 0) if sample == 9 else ERASED if sample == 15 else word
        flown, symbols = machine.fly(state, taken, wanted)
        state = flown.state
        for done in hypotheses.heard(sample, symbols):
            if done.sample in (9, 15):
                assert done.word == ((1, 0) if done.sample == 9 else ERASED)
    assert hypotheses.next_confirmed > 20


def test_the_list_keeps_to_its_cap_and_books_what_it_drops() -> None:
    machine = mirrored(Layout(2), 12)
    hypotheses = Hypotheses(machine, Settings(list_max=8))
    for sample in range(6):
        hypotheses.sent((1,))
        hypotheses.heard(sample, None)
        assert hypotheses.size <= 8
        assert sum(weight for weight, _ in hypotheses.members()) == pytest.approx(1.0)
    assert hypotheses.rest > 1e-3


class Counting(TwoWay):
    """Counts the samples it flies."""

    flown = 0

    def step(
        self,
        state: TwoWayState,
        word: Word,
        symbols: Sequence[int | None],
        digest: int | None = None,
    ) -> TwoWaySample:
        self.flown += 1
        return super().step(state, word, symbols, digest)


def test_a_large_model_has_a_short_list_and_no_sample_costs_more() -> None:
    config = load_config("helicopter-20baud")
    codec, small = build_codec(config), mirrored(Layout(2), 12)
    inputs = (0.0, 0.0)
    scheme = CodedCommands(inputs, held_inputs((5.0, 5.0)))
    large = Counting(codec, scheme, Layout(2), 0, inputs, (5.0, 5.0), (math.inf, math.inf))
    assert longest_list(large) == 16
    assert 64 < longest_list(small) < 256
    hypotheses, most = Hypotheses(large), 0
    for sample in range(12):
        large.flown = 0
        hypotheses.sent((1,))
        hypotheses.command(5 * sample)
        hypotheses.heard(sample, None)
        hypotheses.state_before_next()
        most = max(most, large.flown)
    assert hypotheses.size == 16
    assert 16 < most <= 2 * 16 + AHEAD_MAX


def test_agreeing_hash_bits_halve_the_rest_and_silence_does_not() -> None:
    machine = mirrored(Layout(3), 12)
    words: list[Word] = [(1,)] * 3
    hypotheses, _ = flown(machine, words, words)
    before = hypotheses.rest
    hypotheses.sent((1,))
    hypotheses.heard(3, None)
    assert before < hypotheses.rest < 1e-3
    root = Node(None, -1, (), (), machine.initial())
    paths = Paths(root)
    child = root.child((1,), (0,))
    paths.follow(child)
    paths.book(0.25, None)
    paths.scale_rest(0.25)
    assert paths.total_rest == 0.0625


def test_weight_that_left_the_old_path_later_leaves_a_new_path_where_the_paths_part() -> None:
    machine = mirrored(Layout(2), 12)
    paths = Paths(Node(None, -1, (), (), machine.initial()))
    node = paths.root
    for _ in range(4):
        after = node.child((1,), (0,))
        assert after.fly(machine)
        paths.follow(after)
        paths.book(1.0, after.sample)
        node = after
    other = paths.path[0].child((-1,), (0,))
    further = other.child((1,), (0,))
    assert paths.leaves_at(further) == 1
    paths.follow(further)
    assert paths.path[1:] == [other, further]
    assert paths.rest == [1.0, 3.0, 0.0]
    assert paths.leaves_at(node) == 1


def test_a_rejoin_is_asked_for_when_nothing_explains_what_comes() -> None:
    flight = NarrowFlight(mirrored(Layout(2), 12), wanted, 1)
    flight.fly(30)
    flight.corrupt(at_receiver=True)
    while flight.hypotheses.rejoin is None:
        flight.fly(1)
    asked = flight.hypotheses.rejoin
    assert asked.why is Why.REST
    assert asked.details.value is not None
    assert asked.details.value > 1.0
    assert flight.hypotheses.next_heard <= 60
    flight.fly(40)
    assert flight.hypotheses.rejoin is None
    assert flight.hypotheses.confirmed_state.sample > 50


def test_a_rejoin_is_asked_for_when_nothing_comes_down_any_more() -> None:
    faults = Faults(loss_down=1.0)
    flight = NarrowFlight(
        mirrored(Layout(2), 12), wanted, 1, faults, settings=Settings(list_max=4, lag_samples_max=3)
    )
    flight.fly(6)
    assert flight.result.rejoins == [3]


def test_symbols_of_another_sample_or_number_are_refused() -> None:
    hypotheses = Hypotheses(mirrored(Layout(2), 12))
    with pytest.raises(ValueError, match="those of sample 0 are next, 2 of them"):
        hypotheses.heard(1, (0, 1))
    with pytest.raises(ValueError, match="those of sample 0 are next, 2 of them"):
        hypotheses.heard(0, (0, 1, 1))


def test_priors_follow_the_line_and_never_reach_zero() -> None:
    priors = Priors()
    for case in range(3000):
        word = ERASED if case % 10 == 0 else (1,)
        priors.learn((1,), word, (1,))
        priors.learn_symbols((0, 1), (0, None))
        priors.news.count(False)
    assert priors.erased(False) == pytest.approx(0.1, abs=0.02)
    assert priors.erased(True) == pytest.approx(0.4)
    assert 0.0 < priors.down_flipped.value < 2e-4
    assert 0.0 < priors.flipped.value < 2e-4
    assert 0.0 < priors.news.value < 3e-3
    for _ in range(300):
        priors.learn((1,), ERASED, ERASED)
    assert priors.erased(True) > 0.9
