from __future__ import annotations

import math
import struct

import pytest

from transmitter.rigs.formats.doubles import DoublesLayout, UnitError

FIELDS = ("seq", "time_s", "c0", "c1", "c2")


def test_a_unit_of_the_notes_is_raw_little_endian_doubles() -> None:
    data = bytes.fromhex("9a9999999999b93f9a9999999999c9bf333333333333d33f")
    layout = DoublesLayout(("c0", "c1", "c2"), "little", "rad", {0: 8192, 1: 4096, 2: 4096})
    assert layout.decode(data).counts == tuple(
        math.floor(value / math.tau * turn + 0.5)
        for value, turn in ((0.1, 8192), (-0.2, 4096), (0.3, 4096))
    )


def test_names_units_and_byte_order() -> None:
    values = (7.0, 1.5, 90.0, -90.0, 0.0)
    layout = DoublesLayout(FIELDS, "big", "deg", {0: 8192, 1: 4096, 2: 4096})
    sample = layout.decode(struct.pack(">5d", *values))
    assert sample == ((2048, -1024, 0), 7, 1_500_000, 0)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1e300, 5e-310])
def test_nonsense_is_refused(value: float) -> None:
    with pytest.raises(UnitError, match="c1"):
        DoublesLayout(("c0", "c1")).decode(struct.pack("<2d", 1.0, value))


@pytest.mark.parametrize("counts", [1.0, -200.0, 4096.0, 123456.0])
def test_the_wrong_byte_order_is_noticed(counts: float) -> None:
    with pytest.raises(UnitError, match="byte order 'little'"):
        DoublesLayout(("c0",)).decode(struct.pack(">d", counts))
