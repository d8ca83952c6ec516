"""Corrupt files: an error of the reader, which names the file, or a log; never another exception."""

from __future__ import annotations

import random
import warnings
from pathlib import Path

import pytest

from channel.codec.models.pitch import PITCH_SIGNALS
from plant_sim.encoder import Encoder
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.read import read_log
from tenbaud.log.table import LogError
from tests.tenbaud import lab_files

PIECES = (
    b",",
    b";",
    b"\t",
    b'"',
    b"\n",
    b"\r",
    b"#",
    b"nan",
    b"inf",
    b"1e400",
    b"-",
    b"\xff\xfe",
    b"\0",
)


def corrupted(data: bytearray, draw: random.Random) -> bytes:
    """Return data of which some bytes are changed, lost, new, moved or cut off."""
    for _ in range(draw.choice((1, 1, 2, 5, 30))):
        at, length = draw.randrange(len(data) + 1), draw.choice((1, 3, 40))
        match draw.randrange(6):
            case 0:
                data[at : at + 1] = bytes([draw.randrange(256)])
            case 1:
                del data[at : at + length]
            case 2:
                data[at:at] = draw.choice(PIECES)
            case 3:
                del data[at:]
            case 4:
                data[at:at] = data[:length]
            case 5:
                del data[:at]
    return bytes(data)


@pytest.mark.parametrize("seed", range(4))
def test_a_corrupt_file_is_read_or_refused_by_name(seed: int, tmp_path: Path) -> None:
    draw = random.Random(seed)
    dialects = list(lab_files.dialects().values())
    path, outcomes = tmp_path / "log.txt", set()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for _ in range(100):
            text, encoding, end, fields = draw.choice(dialects)
            data = end.join(text[: draw.choice((1, 2, 3, 5, 60, 300))]).encode(encoding)
            path.write_bytes(corrupted(bytearray(data), draw))
            section = FlightLogSection.model_validate({"file": str(path), **fields})
            try:
                log = read_log(section, draw.choice((PITCH_SIGNALS, None)), (Encoder(4096),), 0.02)
                outcomes.add(len(log) >= 2)
            except LogError as error:
                outcomes.add(str(path) in str(error) or "no signal of the model" in str(error))
    assert outcomes == {True}
