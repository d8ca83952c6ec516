"""The exported codecs as programs, for this processor and for those that QEMU emulates."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from channel.codec.codec import Codec
from channel.codec.models.pitch import PITCH_SIGNALS
from channel.protocol.limits import from_steps
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.export.codec import BY_HAND, codec_files
from tenbaud.export.values import literal
from tests.golden.regenerate import FOLDER
from transmitter.session.state_observer import StateObserver

PROGRAM = "flight"
FLAGS = ("-std=c99", "-O2", "-Wall", "-Werror", "-ffp-contract=off", "-o", PROGRAM)
SOURCES = ("flight.c", "arithmetic.c", "blake2b.c")
NUMBERS = ("sin", "cos", "exp")


class Target(NamedTuple):
    """A processor to compile for."""

    compiler: tuple[str, ...]
    run: tuple[str, ...] = ()
    """how the program is run"""
    sources: tuple[str, ...] = ()
    """beside those of all"""


HOST = Target(("gcc",), (PROGRAM,))
AARCH64 = Target(("aarch64-linux-gnu-gcc", "-static"), ("qemu-aarch64", PROGRAM))
CORTEX_M3 = Target(
    (
        *("arm-none-eabi-gcc", "-mcpu=cortex-m3", "-mthumb", "-nostdlib", "-T", "lm3s6965.ld"),
        *("-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections"),
    ),
    (
        *("qemu-system-arm", "-M", "lm3s6965evb", "-nographic", "-monitor", "none"),
        *("-semihosting", "-serial", "stdio", "-kernel", PROGRAM),
    ),
    ("start.c", "-lgcc"),
)


def write_sources(name: str, codec: Codec, folder: Path) -> None:
    """Write the program of a golden codec."""
    # Of the terms a codec alone needs the lead, which this flight does not use.
    terms = agree(load_config("paper-10baud"), "virtual").terms
    files = codec_files(codec, terms, no_observer(codec))
    files["flight.c"] = Path(__file__).with_name("flight.c").read_text(encoding="utf-8")
    files["golden.h"] = golden_header(name, codec)
    for board in ("board.h", "start.c", "lm3s6965.ld"):
        files[board] = (BY_HAND / "qemu" / board).read_text(encoding="utf-8")
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")


def no_observer(codec: Codec) -> StateObserver | None:
    """Return one that sees nothing, where an exported codec has one: here all states are given."""
    model = codec.model
    outputs = len(model.measured(model.initial()))
    rows = ((0.0,) * outputs,) * model.state_size
    return StateObserver(model, rows, rows, (1.0,) * model.state_size) if codec.uses_rates else None


def golden_header(name: str, codec: Codec) -> str:
    """Return the golden vectors of a codec, and of the functions, as tables."""
    rows = json.loads((FOLDER / "codec.json").read_text(encoding="utf-8"))[name]
    numbers = json.loads((FOLDER / "numerics.json").read_text(encoding="utf-8"))
    words: list[str] = []
    erased: list[str] = []
    commands: list[str] = []
    digests: list[str] = []
    for word, steps, digest, _, _ in rows:
        words.append(braced(word or [0] * codec.coder.alphabet.symbols_per_word))
        erased.append("false" if word else "true")
        ticks = [from_steps(steps[at : at + 2], PITCH_SIGNALS) for at in range(0, len(steps), 2)]
        commands.append(braced([literal(value) for tick in ticks for value in tick]))
        digests.append(f"0x{digest}u")
    pairs = [
        f"{{{place}, 0x{bits(x)}u, 0x{bits(y)}u}}"
        for place, function in enumerate(NUMBERS)
        for x, y in numbers[function]
    ]
    return f"""enum {{ GOLDEN_SAMPLES = {len(rows)}, GOLDEN_NUMBERS = {len(pairs)} }};
static const int32_t golden_words[GOLDEN_SAMPLES][CODEC_SYMBOLS_PER_WORD] = {braced(words)};
static const bool golden_erased[GOLDEN_SAMPLES] = {braced(erased)};
static const double golden_commands[GOLDEN_SAMPLES][CODEC_TICKS_PER_SAMPLE * CODEC_INPUTS] =
    {braced(commands)};
static const uint64_t golden_digests[GOLDEN_SAMPLES] = {braced(digests)};
static const struct {{ int32_t function; uint64_t argument, result; }} golden_numbers[] =
    {braced(pairs)};
"""


def braced(values: Sequence[object]) -> str:
    return "{" + ", ".join(map(str, values)) + "}"


def bits(number: str) -> str:
    """Return the 64 bits of a number in hexadecimal notation."""
    return struct.pack(">d", float.fromhex(number)).hex()
