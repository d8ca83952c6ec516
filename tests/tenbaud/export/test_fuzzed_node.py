"""Frames with good checksums and absurd contents, and garbage: the C node stays within its memory."""

from __future__ import annotations

import random
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from channel.codec.codec import WIRE_ERASED
from channel.links.serial.wire import stuff
from channel.protocol.endings import Ending
from channel.protocol.frames import Bye, Commands, Desync, Echo, Frame, Refuse, Unknown, Welcome
from channel.protocol.wire import encode
from tenbaud.build.flight import Agreement, agree
from tenbaud.config.load import load_config
from tenbaud.export.node import node_files
from tests.tenbaud.export.compiled_codec import compiler, need, write_files

FRAMES = 4_000
INCARNATION = 1234
SANITIZED = (
    *("-std=c99", "-O1", "-g", "-ffp-contract=off"),
    *("-fsanitize=address,undefined", "-fno-sanitize-recover=all"),
)
WAIT = b"\xff\0"
"""that nothing has come yet; a byte 0xFF has a 1 behind it"""


def some_frame(chance: random.Random, agreement: Agreement) -> Frame:
    """Return a frame that a receiver might send, or might not."""
    terms, codec = agreement.terms, agreement.codec

    def number(most: int, usual: int) -> int:
        return chance.choice((usual, usual, usual, 0, 1, most, chance.randrange(most + 1)))

    session, epoch = number(2**32 - 1, 7), number(2**16 - 1, 0)
    sample = number(2**32 - 1, chance.randrange(3))
    kind = chance.randrange(12)
    if kind < 5:
        steps = tuple(chance.choice((0, 5000, -5000, 32767)) for _ in terms.signals.inputs)
        state = codec.initial()._replace(sample=sample)
        data = chance.choice((b"", codec.pack(state), chance.randbytes(chance.randrange(90))))
        hold = chance.choice(((), steps, steps * 3))
        return Welcome(session, epoch, sample, INCARNATION, number(2**32 - 1, 0), hold, data)
    if kind < 9:
        count = chance.choice((1, 1, 1, 2, 3, 4, 40))
        size = terms.ticks_per_sample * len(terms.signals.inputs)
        size = chance.choice((size, size, size, size, 0, 1, size + 1))
        first = min(sample, 2**32 - 1 - count)
        word = chance.choice((0, 1, WIRE_ERASED, WIRE_ERASED, 9))
        values = tuple(chance.choice((0, 100, -5000)) for _ in range(size))
        echoes = [Echo(first + at, word, chance.getrandbits(64), values) for at in range(count)]
        return Commands(session, epoch, tuple(echoes))
    others: tuple[Frame, ...] = (
        Unknown(session, epoch),
        Refuse(number(2**32 - 1, 1), Ending.MISMATCH, "text", "x" * chance.randrange(9000)),
        Bye(number(2**32 - 1, 1), Ending.OVER, ""),
        Desync(session, epoch, sample, 1, 2, b""),
    )
    return chance.choice(others)


def line_of(chance: random.Random, agreement: Agreement) -> bytes:
    """Return what arrives: frames, some of them damaged, garbage, and pauses."""
    found = bytearray()
    for _ in range(FRAMES):
        data = bytearray(stuff(encode(some_frame(chance, agreement))))
        if chance.random() < 0.1:
            data[chance.randrange(len(data))] = chance.randrange(256)
        if chance.random() < 0.05:
            data = bytearray(chance.randbytes(chance.randrange(400)))
        found += data.replace(b"\xff", b"\xff\1") + WAIT * chance.choice((1, 5, 120))
    return bytes(found)


@pytest.mark.parametrize(
    "preset",
    ["paper-10baud", "pendulum-20baud", pytest.param("history-10baud", marks=pytest.mark.soak)],
)
def test_no_frame_leads_the_node_out_of_its_memory(preset: str, tmp_path: Path) -> None:
    need("gcc", "gcc")
    settings: dict[str, Any] = {"link": {"kind": "serial"}}
    agreement = agree(load_config(preset, None, settings), "real")
    files = {name: text for name, text in node_files(agreement).items() if "/" not in name}
    write_files(files, tmp_path)
    shutil.copy(Path(__file__).parent / "fuzzed_node.c", tmp_path)
    program = tmp_path / "fuzzed"
    compiled = compiler(tmp_path, "-o", str(program), flags=SANITIZED)
    if "cannot find" in compiled.stderr:
        pytest.skip("needs the sanitizers of gcc: install the package libgcc-dev of its version")
    assert compiled.returncode == 0, compiled.stderr
    chance = random.Random(8)
    done = subprocess.run(
        [str(program)], input=line_of(chance, agreement), capture_output=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr.decode()[-3000:]
    assert b"motor" not in done.stdout
    sessions, ticks, confirmed = map(int, done.stdout.split())
    assert sessions > 10, "the frames led nowhere"
    assert ticks > 1000
    assert confirmed > 0
