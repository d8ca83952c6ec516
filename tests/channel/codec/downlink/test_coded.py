"""Coded commands: what follows from a bit, and whose turn it is."""

from __future__ import annotations

import pytest

from channel.codec.codec import Vector
from channel.codec.downlink.coded import CodedCommands, CodedDirection, held_inputs


def followed(scheme: CodedCommands, wanted: Vector, symbols: int, live: Vector = ()) -> Vector:
    down = scheme.initial()
    for _ in range(symbols):
        down = scheme.take(down, scheme.encode(down, lambda ago: wanted, live))
        assert scheme.is_state(down)
    return scheme.command(down, (), live)[0]


def test_held_commands_follow_what_any_controller_wants() -> None:
    scheme = CodedCommands((0.0, 0.0), held_inputs((5.0, 5.0)))
    assert followed(scheme, (4.0, -2.0), 60) == (
        pytest.approx(4.0, abs=1.5),
        pytest.approx(-2.0, abs=1.5),
    )


def test_turns_may_favour_an_input() -> None:
    scheme = CodedCommands((0.0, 0.0), held_inputs((5.0, 5.0)), (0, 0, 1))
    down = scheme.initial()
    moved = []
    for _ in range(6):
        before = scheme.command(down, (), ())[0]
        down = scheme.take(down, 1)
        after = scheme.command(down, (), ())[0]
        moved.append([place for place in (0, 1) if before[place] != after[place]])
    assert moved == [[0], [0], [1], [0], [0], [1]]


def test_feedback_on_the_shared_estimate_needs_no_symbol() -> None:
    scheme = CodedCommands((1.0, 1.0), (CodedDirection((0.5, -0.5), (1.0, -1.0), (2.0, 0.0)),))
    down = scheme.initial()
    assert scheme.command(down, (), (0.5, 9.0))[0] == (0.5, 1.5)
    wanted = (1.0, 1.0)
    assert scheme.encode(down, lambda ago: wanted, (0.5, 9.0)) == 1
    assert scheme.encode(down, lambda ago: wanted, (-0.5, 9.0)) == 0


def test_a_bit_that_is_not_known_yet_changes_the_turn_alone() -> None:
    scheme = CodedCommands((0.0, 0.0), held_inputs((5.0, 5.0)))
    down = scheme.guess(scheme.initial())
    assert down[0] == 1.0
    assert down[1:] == scheme.initial()[1:]


@pytest.mark.parametrize(
    ("directions", "turns"),
    [
        ((), ()),
        (held_inputs((5.0, 5.0)), (0,)),
        (held_inputs((5.0, 5.0)), (0, 1, 2)),
        ((CodedDirection((1.0,), (1.0,)),), ()),
        ((CodedDirection((1.0, 0.0), (1.0, 0.0), shrink=1.0),), ()),
        ((CodedDirection((1.0, 0.0), (1.0, 0.0), minimum_range=2.0, initial_range=1.0),), ()),
    ],
)
def test_directions_that_do_not_fit_are_refused(
    directions: tuple[CodedDirection, ...], turns: tuple[int, ...]
) -> None:
    with pytest.raises(ValueError, match="direction"):
        CodedCommands((0.0, 0.0), directions, turns)
