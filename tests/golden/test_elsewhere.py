"""The codec has the same bits on every processor that this machine has or emulates."""

from __future__ import annotations

import math
from functools import cache
from hashlib import blake2b
from pathlib import Path

import pytest

from benchmarks.bits import in_c, places
from benchmarks.bits.flight import LONGEST
from benchmarks.bits.places import PLACES, Amount, Found, PlaceFailed, differences
from tenbaud.export.values import literal
from tests.golden.regenerate import GENERATORS, GOLDEN_CODECS

IN_C = (LONGEST, "words of ten bits", "learning the pitch")
SHORT, LONG = Amount(1_000, 50, IN_C), Amount(1_000_000, 10_000)
ELSEWHERE = [name for name in PLACES if name != "python"]
PINNED = "29febdd4e9c13202"
"""What the short flights come to, so that machines are compared that never meet."""
COMPILES_LONG = "studies"
"""Every codec is compiled: tests/tenbaud/studies/test_equal_bits.py is the short form."""


@cache
def expected(amount: Amount) -> Found:
    return PLACES["python"].run(amount)


def need(name: str) -> None:
    missing = PLACES[name].missing()
    if missing is not None:
        pytest.skip(missing)


def check(name: str, amount: Amount) -> None:
    need(name)
    found = PLACES[name].run(amount)
    assert set(found.flights) >= set(amount.in_c)
    assert found.golden
    assert not differences(expected(amount), found, amount)


def test_here_every_golden_vector_is_made_again_and_every_flight_comes_to_the_pinned_digest() -> None:
    found = expected(SHORT)
    assert found.golden == dict.fromkeys(GENERATORS, 0)
    assert all(flown[-1] == "0" for flown in found.flights.values())
    flown = ";".join([one for flight in found.flights.values() for one in flight])
    assert blake2b(flown.encode(), digest_size=8).hexdigest() == PINNED


@pytest.mark.parametrize("name", [name for name in ELSEWHERE if name != COMPILES_LONG])
def test_elsewhere_no_bit_differs(name: str) -> None:
    check(name, SHORT)


@pytest.mark.soak
@pytest.mark.parametrize("name", ELSEWHERE)
def test_elsewhere_no_bit_differs_for_long(name: str) -> None:
    check(name, LONG)


def test_a_state_that_differs_in_its_last_bit_is_found(tmp_path: Path) -> None:
    need("c")
    in_c.write_sources(LONGEST, GOLDEN_CODECS[LONGEST], tmp_path)
    sizes = tmp_path / "codec_sizes.h"
    text = sizes.read_text(encoding="utf-8")
    largest = GOLDEN_CODECS[LONGEST].initial().coder[0]
    changed = text.replace(literal(largest), literal(math.nextafter(largest, 1.0)))
    assert changed != text
    sizes.write_text(changed, encoding="utf-8")
    found = places.read(places.run_in_c(in_c.HOST, tmp_path, SHORT.samples))
    found.flights[LONGEST] = found.flights.pop("c")
    assert found.golden["codec"] > 0
    assert f"{LONGEST}: a digest of 0 ... 100 differs" in differences(expected(SHORT), found, SHORT)


def test_a_compiler_that_reorders_is_refused(tmp_path: Path) -> None:
    need("c")
    in_c.write_sources(LONGEST, GOLDEN_CODECS[LONGEST], tmp_path)
    with pytest.raises(PlaceFailed, match="without -ffast-math"):
        places.run_in_c(in_c.HOST._replace(compiler=("gcc", "-ffast-math")), tmp_path, 100)


def test_a_place_whose_program_is_missing_says_what_to_install() -> None:
    needs = (("no-such-program", "make emulators"),)
    missing = PLACES["c"]._replace(needs=needs).missing()
    assert missing == "needs no-such-program: make emulators"


def test_a_program_that_ends_early_is_no_result() -> None:
    with pytest.raises(PlaceFailed, match="ended early"):
        places.read("golden;codec;0\n")
