"""Samples of a walk that another one takes over, and those that it computes."""

from __future__ import annotations

import pytest

from channel.codec.codec import CodecState, Vector, Word
from channel.codec.lead import Decide, FlownSample, fly_sample
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.replay import walk
from tenbaud.replay.walk import Walk

AGREEMENT = agree(load_config("tuned-10baud", None, {"timing": {"lead_ticks": 5}}), "virtual")
CODEC = AGREEMENT.codec
START = CODEC.initial()
WORD = (CODEC.coder.alphabet.symbols[0],)
OTHER = (CODEC.coder.alphabet.symbols[1],)
KNOWN = [(0.0, 0.5)] * AGREEMENT.terms.lead_ticks
ZERO, MINUS_ZERO = [(0.0, -0.0)], [(-0.0, 0.0)]


def decided(tick: int, state: Vector) -> Vector:
    return (0.01 * tick, state[0])


def another(tick: int, state: Vector) -> Vector:
    return decided(tick, state) if tick < first_tick() + 3 else (1.0, 0.0)


def first_tick() -> int:
    return START.sample * CODEC.ticks_per_sample + len(KNOWN)


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch) -> list[Word]:
    """Collect the words of the samples that are computed."""
    words: list[Word] = []

    def fly(codec: object, state: CodecState, word: Word, *rest: object) -> FlownSample:
        words.append(word)
        return fly_sample(codec, state, word, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(walk, "fly_sample", fly)
    return words


def noting(asked: list[int], decide: Decide) -> Decide:
    """Return what decides in this way, and notes for which ticks it was asked."""

    def ask(tick: int, live: Vector) -> Vector:
        asked.append(tick)
        return decide(tick, live)

    return ask


def test_what_is_asked_again_is_not_computed_again(computed: list[Word]) -> None:
    first = Walk()
    flown = first.first(CODEC, START, WORD, KNOWN, decided)
    asked: list[int] = []
    for _ in range(2):
        asked.clear()
        # Equal inputs, not the same objects.
        state = CODEC.unpack(CODEC.pack(START))
        assert first.again()(CODEC, state, WORD, list(KNOWN), noting(asked, decided)) is flown
        assert asked == [first_tick() + at for at in range(CODEC.ticks_per_sample)]
    assert computed == [WORD]


@pytest.mark.parametrize(
    ("state", "word", "known", "decide"),
    [
        (START, OTHER, KNOWN, decided),
        (START, None, KNOWN, decided),
        (START._replace(sample=1), WORD, KNOWN, decided),
        (START._replace(model=(1e-9, *START.model[1:])), WORD, KNOWN, decided),
        (START, WORD, [*KNOWN[:-1], (0.0, 0.25)], decided),
        (START, WORD, KNOWN[:-1], decided),
        (START, WORD, KNOWN, another),
    ],
)
def test_what_is_asked_in_another_way_is_computed(
    state: CodecState, word: Word, known: list[Vector], decide: Decide, computed: list[Word]
) -> None:
    first = Walk()
    flown = first.first(CODEC, START, WORD, KNOWN, decided)
    asked: list[int] = []
    other = first.again()(CODEC, state, word, known, noting(asked, decide))
    assert other == fly_sample(CODEC, state, word, known, decide) != flown
    assert len(asked) == len(set(asked)) == CODEC.ticks_per_sample, "asked twice for a tick"
    assert len(computed) == 2


def test_a_zero_with_another_sign_is_another_input(computed: list[Word]) -> None:
    first = Walk()
    first.first(CODEC, START, WORD, ZERO * len(KNOWN), decided)
    first.again()(CODEC, START, WORD, MINUS_ZERO * len(KNOWN), decided)
    assert len(computed) == 2


def test_a_walk_that_goes_on_longer_computes_the_rest(computed: list[Word]) -> None:
    first = Walk()
    first.first(CODEC, START, WORD, KNOWN, decided)
    fly = first.again()
    after = fly(CODEC, START, WORD, KNOWN, decided).state
    assert fly(CODEC, after, OTHER, KNOWN, decided) == fly_sample(CODEC, after, OTHER, KNOWN, decided)
    assert computed == [WORD, OTHER]
