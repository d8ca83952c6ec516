"""The codec in C has the bits of the codec in Python, for every preset."""

from __future__ import annotations

import math
import random
import re
import struct
from pathlib import Path

import pytest

from channel.codec.codec import ERASED, Codec, CodecState, Vector, Word
from channel.codec.lead import fly_sample
from channel.protocol.identity import numerics_probe
from tenbaud.build.ends import build_observer
from tenbaud.build.flight import Agreement, agree
from tenbaud.config.load import load_config, preset_names
from tenbaud.design.complete import completed
from tenbaud.export.codec import codec_files
from tests.tenbaud.export.compiled_codec import CompiledCodec, need
from transmitter.session.copies import CANNOT_FLY

SAMPLES, SOAK_SAMPLES = 60, 100_000
REPEATS = (
    *("heading-1baud", "integrator-10baud", "helicopter-10baud", "helicopter-30baud", "history-20baud"),
    *("paper-20baud", "pendulum-13baud", "pendulum-16baud", "tuned-20baud", "uiuc-16baud"),
    *("uiuc-25baud", "uiuc-50baud", "uiuc-history-25baud"),
)
"""The text in C is that of another preset with other numbers: `make soak` compiles these, for long."""
NUMBER = re.compile(r"-?\b\d[\w.]*(?:(?<=[ep])[-+]\d+)?")
ROW_OF_NUMBERS = re.compile(r"\{N(?:, N)*\}")
WILD = (0.0, -0.0, 1e-310, 1e9, -1e9, 1e300, math.inf, math.nan)


def processor_features() -> list[str]:
    path = Path("/proc/cpuinfo")
    return path.read_text().split() if path.exists() else []


def compiled(agreement: Agreement, folder: Path) -> CompiledCodec:
    need("gcc", "gcc")
    return CompiledCodec(agreement.codec, agreement.terms, build_observer(agreement), folder)


def agreed(preset: str) -> Agreement:
    return agree(load_config(preset), "real")


def random_word(codec: Codec, chance: random.Random) -> Word:
    alphabet = codec.coder.alphabet
    if chance.random() < 0.05:
        return ERASED
    return tuple(chance.choice(alphabet.symbols) for _ in range(alphabet.symbols_per_word))


def random_command(codec: Codec, chance: random.Random) -> Vector:
    return tuple(round(chance.uniform(-5.0, 5.0), 3) for _ in range(codec.model.input_size))


def asked(codec: Codec, state: CodecState, measurement: Vector) -> Word:
    """Return the word that Python has for a measurement; None where it has an exception."""
    try:
        return codec.encode(state, measurement)
    except CANNOT_FLY:
        return None


def compare(agreement: Agreement, folder: Path, samples: int, seed: int) -> None:
    """Compile once; flight, probe and observer must have the bits of Python."""
    made = compiled(agreement, folder)
    compare_flight(agreement, made, samples, seed)
    assert made.probe() == numerics_probe(agreement.codec)
    compare_observer(agreement, made)


def compare_flight(agreement: Agreement, made: CompiledCodec, samples: int, seed: int) -> None:
    """Fly both with the same words and commands; each state, word and digest must be equal.

    Half of the words are those that the encoder asks for, so that the flight stays near its course.
    """
    codec, lead = agreement.codec, agreement.terms.lead_ticks
    chance = random.Random(seed)
    state = codec.initial()
    assert made.pack() == codec.pack(state)
    faults = 0
    for _ in range(samples):
        where = f"seed {seed}, sample {state.sample}"
        spread = chance.choice((0.01, 1.0))
        measurement = tuple(one + chance.gauss(0.0, spread) for one in codec.predicted(state))
        if chance.random() < 0.05:
            measurement = tuple(chance.choice(WILD) for _ in measurement)
        word = asked(codec, state, measurement)
        assert made.encode(measurement) == word, where
        if word is None or chance.random() < 0.5:
            word = random_word(codec, chance)
        commands = [random_command(codec, chance) for _ in range(codec.ticks_per_sample)]
        try:
            state = codec.step(state, word, commands)
        except CANNOT_FLY:
            before = made.pack()
            assert not made.step(word, commands), where
            assert made.pack() == before, where
            faults += 1
            state = codec.initial()
            made.reset()
            continue
        assert made.step(word, commands), where
        assert made.pack() == codec.pack(state), where
        assert made.digest() == codec.digest(state), where
    assert faults < samples, "nothing was flown"
    known = [random_command(codec, chance) for _ in range(lead)]
    commands = [random_command(codec, chance) for _ in range(codec.ticks_per_sample)]
    arriving = iter(commands)
    flown = fly_sample(codec, codec.initial(), ERASED, known, lambda _tick, _state: next(arriving))
    made.reset()
    assert made.fly(ERASED, known + commands) == flown.live


def compare_observer(agreement: Agreement, made: CompiledCodec) -> None:
    """Show both the same measurements, some ticks left out; what they observe must be equal."""
    observer, chance = build_observer(agreement), random.Random(5)
    assert (observer is not None) == agreement.codec.uses_rates
    if observer is None:
        return
    state, tick, seen = agreement.codec.model.initial(), 0, -1
    command = random_command(agreement.codec, chance)
    for _ in range(300):
        measurement = tuple(chance.uniform(-0.5, 0.5) for _ in agreement.signals.outputs)
        state = made.look(state, tick == seen + 1 and tick > 0, measurement, command)
        corrected = observer.look(tick, measurement, command)
        assert state[: len(corrected)] == corrected
        seen, tick = tick, tick + chance.choice((1, 1, 1, 3))
        command = random_command(agreement.codec, chance)


@pytest.mark.parametrize("preset", [one for one in preset_names() if one not in REPEATS])
def test_the_codec_in_c_has_the_bits_of_python(preset: str, tmp_path: Path) -> None:
    compare(agreed(preset), tmp_path, SAMPLES, seed=1)


def test_presets_that_only_soak_compiles_differ_from_others_in_numbers_alone() -> None:
    texts = {preset: text_without_numbers(preset) for preset in preset_names()}
    compiled_here = {texts[preset] for preset in texts if preset not in REPEATS}
    assert [preset for preset in REPEATS if texts[preset] not in compiled_here] == []
    assert len(compiled_here) > 10, "the comparison leaves too little of the text"


def text_without_numbers(preset: str) -> str:
    """Return the exported C; a number, and a row of numbers however long, is N."""
    agreement = agreed(preset)
    files = codec_files(agreement.codec, agreement.terms, build_observer(agreement))
    text = NUMBER.sub("N", "".join(files.values())).replace("(N)", "N")
    return ROW_OF_NUMBERS.sub("{N}", text)


def test_a_codec_that_learns_its_plant_has_the_bits_of_python(tmp_path: Path) -> None:
    given = load_config("integrator-10baud").model_dump(mode="json", exclude_unset=True)
    learns = {"model": {**given["model"], "learns": True}, "coder": {"kind": "learning"}}
    config = load_config("integrator-10baud", None, completed(learns))
    compare(agree(config, "real"), tmp_path, SAMPLES, seed=3)


def test_a_state_comes_back_from_its_bytes_and_no_other_bytes_make_one(tmp_path: Path) -> None:
    agreement = agreed("paper-10baud")
    made, codec = compiled(agreement, tmp_path), agreement.codec
    state = codec.initial()._replace(sample=70_000, model=(0.1, -2.0, 3.0, -4.0))
    data = codec.pack(state)
    assert made.unpack(data)
    assert made.pack() == data
    for wrong in (
        data[:-1],
        data + b"\0",
        data[:-8] + struct.pack("<d", math.nan),
        b"",
        b"\xff" * len(data),
    ):
        assert not made.unpack(wrong)
    assert made.pack() == data


@pytest.mark.skipif("fma" not in processor_features(), reason="a processor with fused multiply-add")
def test_a_compiler_that_may_fuse_does_not(tmp_path: Path) -> None:
    """The header asks for what the flag would: here the command line asks for the opposite."""
    agreement = agreed("paper-10baud")
    need("gcc", "gcc")
    flags = ("-std=gnu11", "-O2", "-mfma", "-ffp-contract=fast")
    made = CompiledCodec(agreement.codec, agreement.terms, None, tmp_path, flags)
    assert made.probe() == numerics_probe(agreement.codec)


@pytest.mark.soak
@pytest.mark.parametrize("preset", preset_names())
def test_the_codec_in_c_has_the_bits_of_python_for_long(preset: str, tmp_path: Path) -> None:
    compare(agreed(preset), tmp_path, SOAK_SAMPLES, seed=2)
