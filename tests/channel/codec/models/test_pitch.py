"""The pitch model against (23) and (12), solved by an independent integrator."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from channel.codec.codec import CodecState, Vector, Word
from channel.codec.models.pitch import PitchModel, PitchParameters
from tests.channel.codec.parts import IMPULSE, PAPER, pitch_codec

SAMPLE_S = 0.1
START: Vector = (0.7, -0.4, 1.5, -0.8)
COMMAND: Vector = (3.0, -2.0)
REVERSED: Vector = (-4.0, 1.0)


def slope(_time: float, state: np.ndarray, command: Vector, held: Vector) -> list[float]:
    theta, omega, front, rear = state
    push = 0.35 * (front - rear)
    return [
        omega + held[0],
        -0.1 * omega - 0.5 * math.sin(theta + 0.115) + push + held[1],
        (command[0] - front) / 0.08,
        (command[1] - rear) / 0.08,
    ]


def solved(start: Vector, command: Vector, held: Vector, seconds: float) -> Vector:
    from scipy.integrate import solve_ivp

    solution = solve_ivp(
        slope, (0.0, seconds), start, args=(command, held), method="DOP853", rtol=1e-12, atol=1e-13
    )
    return tuple(float(value) for value in solution.y[:, -1])


def error_after_one_sample(ticks: int) -> float:
    model = PitchModel(PitchParameters(), SAMPLE_S / ticks)
    held = (0.9, -1.7)
    state = START
    for _ in range(ticks):
        state = model.tick(state, COMMAND, held)
    exact = solved(START, COMMAND, held, SAMPLE_S)
    return max(abs(ours - theirs) for ours, theirs in zip(state[:2], exact[:2], strict=True))


@pytest.mark.parametrize("word", [(1,), (-1,), None])
@pytest.mark.parametrize("zoom", [PAPER, IMPULSE], ids=["held", "impulse"])
def test_when_a_sample_is_flown_then_it_solves_the_observer_equation(zoom: object, word: Word) -> None:
    codec = pitch_codec(zoom)  # type: ignore[arg-type]
    state = CodecState(0, START, codec.initial().coder)
    commands = [COMMAND] * 4 + [REVERSED] * 6
    after = codec.step(state, word, commands)
    sign = word[0] if word else 0
    gains = [row[0] * 0.5 * sign for row in codec.coder.parameters.gains]  # type: ignore[attr-defined]
    if codec.coder.impulse:
        start, held = (START[0] + gains[0], START[1] + gains[1], *START[2:]), (0.0, 0.0)
    else:
        start, held = START, (gains[0], gains[1])
    expected = solved(solved(start, COMMAND, held, 0.04), REVERSED, held, 0.06)
    assert after.model == pytest.approx(expected, abs=2e-8)
    assert after.model[2:] == pytest.approx(expected[2:], abs=1e-11)  # the lag is exact


def test_when_the_tick_is_halved_then_the_error_falls_sixteenfold() -> None:
    errors = [error_after_one_sample(ticks) for ticks in (1, 2, 4, 8)]
    for coarse, fine in itertools.pairwise(errors):
        assert 12.0 < coarse / fine < 22.0, errors


def test_when_the_tick_is_the_papers_then_the_error_of_a_sample_is_below_a_billionth() -> None:
    assert error_after_one_sample(10) < 1e-8


def test_when_held_and_impulse_corrections_have_equal_area_then_the_states_differ_but_little() -> None:
    model = PitchModel(PitchParameters(), 0.01)
    held = impulse = START
    impulse = (START[0] + 0.02, START[1] + 0.05, *START[2:])
    for _ in range(10):
        held = model.tick(held, COMMAND, (0.2, 0.5))
        impulse = model.tick(impulse, COMMAND, (0.0, 0.0))
    assert held != impulse
    assert held == pytest.approx(impulse, abs=0.01)


def test_when_motors_have_no_lag_then_they_follow_at_once() -> None:
    model = PitchModel(PitchParameters(motor_lag_s=0.0), 0.01)
    assert model.tick(START, COMMAND, (0.0, 0.0))[2:] == COMMAND


def test_when_nothing_pushes_then_the_body_rests_at_its_equilibrium() -> None:
    model = PitchModel(PitchParameters(), 0.01)
    rest = (-0.115, 0.0, 0.0, 0.0)
    assert model.tick(rest, (0.0, 0.0), (0.0, 0.0)) == rest
    assert model.measured(rest) == (-0.115,)
