from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from transmitter.rigs.formats.cobs import SAMPLE, SAMPLE_TYPE, CobsFormat, seal
from transmitter.rigs.formats.samples import DeviceFlag, RawSample

SAMPLE_VECTOR = bytes.fromhex("020102070440e201026401010738ffffff2c0101035e6800")
COMMAND_VECTOR = bytes.fromhex("04810107010103c03f010580be346300")


def test_the_published_vectors() -> None:
    frame = seal(SAMPLE.pack(SAMPLE_TYPE, 0, 7, 123456, 100, -200, 300))
    assert frame == SAMPLE_VECTOR
    assert CobsFormat().command(7, (1.5, -0.25), True) == COMMAND_VECTOR
    reader = CobsFormat()
    assert reader.feed(b"\0" + SAMPLE_VECTOR) == [RawSample((100, -200, 300), 7, 123456)]


@given(st.integers(1, 30), st.integers(0, 23), st.integers(0, 255))
def test_one_damaged_byte_costs_at_most_two_samples(cut: int, place: int, value: int) -> None:
    frames = [seal(SAMPLE.pack(SAMPLE_TYPE, 0, k, 1000 * k, k, -k, k * k)) for k in range(6)]
    damaged = bytearray(frames[2])
    damaged[place] = value
    stream = b"\0" + b"".join([*frames[:2], bytes(damaged), *frames[3:]])
    reader = CobsFormat()
    samples = reader.feed(stream[:cut]) + reader.feed(stream[cut:])
    got = {sample.sequence: sample.counts for sample in samples}
    assert {0, 1, 4, 5} <= set(got)
    assert all(got[k] == (k, -k, k * k) for k in got)


def test_frames_of_other_types_are_counted_and_skipped() -> None:
    reader = CobsFormat()
    assert reader.feed(b"\0" + seal(b"\x42log text") + SAMPLE_VECTOR) != []
    assert reader.counts == {"foreign": 1}


def test_flags_that_are_not_ours_are_ignored() -> None:
    frame = seal(SAMPLE.pack(SAMPLE_TYPE, 0xF1, 7, 0, 0, 0, 0))
    assert CobsFormat().feed(b"\0" + frame)[0].flags == DeviceFlag.ESTOP_OPEN
