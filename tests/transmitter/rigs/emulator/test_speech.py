"""What a device says is what a bridge understands, and the other way round, for every format."""

from __future__ import annotations

import pytest

from transmitter.rigs.emulator.speech import AsciiSpeech, CobsSpeech, DoublesSpeech, QsbSpeech
from transmitter.rigs.formats.ascii import AsciiFormat, checked
from transmitter.rigs.formats.cobs import CobsFormat
from transmitter.rigs.formats.qsb import GREETING, QsbFormat
from transmitter.rigs.formats.samples import DeviceFlag, RawSample

SAMPLE = RawSample((1, -200, 70_000), 65_540, 2**32 + 5, DeviceFlag.OUTPUT_ENABLED)


def test_binary_both_ways() -> None:
    speech, ours = CobsSpeech(), CobsFormat()
    assert ours.feed(b"\0" + speech.encode(SAMPLE)) == [
        RawSample((1, -200, 70_000), 4, 5, DeviceFlag.OUTPUT_ENABLED)
    ]
    speech.feed(b"\0")
    commands, asked = speech.feed(ours.command(1, (1.5, -0.25), True) + ours.command(2, (0, 0), False))
    assert commands == [((1.5, -0.25), True, False), ((0.0, 0.0), False, False)]
    assert asked == 0


@pytest.mark.parametrize(
    ("form", "columns", "seen"),
    [
        ("checked", ("t_us", "c0", "c1", "c2"), RawSample((1, -200, 70_000), 4, 5)),
        ("plain", ("t_us", "c0", "c1", "c2"), RawSample((1, -200, 70_000), None, 5)),
        ("counts", ("c0", "c1", "c2"), RawSample((1, -200, 70_000))),
    ],
)
def test_text_both_ways(form: str, columns: tuple[str, ...], seen: RawSample) -> None:
    speech, ours = AsciiSpeech(form), AsciiFormat(columns)
    assert ours.feed(b"\n" + speech.encode(SAMPLE)) == [seen]
    lines = ours.command(1, (1.5, -0.25), True) + ours.command(2, (0, 0), False) + checked(b"Z")
    commands, _ = speech.feed(lines[:9])
    commands += speech.feed(lines[9:])[0]
    assert commands == [
        ((1.5, -0.25), True, False),
        ((0.0, 0.0), False, False),
        ((0.0, 0.0), False, True),
    ]


def test_a_text_command_with_a_wrong_checksum_is_counted() -> None:
    speech = AsciiSpeech()
    assert speech.feed(b"U,1,5.0,5.0*00\nU,1,5.0,5.0\n" + checked(b"U,1,nan,1")) == ([], 0)
    assert speech.counts["bad_commands"] == 3


def test_a_polled_device_answers_every_question() -> None:
    assert AsciiSpeech("counts", polled=True).feed(b"e\re\r") == ([], 2)


def test_an_adapter_streams_with_a_stamp_once_it_was_greeted() -> None:
    speech, ours = QsbSpeech(), QsbFormat()
    assert not speech.streams
    speech.feed(GREETING)
    assert speech.streams
    (sample,) = ours.feed(b"\n" + speech.encode(SAMPLE))
    assert sample.counts == (-200,)
    assert sample.device_us is not None
    assert speech.feed(b"R0E\n") == ([], 1)
    assert not speech.streams


def test_only_the_newest_unit_of_doubles_is_taken_and_zeros_are_off() -> None:
    import struct

    speech = DoublesSpeech(("seq", "c1"), ("v0", "v1"), "big", {1: 0.5})
    assert struct.unpack(">2d", speech.encode(SAMPLE)) == (65_540.0, -100.0)
    data = struct.pack(">6d", 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert speech.feed(data[:40]) == ([((3.0, 4.0), True, False)], 0)
    assert speech.feed(data[40:]) == ([((5.0, 6.0), True, False)], 0)
    assert speech.feed(bytes(16)) == ([((0.0, 0.0), False, False)], 0)
