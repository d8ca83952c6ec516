"""The linear structures, from sixty seconds of data behind 12-bit encoders; filters and estimator."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import cont2discrete, dlsim

from plant_sim.identification import simulation
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.estimator import condition_of, estimate, moments_of
from plant_sim.identification.excitation import pseudo_random
from plant_sim.identification.faults import require_units
from plant_sim.identification.filters import Array, SignalFilter, low_pass
from plant_sim.identification.pipeline import Identification, Options, identify
from plant_sim.identification.record import Record
from plant_sim.identification.regression import Filters, Regression, regress
from plant_sim.identification.segments import cut
from plant_sim.identification.structures import LinearStructure, parse_linear

H = 0.01
STEPS = 6000
TWELVE_BITS = math.tau / 4096


class Case(NamedTuple):
    """A plant dx/dt = A x + B u + d, y = C x, and the parameters that it is made of."""

    structure: str
    A: list[list[float]]
    B: list[list[float]]
    C: list[list[float]]
    true: dict[str, float]
    d: tuple[float, ...] = ()
    lag_s: float = 0.0


COUPLED = Case(
    "linear",
    [[0, 1, 0, 0], [-1.74, -0.33, 0.3, 0.1], [0, 0, 0, 1], [0.5, -0.2, -0.8, -0.93]],
    [[0, 0], [0.3, 0.15], [0, 0], [-0.2, 0.25]],
    [[1, 0, 0, 0], [0, 0, 1, 0]],
    {
        "output1''/output1": -1.74,
        "output1''/output1'": -0.33,
        "output1''/output2": 0.3,
        "output1''/output2'": 0.1,
        "output2''/output1": 0.5,
        "output2''/output1'": -0.2,
        "output2''/output2": -0.8,
        "output2''/output2'": -0.93,
        "output1''/input1": 0.3,
        "output1''/input2": 0.15,
        "output2''/input1": -0.2,
        "output2''/input2": 0.25,
    },
    (0.0, 0.2, 0.0, -0.1),
    0.08,
)
CASES = (
    Case("first-order", [[-4]], [[20]], [[1]], {"a": 4, "b": 20}),
    Case("first-order", [[-2]], [[10]], [[1]], {"a": 2, "b": 10, "d": 1.5}, (1.5,), 0.1),
    Case("integrator", [[0]], [[0.5]], [[1]], {"b": 0.5}),
    Case("integrator:2", [[0, 1], [0, 0]], [[0], [0.8]], [[1, 0]], {"b": 0.8}),
    Case("siso:2,1", [[-0.8, 1], [-5, 0]], [[0.7], [2]], [[1, 0]], {"a_1": 0.8, "b_0": 0.7, "b_1": 2}),
    Case(
        "siso:3,1",
        [[-2, 1, 0], [-6, 0, 1], [-5, 0, 0]],
        [[0], [2], [4]],
        [[1, 0, 0]],
        {"a_1": 2, "a_2": 6, "a_3": 5, "b_0": 2, "b_1": 4},
    ),
    COUPLED,
)


def record_of(case: Case, seed: int, steps: int = STEPS, step: float | None = None) -> Record:
    """Return what encoders see of a plant under random square waves of 3 V."""
    A, B, C = (np.array(one, dtype=float) for one in (case.A, case.B, case.C))
    size, inputs = B.shape
    generator = np.random.default_rng(seed)
    u = 3.0 * np.stack(
        [np.repeat(generator.choice([-1.0, 1.0], steps), 55)[:steps] for _ in range(inputs)], axis=1
    )
    system = np.zeros((size + 2 * inputs + 1,) * 2)
    system[:size, :size] = A
    system[:size, size : size + inputs] = B if case.lag_s else 0.0
    system[:size, size + inputs : -1] = 0.0 if case.lag_s else B
    if case.lag_s:
        inner = slice(size, size + inputs)
        system[inner, inner] = -np.eye(inputs) / case.lag_s
        system[inner, size + inputs : -1] = np.eye(inputs) / case.lag_s
    system[:size, -1] = case.d or 0.0
    tick = expm(system * H)
    state = np.zeros(len(system))
    state[-1] = 1.0
    seen = np.empty((steps, len(C)))
    for index in range(steps):
        state[size + inputs : -1] = u[index]
        seen[index] = C @ state[:size]
        state = tick @ state
    if step is None:
        step = TWELVE_BITS if case.structure != "first-order" else 2.0 * np.abs(seen).max() / 4096
    return Record(H, np.round(seen / step) * step, u)


def found_in(case: Case, record: Record, options: Options | None = None) -> Identification:
    structure = parse_linear(case.structure, record.output_names, record.input_names)
    return identify(record, structure, options)


@pytest.mark.parametrize("seed", [1, *(pytest.param(one, marks=pytest.mark.soak) for one in (2, 3))])
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.structure}-{case.lag_s:g}")
def test_when_sixty_seconds_are_seen_by_12_bits_then_each_structure_is_found_within_5_percent(
    case: Case, seed: int
) -> None:
    found = found_in(case, record_of(case, seed))
    assert found.refused == ()
    assert found.warnings == ()
    errors = {name: found.values[name] / true - 1.0 for name, true in case.true.items()}
    assert max(map(abs, errors.values())) < 0.05, errors  # measured: 0.001
    assert found.lag_s == pytest.approx(case.lag_s, rel=0.05, abs=0.0025)
    regression = {name: found.regression.values[name] / true - 1.0 for name, true in case.true.items()}
    assert max(map(abs, regression.values())) < 0.05, regression


def test_when_an_input_never_moves_then_it_is_named_and_no_model_is_made() -> None:
    record = record_of(COUPLED, 1)
    still = Record(H, record.outputs, record.inputs * [1.0, 0.0])
    with pytest.raises(IdentificationError, match="input2 never changes"):
        found_in(COUPLED, still)


def test_when_two_inputs_move_alike_then_their_gains_cannot_be_separated() -> None:
    record = record_of(COUPLED, 1, STEPS // 3)
    alike = Record(H, record.outputs, record.inputs[:, :1] * [1.0, 1.0])
    assert any("not exciting enough" in text for text in found_in(COUPLED, alike).refused)


def test_when_an_output_does_not_follow_the_input_then_nothing_is_supported() -> None:
    record = record_of(CASES[0], 1)
    noise = np.random.default_rng(7).normal(size=record.outputs.shape).cumsum(axis=0)
    found = found_in(CASES[0], Record(H, noise, record.inputs))
    assert any(text.startswith("b = ") and "uncertain" in text for text in found.refused)


def test_when_two_gains_are_both_uncertain_then_neither_passes_as_immaterial() -> None:
    record = record_of(COUPLED, 1)
    noise = 0.1 * np.random.default_rng(7).normal(size=(STEPS, 1)).cumsum(axis=0)
    structure = parse_linear("first-order", ("y",), ("u", "v"))
    found = identify(Record(H, noise, record.inputs), structure)
    assert any(text.startswith("b/u = ") and "uncertain" in text for text in found.refused)
    assert any("of the motion, at least 50% is needed" in text for text in found.refused)


def test_when_the_input_moves_little_about_a_large_mean_then_the_plant_is_found() -> None:
    u = 10.0 + record_of(CASES[0], 1).inputs / 3.0
    y = np.asarray(dlsim(cont2discrete(([20.0], [1.0, 4.0]), H), u)[1])
    found = identify(Record(H, y, u), parse_linear("first-order", ("y",), ("u",)))
    assert found.refused == ()
    assert [found.values["a"], found.values["b"]] == pytest.approx([4.0, 20.0], rel=0.01)


def test_when_no_second_method_confirms_the_estimates_then_no_model_is_supported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fails(*_: object, **__: object) -> None:
        raise IdentificationError("no fit")

    monkeypatch.setattr(simulation, "fit", fails)
    found = found_in(CASES[0], record_of(CASES[0], 1))
    assert any("no second method" in text for text in found.refused)


def test_when_a_record_begins_under_a_steady_input_then_its_lag_remembers_that() -> None:
    record = Record(H, np.zeros((STEPS, 1)), np.full((STEPS, 1), 5.0))
    structure = parse_linear("first-order", ("y",), ("u",))
    assert np.all(cut(record, structure, 5.0).before == 5.0)
    assert np.all(cut(record, structure, 5.0, rests=True).before[:, 0] == 0.0)


def test_when_a_level_without_a_unit_moves_in_steps_of_1_then_it_is_not_taken_for_degrees() -> None:
    levels, drive = np.arange(200.0)[:, None] % 50, np.full((200, 1), 230.0)
    assert require_units(Record(H, levels, drive, steps=(1.0,))) == []
    with pytest.raises(IdentificationError, match="in degrees and is read as rad"):
        require_units(Record(H, levels, drive, output_units=("rad",), steps=(1.0,)))
    doubts = require_units(Record(H, levels, drive, input_units=("V",)))
    assert "reaches 230 V" in doubts[0]


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("second-order", "give pitch, first-order"),
        ("siso:2,2", "that of the input below it"),
        ("siso:9,0", "order must be 1 to 4"),
        ("integrator:x", "give pitch"),
    ],
)
def test_when_a_structure_is_not_known_then_the_known_ones_are_named(text: str, fault: str) -> None:
    with pytest.raises(IdentificationError, match=fault):
        parse_linear(text, ("y",), ("u",))


def test_when_a_structure_of_one_output_gets_two_then_both_are_named() -> None:
    with pytest.raises(IdentificationError, match=r"2 \(pitch, yaw\)"):
        parse_linear("siso:2,1", ("pitch", "yaw"), ("u",))


@pytest.mark.parametrize("power", [0.0, -1e-12, math.nan])
def test_when_a_regressor_has_no_power_then_the_condition_is_0_without_a_warning(power: float) -> None:
    with np.errstate(all="raise"):
        assert condition_of(np.array([[1.0, 1e-9], [1e-9, power]])) == 0.0


@pytest.mark.parametrize(
    ("bandwidth_rad_s", "damping", "text"),
    [
        (0.0, 0.7, "above 0"),
        (-1.0, 0.7, "above 0"),
        (math.nan, 0.7, "above 0"),
        (math.inf, 0.7, "needs samples closer"),
        (1e200, 0.7, "needs samples closer"),
        (1.0, 0.0, "above 0"),
        (1.0, math.nan, "above 0"),
    ],
)
def test_when_a_filter_makes_no_sense_then_it_is_refused(
    bandwidth_rad_s: float, damping: float, text: str
) -> None:
    options = Options(bandwidth_rad_s=bandwidth_rad_s, filters=Filters(damping=damping))
    with pytest.raises(IdentificationError, match=text):
        found_in(COUPLED, record_of(COUPLED, 1, 1500), options)


@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize("order", [1, 2, 3])
def test_when_a_signal_is_filtered_in_pieces_then_every_derivative_is_that_of_the_exact_filter(
    order: int, held: bool
) -> None:
    polynomial = low_pass(order, 4.0, 0.7)
    generator = np.random.default_rng(5)
    signal = np.concatenate((np.zeros(2), generator.normal(size=398)))
    passed = SignalFilter(polynomial, H, 0.0, held)
    for derivative in range(order + (not held)):
        numerator = [polynomial[-1]] + [0.0] * derivative
        wanted = dlsim(
            cont2discrete((numerator, polynomial), H, method="zoh" if held else "foh"), signal
        )[1]
        pieces = [passed.take(signal[:150], derivative), passed.take(signal[150:], derivative)]
        assert np.concatenate(pieces) == pytest.approx(np.asarray(wanted).ravel(), abs=1e-9)


def step_by_step(regressors: Array, targets: Array, alpha: float, gain: float) -> tuple[Array, Array]:
    """Run (9), (10) as recursive least squares, a row at a time: Omega over time, and Gamma."""
    size = regressors.shape[1]
    gamma, omega = np.eye(size) * gain, np.zeros(size)
    bound = 10.0 * gain * math.sqrt(size)
    history = np.empty_like(regressors)
    for index, (phi, xi) in enumerate(zip(regressors, targets, strict=True)):
        kept = math.exp(-alpha * H * max(0.0, 1.0 - np.linalg.norm(gamma) / bound))
        pushed = gamma @ phi
        step = pushed / (kept / H + phi @ pushed)
        omega = omega + step * (xi - phi @ omega)
        gamma = (gamma - np.outer(step, pushed)) / kept
        history[index] = omega
    return history, gamma


def noisy_rows(excited: int, quiet: int) -> tuple[Array, Array]:
    generator = np.random.default_rng(3)
    phi = np.concatenate((generator.normal(size=(excited, 3)), np.zeros((quiet, 3))))
    phi += 1e-6 * generator.normal(size=phi.shape)
    return phi, phi @ [0.6, 2.0, -1.5] + 0.1 * generator.normal(size=len(phi)) * (phi[:, 0] != 0.0)


def test_when_blocks_are_summed_then_the_estimates_are_those_of_the_recursion() -> None:
    phi, xi = noisy_rows(3000, 0)
    wanted, _ = step_by_step(phi, xi, 0.1, 1e3)
    each = estimate(moments_of(phi, xi, H, 1), forgetting_per_s=0.1)
    assert each.history == pytest.approx(wanted, rel=1e-7, abs=1e-9)
    blocks = estimate(moments_of(phi, xi, H, 10), forgetting_per_s=0.1)
    assert blocks.history == pytest.approx(wanted[9::10], rel=2e-3, abs=1e-3)


def test_when_the_excitation_fades_then_the_gain_stays_bounded_and_the_estimates_rest() -> None:
    excited, quiet = 2000, 15_000  # over the quiet 150 s exp(alpha t) is 3e6
    phi, xi = noisy_rows(excited, quiet)
    xi[excited:] = 1e-6 * np.random.default_rng(4).normal(size=quiet)
    found = estimate(moments_of(phi, xi, H, 1), forgetting_per_s=0.1)
    assert np.all(np.isfinite(found.covariance))
    assert found.values == pytest.approx(found.history[excited], rel=0.1)


def test_when_one_frequency_excites_three_parameters_too_few_then_a_warning_says_so() -> None:
    u = np.sin(np.arange(10_000) * H)[:, None]
    found = regress(Record(H, 0.5 * u, u), LinearStructure("siso:2,1", ("y",), ("u",), 2, 1), Filters())
    assert found.condition < 1e-3


def test_when_a_record_is_long_then_blocks_give_the_estimates_of_single_samples() -> None:
    record = record_of(CASES[5], 1)
    structure = parse_linear("siso:3,1", record.output_names, record.input_names)
    filters = Filters(2.0, forgetting_per_s=0.0, gain=None, rests=False)
    one: Regression = regress(record, structure, filters)
    few = regress(record, structure, filters, blocks=500)
    assert len(few.times_s) == 500
    assert list(few.values.values()) == pytest.approx(list(one.values.values()), rel=1e-6)
    assert few.times_s[-1] == one.times_s[-1]


def test_when_filters_are_far_from_the_motion_then_both_frequencies_are_named() -> None:
    signal = pseudo_random(H, 0.05, 0.0, 3.0)
    u = np.array([[signal(tick)] for tick in range(3000)])
    system = cont2discrete(([80.0], [1.0, 0.4, 80.0]), H)
    y = np.asarray(dlsim(system, u)[1])
    structure = parse_linear("siso:2,0", ("output",), ("input",))
    chosen = identify(Record(H, y, u), structure)
    assert chosen.values["a_2"] == pytest.approx(80.0, rel=0.02)
    assert any("filters of" in text for text in chosen.notes)
    given = identify(Record(H, y, u), structure, Options(bandwidth_rad_s=1.0))
    assert any("--bandwidth" in text for text in given.notes)


@pytest.mark.parametrize("gain", [None, 1e3])
def test_when_nothing_is_forgotten_then_all_blocks_at_once_give_what_they_give_in_turn(
    gain: float | None,
) -> None:
    random = np.random.default_rng(4)
    regressors = random.normal(size=(300, 3)) * [1.0, 0.1, 5.0]
    moments = moments_of(regressors, regressors @ [1.0, -2.0, 0.3] + random.normal(size=300), 0.01, 1)
    at_once = estimate(moments, forgetting_per_s=0.0, gain=gain)
    in_turn = estimate(moments, forgetting_per_s=1e-300, gain=gain)
    assert at_once.history == pytest.approx(in_turn.history, rel=1e-9)
    assert at_once.covariance == pytest.approx(in_turn.covariance, rel=1e-9)
    assert at_once.residual == pytest.approx(in_turn.residual, rel=1e-12)
