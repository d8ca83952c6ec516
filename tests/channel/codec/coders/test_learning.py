"""The coder that learns the plant: its arithmetic against matrices, what it finds, its limits."""

from __future__ import annotations

import math
import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from channel.codec.codec import ERASED, Codec, CodecState
from channel.codec.coders.learning import LearningCoder
from channel.codec.coders.learning_steps import ask, columns_of, pairs_of, take, wait
from channel.codec.models.learned import LearnedLinearModel
from channel.codec.models.linear import LinearModel
from plant_sim.zero_order_hold import discretised
from tenbaud.design.described import plant_section
from tenbaud.design.direction import design_learning
from tenbaud.design.plant import LinearPlant, linear_plant

TICK_S, PERIOD_S = 0.01, 0.1
PITCH = linear_plant([[0.0, 1.0], [-0.5, -0.1]], [[0.0], [1.0]], [[1.0, 0.0]], densities=2e-3)


def codec_of(plant: LinearPlant) -> Codec:
    F, E = discretised(plant.A, plant.B, TICK_S)
    known = LinearModel(F.tolist(), E.tolist(), plant.C.tolist(), TICK_S)
    model = LearnedLinearModel(known, plant.A.tolist(), plant.B.tolist(), ((), ()), 0.2)
    parameters = design_learning(plant, 1.0 / PERIOD_S, PERIOD_S)
    parameters = replace(parameters, spreads=model.spreads, drift=3e-4)
    return Codec(model, LearningCoder(parameters, model.term_rows, known.state_size), 10)


def two_axes() -> Codec:
    """Return a codec of two columns of disturbance, far from where it began."""
    section = plant_section("aero")
    return codec_of(linear_plant(section.A, section.B, section.C, section.G or None, section.densities))


def full(part: list[float], size: int) -> Any:
    lower = np.zeros((size, size))
    lower[np.tril_indices(size)] = part
    return lower + np.tril(lower, -1).T


def parts_of(coder: Any, constants: Any) -> list[Any]:
    size = len(constants.largest) + len(constants.drifts)
    pairs = pairs_of(size)
    return [full(coder[at * pairs : (at + 1) * pairs], size) for at in range(columns_of(constants) + 1)]


def moved_on(codec: Codec, samples: int = 40) -> CodecState:
    chooser = random.Random(5)
    state = codec.initial()
    for _ in range(samples):
        commands = [tuple(chooser.uniform(-1, 1) for _ in range(codec.model.input_size))] * 10
        state = codec.step(state, (chooser.choice((-1, 1)),), commands)
    return state


def test_when_a_sample_passes_then_every_part_moves_as_its_matrices_say() -> None:
    codec = two_axes()
    coder: Any = codec.coder
    k, state = coder.constants, moved_on(codec)
    n, learned = len(k.largest), len(k.drifts)
    values = list(state.model[k.values_at :])
    before = parts_of(state.coder, k)
    own = list(state.coder)
    wait(k, own, values)
    reach = np.array(k.reach).reshape(n, -1)
    Y = np.column_stack([reach[:, k.rows[i]] * values[i] for i in range(learned)])
    whole = np.block(
        [
            [np.array(k.transition).reshape(n, n), Y],
            [np.zeros((learned, n)), np.eye(learned)],
        ]
    )
    noises = np.array(k.noises).reshape(-1, n, n)
    assert np.abs(Y).max() > 1e-3
    for part, (old, new) in enumerate(zip(before, parts_of(own, k), strict=True)):
        wanted = whole @ old @ whole.T
        if part < len(noises):
            first = (len(noises) + 1) * pairs_of(n + learned) + part * (n + 2)
            wanted[:n, :n] += state.coder[first + n + 1] ** 2 * noises[part]
        else:
            wanted[n:, n:] += np.diag(k.drifts)
        assert np.allclose(new, wanted, rtol=1e-9, atol=1e-15)


def test_when_a_sign_arrives_then_the_parts_lose_alpha_along_it_and_theta_moves() -> None:
    codec = two_axes()
    coder: Any = codec.coder
    # Strengths as they are, so that the rest is linear algebra.
    k = coder.constants._replace(k=0.0, eta=0.0, gamma=0.0)
    state = moved_on(codec)
    n, size = len(k.largest), len(k.largest) + len(k.drifts)
    own, c, v = list(state.coder), [0.0] * n, [0.0] * n
    assert ask(k, own, c, v)
    before = parts_of(own, k)
    correction = [0.0] * coder.correction_size
    take(k, own, c, 1, correction)
    total = np.sum(before, axis=0)
    along = total[:, :n] @ np.array(c)
    assert along[:n] == pytest.approx(v)
    assert float(along[:n] @ c) == pytest.approx(1.0)
    left = np.eye(size)
    left[:, :n] -= k.share * np.outer(along, c)
    for old, new in zip(before, parts_of(own, k), strict=True):
        assert np.allclose(new, left @ old @ left.T, rtol=1e-9, atol=1e-15)
    assert np.allclose(
        np.sum(parts_of(own, k), axis=0), total - coder.parameters.removed * np.outer(along, along)
    )
    moved = np.array([*correction[:n], *correction[k.learned_at :]])
    assert np.abs(moved[n:]).max() > 0.0
    assert np.allclose(moved * np.linalg.norm(along), along * np.linalg.norm(moved))


def fly(codec: Codec, A: Any, B: Any, force: float, samples: int) -> tuple[float, CodecState]:
    """Fly another plant under a square wave; return the angle's rms error, and the last state."""
    F, E = discretised(A, np.hstack([B, [[0.0], [1.0]]]), TICK_S)
    chooser = random.Random(3)
    x, state, squares = np.zeros(2), codec.initial(), 0.0
    for sample in range(samples):
        u = 0.3 if sample // 25 % 2 == 0 else -0.3
        padded = (*x, *[0.0] * (codec.model.correction_size - 2))
        state = codec.step(state, codec.encode(state, padded), [(u,)] * 10)
        for _ in range(10):
            push = force + math.sqrt(2e-3 / TICK_S) * chooser.gauss(0.0, 1.0)
            x = F @ x + E @ np.array([u, push])
        if sample >= samples // 2:
            squares += float(x[0] - state.model[0]) ** 2
    return math.sqrt(squares / (samples - samples // 2)), state


def test_when_the_plant_is_another_then_its_terms_are_found_and_their_deviations_hold() -> None:
    codec = codec_of(PITCH)
    coder: Any = codec.coder
    exact, _ = fly(codec, PITCH.A, PITCH.B, 0.0, 1500)
    names = [one.name for one in codec.model.signals.states[2:6]]  # type: ignore[attr-defined]
    assert names == [f"state_2_by_{what}_error" for what in ("state_1", "state_2", "input_1", "force")]
    rms, state = fly(codec, np.array([[0.0, 1.0], [-0.55, -0.1]]), 1.2 * PITCH.B, 0.04, 1500)
    assert rms < 1.15 * exact
    found = state.model[2:6]
    sds = coder.learned_deviations(state.coder)
    for name, value, wanted, sd, spread in zip(
        names, found, (0.1, 0.0, 0.2, 0.04), sds, coder.parameters.spreads, strict=True
    ):
        assert abs(value - wanted) < 3.5 * sd, name
        assert 0.0 < sd < spread, name
    assert found[2] == pytest.approx(0.2, abs=0.06)
    assert found[3] == pytest.approx(0.04, abs=0.02)


def test_when_nothing_arrives_then_what_is_learned_stays_and_doubt_stays_bounded() -> None:
    codec = codec_of(PITCH)
    state = moved_on(codec)
    learned = state.model[2:6]
    for _ in range(2000):
        state = codec.step(state, ERASED, [(0.1,)] * 10)
    assert state.model[2:6] == learned
    assert codec.coder.is_state(state.coder)  # type: ignore[attr-defined]
    assert not codec.coder.is_state((*state.coder[:-1], 1e9))  # type: ignore[attr-defined]


def test_when_signs_say_more_than_a_term_may_be_off_then_it_is_held() -> None:
    codec = codec_of(PITCH)
    for least in (-0.3, 0.3):
        state = moved_on(codec)._replace(model=(0.1, 0.0, *[least] * 4, 0.2, 0.1, 0.3, 1.0))
        ends = [codec.open(state, (sign,)).model[2:6] for sign in (-1, 1)]
        assert max(map(abs, (*ends[0], *ends[1]))) == 0.3
        assert ends[0] != ends[1]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"spreads": (0.1, 0.1)}, "for each of 4 terms"),
        ({"spreads": (0.1, 0.1, 0.1, 0.7)}, "at most learned_max"),
        ({"noises": ()}, "every column of the disturbance"),
        ({"reach": ((1.0, 0.0),)}, "reach has 1 rows"),
        ({"removed": 1.0}, "removed must be above 0 and below 1"),
    ],
)
def test_what_makes_no_coder_is_refused(changes: dict[str, Any], message: str) -> None:
    coder: Any = codec_of(PITCH).coder
    with pytest.raises(ValueError, match=message):
        LearningCoder(replace(coder.parameters, **changes), (1, 1, 1, 1), 2)


def test_a_plant_that_grows_is_not_learned() -> None:
    section = plant_section("pendulum")
    plant = linear_plant(section.A, section.B, section.C, None, section.densities)
    with pytest.raises(ValueError, match=r"10\.56 bit/s.*use the coder `direction`"):
        design_learning(plant, 20.0, 0.05)
