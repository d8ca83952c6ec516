"""An exported codec as a library: compiled by gcc, called by ctypes."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from channel.codec.codec import ERASED, Codec, Vector, Word
from channel.protocol.terms import Terms
from tenbaud.export.codec import codec_files
from transmitter.session.state_observer import StateObserver

FLAGS = ("-std=c99", "-O2", "-Wall", "-Wpedantic", "-Werror", "-ffp-contract=off")
_Double = ctypes.c_double


def need(program: str, package: str) -> None:
    """Skip the test unless a program is there."""
    if shutil.which(program) is None:
        pytest.skip(f"needs {program}: install the package {package}")


def write_files(files: dict[str, str], folder: Path) -> None:
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def compiler(
    folder: Path, *more: str, flags: Sequence[str] = FLAGS
) -> subprocess.CompletedProcess[str]:
    """Compile all of a folder."""
    sources = sorted(str(one) for one in folder.glob("*.c"))
    return subprocess.run(
        [os.environ.get("CC", "gcc"), *flags, *sources, *more],
        capture_output=True,
        text=True,
        check=False,
    )


class CompiledCodec:
    """The C codec, one copy of it."""

    def __init__(
        self,
        codec: Codec,
        terms: Terms,
        observer: StateObserver | None,
        folder: Path,
        flags: Sequence[str] = FLAGS,
    ) -> None:
        write_files(codec_files(codec, terms, observer), folder)
        library = folder / "codec.so"
        done = compiler(folder, "-fPIC", "-shared", "-o", str(library), flags=flags)
        assert done.returncode == 0, done.stderr
        self.codec = codec
        self._library = ctypes.CDLL(str(library))
        self._library.codec_digest.restype = ctypes.c_uint64
        for name in ("encode", "step", "fly", "look", "unpack", "probe"):
            if hasattr(self._library, f"codec_{name}"):
                getattr(self._library, f"codec_{name}").restype = ctypes.c_bool
        self._size = 8 * (1 + codec.model.state_size + max(1, len(codec.coder.initial())))
        self._bytes = len(codec.pack(codec.initial()))
        self._state = ctypes.create_string_buffer(self._size)
        self.reset()

    def reset(self) -> None:
        self._library.codec_initial(self._state)

    def encode(self, measurement: Vector) -> tuple[int, ...] | None:
        """Return the word; None where Python has an exception."""
        symbols = (ctypes.c_int32 * self.codec.coder.alphabet.symbols_per_word)()
        good = self._library.codec_encode(self._state, _doubles(measurement), symbols)
        return tuple(symbols) if good else None

    def step(self, word: Word, commands: Sequence[Vector]) -> bool:
        numbers, erased = self._word(word)
        flat = [value for command in commands for value in command]
        return bool(self._library.codec_step(self._state, numbers, erased, _doubles(flat)))

    def fly(self, word: Word, commands: Sequence[Vector]) -> list[Vector] | None:
        """Return the live states of a sample; None where Python has an exception."""
        numbers, erased = self._word(word)
        count, states = self.codec.ticks_per_sample, self.codec.model.state_size
        live = (_Double * (count * states))()
        flat = [value for command in commands for value in command]
        if not self._library.codec_fly(self._state, numbers, erased, _doubles(flat), live):
            return None
        return [tuple(live[at * states : (at + 1) * states]) for at in range(count)]

    def look(self, state: Vector, expected: bool, measurement: Vector, command: Vector) -> Vector:
        own = _doubles(state)
        good = self._library.codec_look(
            own, ctypes.c_bool(expected), _doubles(measurement), _doubles(command)
        )
        assert good
        return tuple(own)

    def pack(self) -> bytes:
        data = ctypes.create_string_buffer(self._bytes)
        self._library.codec_pack(self._state, data)
        return data.raw

    def unpack(self, data: bytes) -> bool:
        return bool(self._library.codec_unpack(self._state, data, ctypes.c_uint32(len(data))))

    def digest(self) -> int:
        return int(self._library.codec_digest(self._state))

    def probe(self) -> bytes:
        data = ctypes.create_string_buffer(8)
        assert self._library.codec_probe(data)
        return data.raw

    def _word(self, word: Word) -> tuple[ctypes.Array[ctypes.c_int32], ctypes.c_bool]:
        count = self.codec.coder.alphabet.symbols_per_word
        symbols = (0,) * count if word is ERASED else word
        return (ctypes.c_int32 * count)(*symbols), ctypes.c_bool(word is ERASED)


def _doubles(values: Sequence[float]) -> ctypes.Array[ctypes.c_double]:
    return (_Double * max(1, len(values)))(*values)
