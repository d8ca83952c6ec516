from __future__ import annotations

import pytest

from transmitter.rigs.formats.qsb import STAMP_US, QsbFormat


@pytest.mark.parametrize(
    ("line", "counts", "stamp"),
    [
        (b"s0E0000012C!\r\n", 300, None),
        (b"S0EFFFFFF38!\r\n", -200, None),
        (b"r0e00000000\n", 0, None),
        (b"s0E7FFFFFFF00000010!\r\n", 2**31 - 1, 16 * STAMP_US),
        (b"s 0E 80000000 0000000A!\r\n", -(2**31), 10 * STAMP_US),
    ],
)
def test_counter_lines(line: bytes, counts: int, stamp: int | None) -> None:
    (sample,) = QsbFormat().feed(b"\n" + line)
    assert (sample.counts, sample.device_us) == ((counts,), stamp)


def test_answers_to_settings_are_no_damage_and_errors_are() -> None:
    reader = QsbFormat()
    assert reader.feed(b"\nw0000000000!\r\nw1500000007!\r\ne01!\r\ns0E12!\r\ns0E0000000!\r\n") == []
    assert reader.counts["bad_frames"] == 1


def test_there_is_nothing_to_command() -> None:
    assert QsbFormat().command(1, (1.0, 1.0), True) == b""
    assert not QsbFormat.has_output
