"""Error bounds, symmetry, refusals and pinned bits of ``channel.codec.numerics``."""

from __future__ import annotations

import json
import math
import os
import random
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from types import FunctionType

import pytest

from channel.codec import numerics
from tests.channel.codec import exact_functions

TOP = Path(__file__).resolve().parents[3]
GOLDEN = TOP / "tests" / "golden" / "numerics.json"
SEED = 20240610

ABSOLUTE_BOUND = Fraction(125, 10**18)
RELATIVE_BOUND = Fraction(1, 2**52)

Real = Callable[[float], float]
Exact = Callable[[float], Fraction]
TRIGONOMETRIC: list[tuple[Real, Exact]] = [
    (numerics.sin, exact_functions.sine),
    (numerics.cos, exact_functions.cosine),
]
FUNCTIONS: dict[str, Real] = {
    "sin": numerics.sin,
    "cos": numerics.cos,
    "exp": numerics.exp,
}


def random_angles() -> list[float]:
    chooser = random.Random(SEED)
    return [
        chooser.uniform(-limit, limit)
        for limit in (1e-8, math.pi / 4, 10.0, numerics.ANGLE_RAD_MAX)
        for _ in range(1500)
    ]


def hard_angles() -> list[float]:
    """Floats around multiples of pi/4: even ones cancel the most, odd ones switch the branch."""
    chooser = random.Random(SEED + 1)
    counts = [*range(1, 200), *(chooser.randrange(200, 127322) for _ in range(800)), 127322]
    angles = []
    for count in counts:
        nearest = float(Fraction(count * exact_functions.PI, 4 * exact_functions.ONE))
        angles += [nearest, math.nextafter(nearest, 0.0), -math.nextafter(nearest, 2e5)]
    return angles


def worst_excess(function: Real, exact: Exact, points: list[float]) -> str:
    """Return "" when every point keeps both bounds, else the first that does not."""
    for x in points:
        truth = exact(x)
        error = abs(Fraction(function(x)) - truth)
        if error > ABSOLUTE_BOUND or error > RELATIVE_BOUND * abs(truth):
            return f"x = {x!r} ({x.hex()}): error {float(error):.3e} of {float(truth):.3e}"
    return ""


@pytest.mark.parametrize(("function", "exact"), TRIGONOMETRIC)
def test_random_angles_keep_both_bounds(function: Real, exact: Exact) -> None:
    assert worst_excess(function, exact, random_angles()) == ""


@pytest.mark.parametrize(("function", "exact"), TRIGONOMETRIC)
def test_angles_beside_multiples_of_an_eighth_turn_keep_both_bounds(
    function: Real, exact: Exact
) -> None:
    assert worst_excess(function, exact, hard_angles()) == ""


def test_the_bound_check_notices_a_wrong_last_bit() -> None:
    def two_bits_off(x: float) -> float:
        return numerics.sin(x) * (1.0 + 2.0**-51)

    assert worst_excess(two_bits_off, exact_functions.sine, random_angles()) != ""


def test_reference_agrees_with_the_platform() -> None:
    # Two ulp of slack: the platform promises no more, and a wrong reference is off by far more.
    for x in (0.1, 1.0, -2.5, 4.0, 33.3):
        assert float(exact_functions.sine(x)) == pytest.approx(math.sin(x), rel=4.5e-16)
        assert float(exact_functions.cosine(x)) == pytest.approx(math.cos(x), rel=4.5e-16)
        assert float(exact_functions.exponential(x)) == pytest.approx(math.exp(x), rel=4.5e-16)


def test_exp_keeps_its_relative_bound() -> None:
    chooser = random.Random(SEED + 2)
    points = [chooser.uniform(-limit, limit) for limit in (0.35, 2.0, 700.0) for _ in range(800)]
    points += [(k + half) * math.log(2.0) for k in range(-1009, 1009, 13) for half in (0.0, 0.5)]
    points += [700.0, -700.0, 0.0]
    for x in points:
        truth = exact_functions.exponential(x)
        error = abs(Fraction(numerics.exp(x)) - truth)
        assert error <= RELATIVE_BOUND * truth, f"x = {x!r} ({x.hex()})"


def test_sin_is_odd_and_cos_is_even_to_the_last_bit() -> None:
    for x in random_angles() + hard_angles():
        assert numerics.sin(-x) == -numerics.sin(x)
        assert numerics.cos(-x) == numerics.cos(x)


def general_sin(x: float) -> float:
    """Return the sine the general way, for angles that `sin` has written out."""
    if abs(x) <= numerics._EIGHTH_TURN:
        return numerics._sin_reduced(x, 0.0)
    quarters, remainder, tail = numerics._reduce_angle(x)
    assert quarters in (-1, 1)
    cosine = numerics._cos_reduced(remainder, tail)
    return cosine if quarters == 1 else -cosine


def test_the_ranges_written_out_have_the_bits_of_the_general_way() -> None:
    rng = random.Random(13)
    angles = [rng.uniform(0.0, 2.35) for _ in range(20_000)]
    angles += [10.0 ** rng.uniform(-320.0, 0.0) for _ in range(2_000)]
    for edge in (numerics._EIGHTH_TURN, math.pi / 2, numerics._ONE_QUARTER_MAX):
        below = above = edge
        for _ in range(50):
            angles += [below, above]
            below, above = math.nextafter(below, 0.0), math.nextafter(above, 4.0)
    for angle in angles:
        assert numerics.sin(angle).hex() == general_sin(angle).hex(), angle.hex()
        assert numerics.sin(-angle).hex() == general_sin(-angle).hex(), angle.hex()


def test_results_at_zero_are_exact_and_positive() -> None:
    for zero in (0.0, -0.0):
        assert numerics.sin(zero).hex() == "0x0.0p+0"
        assert numerics.cos(zero) == 1.0
        assert numerics.exp(zero) == 1.0


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 100000.00000000001, -1e300])
@pytest.mark.parametrize("function", [numerics.sin, numerics.cos])
def test_an_angle_outside_the_domain_is_refused_with_value_and_range(
    function: Real, value: float
) -> None:
    with pytest.raises(ValueError, match="100000 rad") as caught:
        function(value)
    assert str(value) in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 700.0000000000001, -701.0])
def test_an_exponent_outside_the_domain_is_refused_with_value_and_range(value: float) -> None:
    with pytest.raises(ValueError, match="-700 to 700") as caught:
        numerics.exp(value)
    assert str(value) in str(caught.value)


def golden_differences() -> list[str]:
    """Compare bits with the golden file; one line for each vector that differs."""
    vectors: dict[str, list[list[str]]] = json.loads(GOLDEN.read_text(encoding="utf-8"))
    found = [] if vectors.keys() == FUNCTIONS.keys() else [f"functions: {sorted(vectors)}"]
    for name, pairs in vectors.items():
        if len(pairs) < 100:
            found.append(f"{name}: only {len(pairs)} vectors")
        for argument, expected in pairs:
            result = FUNCTIONS[name](float.fromhex(argument)).hex()
            if result != expected:
                found.append(f"{name}({argument}) = {result}, golden {expected}")
    return found


def test_bits_equal_the_golden_vectors() -> None:
    assert golden_differences() == []


def test_a_changed_bit_would_be_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(FUNCTIONS, "exp", lambda x: numerics.exp(x) * (1.0 + 2.0**-52))
    assert golden_differences() != []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="GLIBC_TUNABLES is glibc's own")
def test_bits_do_not_change_when_processor_features_are_masked() -> None:
    # Under this mask glibc takes other code paths for its own sin and exp: see the module's text.
    program = (
        "from tests.channel.codec.test_numerics import golden_differences as differences\n"
        "found = differences()\n"
        "print(found[:5])\n"
        "raise SystemExit(1 if found else 0)\n"
    )
    environment = {**os.environ, "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA"}
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=TOP,
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_compiled_functions_give_the_same_bits() -> None:
    numba = pytest.importorskip("numba", reason="needs the extra 'studies'")
    compiled = dict(vars(numerics))
    # Helpers first: compiled code finds the functions it calls among its globals.
    for name in (
        "refuse",
        "_power_of_two",
        "_sin_reduced",
        "_cos_reduced",
        "_reduce_angle",
        *FUNCTIONS,
    ):
        function: FunctionType = getattr(numerics, name)
        # Only the functions themselves are called from Python, and none of them from C.
        called = {"no_cfunc_wrapper": True, "no_cpython_wrapper": name not in FUNCTIONS}
        compiled[name] = numba.njit(**called)(FunctionType(function.__code__, compiled, name))
    for name, pairs in json.loads(GOLDEN.read_text(encoding="utf-8")).items():
        for argument, expected in pairs:
            assert float(compiled[name](float.fromhex(argument))).hex() == expected
