from __future__ import annotations

import pytest

from transmitter.rigs.formats.ascii import AsciiFormat
from transmitter.rigs.formats.samples import RawSample


def read(text: bytes, *columns: str) -> list[RawSample]:
    reader = AsciiFormat(columns) if columns else AsciiFormat()
    return reader.feed(b"half a line\n" + text)


@pytest.mark.parametrize(
    "line", [b"5000,1,-2,3\n", b"5000 1 -2 3\r\n", b"5000\t1\t-2\t+3\r\n", b"5000, 1, -2, 3\n"]
)
def test_a_plain_line_in_every_dress(line: bytes) -> None:
    assert read(line) == [RawSample((1, -2, 3), None, 5000)]


def test_columns_come_from_the_configuration() -> None:
    assert read(b"9,7,1\n", "elevation", "-", "travel") == [RawSample((1, 0, 9))]
    assert read(b"4,1,2,3\n", "seq", "c0", "c1", "c2") == [RawSample((1, 2, 3), 4)]


def test_a_checked_line_needs_no_columns_and_its_checksum() -> None:
    # The exclusive or of "E,7,123456,100,-200,300" worked out by hand.
    text = b"E,7,123456,100,-200,300"
    value = 0
    for byte in text:
        value ^= byte
    good = text + b"*%02X\n" % value
    assert read(good) == [RawSample((100, -200, 300), 7, 123456)]
    assert read(good.replace(b"100", b"101")) == []
    assert read(text + b"\n") == [], "this form has a checksum, always"


def test_logs_are_skipped_and_damage_is_counted() -> None:
    reader = AsciiFormat()
    lines = b"x\n# ready\nOK\n\n1,2,3\n1,2,x,4\n1_0,2,3,4\n1.5,2,3,4\n1,2,3,4\n"
    assert reader.feed(lines) == [RawSample((2, 3, 4), None, 1)]
    assert reader.counts == {"log_lines": 1, "bad_frames": 4}


def test_commands() -> None:
    assert AsciiFormat().command(7, (1.5, -0.25), True) == b"U,7,1.5000,-0.2500*60\n"
    assert AsciiFormat().command(8, (1.5, -0.25), False) == b"S*53\n"


def test_pulse_commands_for_the_ros_arduino_firmware() -> None:
    style = AsciiFormat(("travel", "pitch"), "e\r", "pulse", 12.0)
    assert style.poll == b"e\r"
    assert style.command(1, (6.0, -24.0), True) == b"o 128 -255\r"
    assert style.command(1, (6.0, -24.0), False) == b"o 0 0\r"


@pytest.mark.parametrize("columns", [("t_us",), ("travel", "c0"), ("height",), ()])
def test_columns_that_make_no_sample_are_refused(columns: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match="column"):
        AsciiFormat(columns)
