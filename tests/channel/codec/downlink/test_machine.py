"""The two-way state machine: equal copies from equal inputs, for any model and any lead."""

from __future__ import annotations

import math
import random

import pytest

from channel.codec.codec import ERASED, Codec, Vector, Word
from channel.codec.coders.zoom import ZoomCoder
from channel.codec.downlink.coded import CodedCommands, held_inputs
from channel.codec.downlink.laws import MirroredFeedback
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay, TwoWayState
from channel.codec.downlink.mirrored import MirroredLaw, SetPointRange
from channel.codec.downlink.scheme import Scheme
from channel.codec.laws import FeedbackLaw
from channel.codec.lead import fly_sample
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes

TICK_S = 0.02
LIMITS = (8.0, 8.0)
LAW = FeedbackLaw(
    (0.0, 0.0),
    ((4.0, 0.0, 3.0, 0.0), (0.0, 4.0, 0.0, 3.0)),
    ((4.0, 0.0), (0.0, 4.0)),
    ((0.5, 0.0), (0.0, 0.5)),
)


def codec() -> Codec:
    return Codec(TwoAxes(TICK_S), ZoomCoder(TWO_AXES_ZOOM), 5)


def mirrored_law(layout: Layout, queue: int = 4) -> MirroredLaw:
    ranges = (SetPointRange(0, -2.0, 2.0), SetPointRange(1, -1.0, 1.0))
    return MirroredLaw(MirroredFeedback(LAW, LIMITS, TICK_S), ranges, 2, 8, queue, layout)


def machine(scheme: Scheme, layout: Layout, lead: int, slew: float = math.inf) -> TwoWay:
    return TwoWay(codec(), scheme, layout, lead, (0.0, 0.0), LIMITS, (slew, slew))


def wanted(tick: int, live: Vector) -> Vector:
    return (0.8 if tick > 100 else 0.0, 1.0 if tick % 300 > 150 else -0.5)


def words(count: int) -> list[Word]:
    chance = random.Random(5)
    several: list[Word] = [(-1, -1), (-1, 1), (1, -1), (1, 1), ERASED]
    return [chance.choice(several) for _ in range(count)]


SCHEMES: list[tuple[Scheme, Layout]] = [
    (mirrored_law(Layout(2)), Layout(2)),
    (mirrored_law(Layout(3, 2, 4), 9), Layout(3, 2, 4)),
    (mirrored_law(Layout(1, 1, 8)), Layout(1, 1, 8)),
    (CodedCommands((0.0, 0.0), held_inputs(LIMITS)), Layout(2)),
    (CodedCommands((0.0, 0.0), held_inputs(LIMITS)), Layout(1, 1, 2)),
    (CodedCommands((0.0, 0.0), held_inputs(LIMITS), (0, 1, 1)), Layout(4, 2)),
]


@pytest.mark.parametrize("lead", [0, 3, 5, 12])
@pytest.mark.parametrize(("scheme", "layout"), SCHEMES)
def test_a_replica_that_gets_the_words_and_symbols_has_the_receivers_state(
    scheme: Scheme, layout: Layout, lead: int
) -> None:
    two_way = machine(scheme, layout, lead, 0.7)
    state = replica = two_way.initial()
    for word in words(150):
        count = two_way.commands_in(replica)
        flown, symbols = two_way.fly(state, word, wanted)
        again = two_way.step(replica, word, symbols[:count])
        assert two_way.digest(again.state) == two_way.digest(flown.state)
        assert again.commands == flown.commands
        assert len(symbols) == layout.symbols_per_sample
        assert len(flown.state.commands) == lead
        state, replica = flown.state, two_way.unpack(two_way.pack(again.state))
        assert replica == state
    assert state.hold != (0.0, 0.0)


def test_hash_symbols_are_bits_of_the_digest_before_the_word_inverted_by_an_erasure() -> None:
    two_way = machine(mirrored_law(Layout(4)), Layout(4), 5)
    state, owed = two_way.initial(), 0
    for word in words(60):
        digest = two_way.digest(state)
        flown, symbols = two_way.fly(state, word, wanted)
        odd = sum(symbol == 1 for symbol in word or ()) & 1
        bits = (owed ^ symbols[0], digest >> 1 & 1 ^ odd, digest >> 2 & 1)
        assert symbols[1:] == (bits if word is not ERASED else tuple([1 - bit for bit in bits]))
        owed = digest & 1 ^ symbols[0] ^ odd
        state = flown.state


@pytest.mark.parametrize("at", range(len(SCHEMES)))
def test_one_difference_in_the_inputs_of_a_sample_inverts_the_next_hash_symbol(at: int) -> None:
    scheme, layout = SCHEMES[at]
    two_way = machine(scheme, layout, 5)
    state, chance, seen = two_way.initial(), random.Random(at), 0

    def hashes(state: TwoWayState, word: Word, commands: tuple[int, ...]) -> tuple[int, ...]:
        return two_way.hash_symbols(state, two_way.digest(state), commands, word)

    def said(state: TwoWayState, word: Word, commands: tuple[int, ...]) -> int:
        """Return the first hash symbol from this sample on; those after it have the same inputs."""
        while len(commands) == layout.symbols_per_sample:
            state, word = two_way.step(state, word, commands).state, (1, 1)
            commands = (0,) * two_way.commands_in(state)
        return hashes(state, word, commands)[0]

    def after(state: TwoWayState, word: Word, commands: tuple[int, ...]) -> int:
        state = two_way.step(state, word, commands).state
        return said(state, (1, 1), (0,) * two_way.commands_in(state))

    for word in words(90):
        flown, symbols = two_way.fly(state, word, wanted)
        commands = symbols[: two_way.commands_in(state)]
        place = chance.randrange(len(commands)) if commands else 0
        other = tuple([bit ^ (at == place) for at, bit in enumerate(commands)])
        if commands:
            assert said(state, word, commands) != said(state, word, other)
            assert after(state, word, commands) != after(state, word, other)
        if word is not ERASED:
            assert said(state, word, commands) != said(state, ERASED, commands)
            if len(commands) < layout.symbols_per_sample:
                changed = (-word[0], word[1])
                assert after(state, word, commands) != after(state, changed, commands)
                if len(commands) + 1 < layout.symbols_per_sample:
                    assert symbols[len(commands) + 1] != hashes(state, changed, commands)[1]
                seen += 1
        state = flown.state
    assert seen > 20


def test_the_codec_flies_as_it_does_with_the_same_commands_on_any_downlink() -> None:
    two_way = machine(mirrored_law(Layout(2)), Layout(2), 7)
    state = two_way.initial()
    for word in words(80):
        flown, _ = two_way.fly(state, word, wanted)
        first, decided = state.sample * 5 + 7, flown.commands

        def known(
            tick: int, live: Vector, first: int = first, decided: list[Vector] = decided
        ) -> Vector:
            return decided[tick - first]

        same = fly_sample(two_way.codec, state.codec, word, state.commands, known)
        assert same.state == flown.state.codec
        assert same.live == flown.live
        state = flown.state


def test_commands_keep_to_the_limits_and_the_slew_limits() -> None:
    two_way = machine(CodedCommands((0.0, 0.0), held_inputs(LIMITS)), Layout(2), 3, 0.1)
    state, before = two_way.initial(), (0.0, 0.0)
    largest = 0.0
    for word in words(100):
        flown, _ = two_way.fly(state, word, lambda tick, live: (99.0, -99.0))
        for command in flown.commands:
            for one, other in zip(command, before, strict=True):
                assert abs(one - other) <= 0.1 + 1e-12
                largest = max(largest, abs(one))
            before = command
        state = flown.state
    assert largest == 8.0


def test_states_of_another_downlink_are_refused() -> None:
    two_way = machine(mirrored_law(Layout(2)), Layout(2), 5)
    data = two_way.pack(two_way.initial())
    with pytest.raises(ValueError, match="both ends need the same downlink"):
        machine(mirrored_law(Layout(2)), Layout(2), 6).unpack(data)
    start = two_way.initial()
    impossible = two_way.pack(start._replace(down=(*start.down[:4], 0.5, *start.down[5:])))
    with pytest.raises(ValueError, match="none that this coder"):
        two_way.unpack(impossible)
    with pytest.raises(ValueError, match="negative index"):
        two_way.unpack(b"\xff" * len(data))


def test_limits_for_another_plant_are_refused() -> None:
    with pytest.raises(ValueError, match="the plant has 2 input"):
        TwoWay(codec(), mirrored_law(Layout(2)), Layout(2), 0, (0.0,), LIMITS, LIMITS)
