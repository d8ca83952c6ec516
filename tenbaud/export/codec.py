"""A codec as a program in C: its sizes, and the functions of its model and coder."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.resources import files
from typing import Any

from channel.codec.codec import Codec, is_estimate
from channel.codec.coders.base import FunctionCoder
from channel.codec.signals import signals_of
from channel.protocol.limits import limited
from channel.protocol.terms import Terms
from tenbaud.export.program import Program
from tenbaud.export.sample import (
    Parts,
    encode_word,
    fly_word,
    known_step,
    live_step,
    look,
    numbers_of,
    simulate,
)
from tenbaud.export.source import CannotExport
from tenbaud.export.values import DOUBLE, TRUTH, WHOLE, Array, Rows, Scalar, Static, literal
from transmitter.session.state_observer import StateObserver

WRITTEN = "/* Written by `tenbaud export-c`. */"
BY_HAND = files("tenbaud.export") / "c"
CODEC_FILES = ("arithmetic.h", "arithmetic.c", "blake2b.h", "blake2b.c", "codec.h", "codec.c")


def codec_files(codec: Codec, terms: Terms, observer: StateObserver | None) -> dict[str, str]:
    """Return the files of a codec by their names; CannotExport for one that is not functions.

    `observer`: that of the transmitter, for a coder that uses rates.
    """
    parts = parts_of(codec, terms, observer)
    found = {name: (BY_HAND / name).read_text(encoding="utf-8") for name in CODEC_FILES}
    return found | {"codec_sizes.h": sizes(codec, terms), "codec_program.h": program(codec, parts)}


def parts_of(codec: Codec, terms: Terms, observer: StateObserver | None) -> Parts:
    """Return the functions and constants of a codec; CannotExport where they are methods alone."""
    model, coder = codec.model, codec.coder
    row = getattr(model, "row_function", None)
    tick = Rows(row) if row else getattr(model, "tick_function", None)
    if tick is None:
        raise CannotExport(
            f"the model {type(model).__name__} has no tick_function and no row_function: "
            "write its tick as a function of numbers (docs/ARCHITECTURE.md, one text for each formula)"
        )
    if not isinstance(coder, FunctionCoder):
        raise CannotExport(
            f"the coder {type(coder).__name__} is no FunctionCoder: write encode and decode as "
            "functions of numbers (docs/ARCHITECTURE.md, one text for each formula)"
        )
    states = signals_of(model).output_states
    output = getattr(model, "output_function", None)
    if output is None and None in states:
        raise CannotExport(
            f"an output of the model {type(model).__name__} is no state: write it as output_function"
        )
    found = Parts(
        tick,
        output,
        coder.functions.encode,
        coder.functions.decode,
        model.constants,  # type: ignore[attr-defined]
        coder.constants,
        states,
        coder.impulse,
        codec.uses_rates,
        model.state_size,
        model.correction_size,
        codec.ticks_per_sample,
        terms.lead_ticks,
    )
    if observer is None:
        return found
    return found._replace(gains=observer.gains, anew=observer.anew, largest=observer.largest)


def program(codec: Codec, parts: Parts) -> str:
    """Return the functions of a codec, translated."""
    made, known = Program(), Static(parts)
    outputs, inputs = len(signals_of(codec.model).outputs), codec.model.input_size
    states, symbols = parts.states, codec.coder.alphabet.symbols_per_word
    ticks, number = parts.ticks_per_sample, Scalar(DOUBLE, "")

    def numbers(*shape: int, kind: str = DOUBLE) -> Array:
        return Array(kind, "", shape)

    model, coder, word = (
        numbers(states),
        numbers(len(codec.coder.initial())),
        numbers(symbols, kind=WHOLE),
    )
    measured = numbers(parts.corrected if parts.uses_rates else outputs)
    erased = Scalar(TRUTH, "")
    # First: others call it too, and a function has one name.
    made.function(is_estimate, (model,), "entry_is_estimate")
    made.function(encode_word, (known, model, coder, measured, word), "entry_encode")
    for name, step, lead, live in (
        ("entry_step", known_step, 0, Static(None)),
        ("entry_fly", live_step, parts.lead_ticks, numbers(ticks, states)),
    ):
        commands = numbers(ticks + lead, inputs)
        given = (
            known,
            Static(step),
            Static(lead),
            model,
            coder,
            word,
            erased,
            commands,
            model,
            coder,
            live,
        )
        made.function(fly_word, given, name)
    if parts.uses_rates:
        seen = (known, model, erased, numbers(outputs), numbers(inputs), model)
        made.function(look, seen, "entry_look")
    held = numbers(parts.corrected)
    made.function(
        simulate, (known, model, numbers(inputs), held, model, numbers(outputs)), "entry_simulate"
    )
    made.function(numbers_of, (number, numbers(3)), "entry_numbers")
    made.function(limited, (number,) * 4, "entry_limited")
    return f"{WRITTEN}\n{made.text()}"


def sizes(codec: Codec, terms: Terms) -> str:
    """Return the numbers that the codec's other files need."""
    model, coder = codec.model, codec.coder
    signals = signals_of(model)
    measured = model.correction_size if codec.uses_rates else len(signals.outputs)
    values: dict[str, Any] = {
        "STATES": model.state_size,
        "CODER_STATES": len(coder.initial()),
        "CORRECTED": model.correction_size,
        "INPUTS": model.input_size,
        "OUTPUTS": len(signals.outputs),
        "MEASURED": measured,
        "USES_RATES": int(codec.uses_rates),
        "ALPHABET_SIZE": len(coder.alphabet.symbols),
        "SYMBOLS_PER_WORD": coder.alphabet.symbols_per_word,
        "WORDS": coder.alphabet.words,
        "TICKS_PER_SAMPLE": codec.ticks_per_sample,
        "LEAD_TICKS": terms.lead_ticks,
        "ALPHABET": listed(coder.alphabet.symbols),
        "INITIAL_MODEL": listed(model.initial()),
        "INITIAL_CODER": listed(coder.initial()),
    }
    return header("CODEC", values)


def header(name: str, values: dict[str, Any]) -> str:
    """Return a file that defines values, the name before each."""
    guard = f"TENBAUD_{name}_VALUES_H"
    lines = [f"#define {name}_{key} {value}" for key, value in values.items()]
    return "\n".join([WRITTEN, f"#ifndef {guard}", f"#define {guard}", *lines, "#endif", ""])


def listed(values: Sequence[float]) -> str:
    """Return numbers as an initialiser; a zero where there is none."""
    return "{" + (", ".join([literal(one) for one in values]) or "0") + "}"
