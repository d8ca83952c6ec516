"""The functions of a codec compiled as the studies compile them, in the codec's place."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.bits.flight import LONGEST, OneWay, fly
from channel.codec.codec import Codec, Vector, Word
from tenbaud.studies.compiled import arrays_of, compiled, whole_of
from tests.golden.regenerate import FOLDER, GOLDEN_CODECS, codec_vectors, render


class CompiledModel:
    """A model whose tick is machine code."""

    def __init__(self, model: Any) -> None:
        self._model = model
        row = getattr(model, "row_function", None)
        self._tick = whole_of(row) if row else compiled(model.tick_function)
        self._constants = arrays_of(model.constants)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._model, name)

    def tick(self, state: Vector, command: Vector, held: Vector) -> Vector:
        moved: Vector = self._tick(state, command, held, self._constants)
        return moved


class CompiledCoder:
    """A coder whose functions are machine code."""

    def __init__(self, coder: Any) -> None:
        self._coder = coder
        self._constants = arrays_of(coder.constants)
        encode, decode, allocates = coder.functions
        self._encode = compiled(encode, allocates=allocates)
        self._decode = compiled(decode, allocates=allocates)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._coder, name)

    def encode(self, coder: Vector, predicted: Vector, measurement: Vector) -> tuple[int, ...]:
        symbols = np.zeros(self._coder.alphabet.symbols_per_word, dtype=np.int64)
        self._encode(
            self._constants, np.array(coder), np.array(predicted), np.array(measurement), symbols
        )
        return tuple(symbols.tolist())

    def decode(self, coder: Vector, state: Vector, word: Word) -> tuple[Vector, Vector]:
        correction, after = np.zeros(self._coder.correction_size), np.zeros(len(coder))
        symbols = np.array(word or (0,) * self._coder.alphabet.symbols_per_word)
        self._decode(
            *(self._constants, np.array(coder), np.array(state), symbols, word is None),
            *(correction, after),
        )
        return tuple(correction.tolist()), tuple(after.tolist())


def compiled_report(samples: int, others: int) -> str:
    """Return what `report` does, of the compiled functions."""
    codecs = {
        name: Codec(CompiledModel(one.model), CompiledCoder(one.coder), one.ticks_per_sample)
        for name, one in GOLDEN_CODECS.items()
    }
    expected = (FOLDER / "codec.json").read_text(encoding="utf-8")
    lines = [f"golden;codec;{int(render(codec_vectors(codecs)) != expected)}"]
    for name, codec in codecs.items():
        flown = fly(OneWay(codec), samples if name == LONGEST else others)
        lines.append(f"flight;{name};{';'.join(flown)}")
    return "\n".join([*lines, "end"])
