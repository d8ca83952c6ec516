"""The codec as a state machine: inputs, bytes, digest, divergence."""

from __future__ import annotations

import math
import random
import struct
from typing import Any

import pytest

from channel.codec.codec import ERASED, STATE_MAX, Codec, CodecState, Vector, Word
from channel.codec.coders.zoom import ZoomCoder
from channel.errors import CodecDiverged
from tests.channel.codec.chua import CHUA_TICK_S, CHUA_ZOOM, ChuaModel
from tests.channel.codec.parts import IMPULSE, PAPER, THREE_SIGNS, pitch_codec
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes

SEED = 20240611


CODECS = {
    "paper": pitch_codec(PAPER),
    "three signs": pitch_codec(THREE_SIGNS, ticks_per_sample=5),
    "impulse": pitch_codec(IMPULSE),
    "two axes": Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), 4),
    "chua": Codec(ChuaModel(CHUA_TICK_S), ZoomCoder(CHUA_ZOOM), 10),
}
every_codec = pytest.mark.parametrize("codec", CODECS.values(), ids=CODECS.keys())


def random_inputs(codec: Codec, samples: int, seed: int = SEED) -> list[tuple[Word, list[Vector]]]:
    """Return a word (one in eight erased) and commands for each sample."""
    chooser = random.Random(seed)
    alphabet = codec.coder.alphabet
    inputs = []
    for _ in range(samples):
        symbols = tuple(chooser.choice(alphabet.symbols) for _ in range(alphabet.symbols_per_word))
        word = ERASED if chooser.random() < 0.125 else symbols
        commands = [
            tuple(chooser.randrange(-5000, 5001) / 1000.0 for _ in range(codec.model.input_size))
            for _ in range(codec.ticks_per_sample)
        ]
        inputs.append((word, commands))
    return inputs


def last_bit_flipped(value: float) -> float:
    (bits,) = struct.unpack("<q", struct.pack("<d", value))
    (flipped,) = struct.unpack("<d", struct.pack("<q", bits ^ 1))
    return flipped


def replaced(values: Vector, index: int, value: float) -> Vector:
    return (*values[:index], value, *values[index + 1 :])


@pytest.mark.parametrize("found", [(2,), (-1,), (0, 0), None, ("x",)])
def test_when_a_coder_does_not_say_what_a_word_is_about_then_nobody_says(found: Any) -> None:
    class Told(ZoomCoder):
        def about(self, *_given: object) -> Any:
            return found

    codec = Codec(pitch_codec().model, Told(PAPER), 10)
    state = codec.initial()
    assert codec.about(state, (1,), state.model) is None


@every_codec
def test_when_inputs_are_equal_then_states_are_equal(codec: Codec) -> None:
    first = second = codec.initial()
    for word, commands in random_inputs(codec, 50):
        first = codec.step(first, word, commands)
        second = codec.step(second, word, list(commands))
        assert first == second
        assert codec.digest(first) == codec.digest(second)
    assert first.sample == 50


@every_codec
def test_when_a_state_is_saved_and_restored_before_every_step_then_nothing_changes(
    codec: Codec,
) -> None:
    straight = restored = codec.initial()
    for word, commands in random_inputs(codec, 100):
        straight = codec.step(straight, word, commands)
        restored = codec.step(codec.unpack(codec.pack(restored)), word, commands)
        assert codec.pack(restored) == codec.pack(straight), f"seed {SEED}"


@every_codec
def test_when_one_word_differs_then_the_digests_differ_from_there_on(codec: Codec) -> None:
    inputs = random_inputs(codec, 20)
    original = changed = codec.initial()
    for sample, (word, commands) in enumerate(inputs):
        flipped = word
        if sample == 7:
            flipped = ERASED if word is not ERASED else (1,) * codec.coder.alphabet.symbols_per_word
        original = codec.step(original, word, commands)
        changed = codec.step(changed, flipped, commands)
        assert (codec.digest(original) == codec.digest(changed)) == (sample < 7)


@every_codec
def test_when_a_sample_is_traced_then_it_starts_at_the_open_state_and_ends_as_step(
    codec: Codec,
) -> None:
    state = codec.initial()
    for word, commands in random_inputs(codec, 5):
        after, states = codec.trace(state, word, commands)
        assert len(states) == codec.ticks_per_sample
        assert states[0] == codec.open(state, word).model
        held = codec.open(state, word).held
        assert after.model == codec.model.tick(states[-1], commands[-1], held)
        assert after == codec.step(state, word, commands)
        state = after


def test_when_the_correction_is_held_then_it_is_added_to_the_derivative_all_sample_long() -> None:
    codec = pitch_codec(PAPER)
    opened = codec.open(codec.initial(), (1,))
    assert opened.model == codec.initial().model
    assert opened.held == (4.1 * 0.5, 8.6 * 0.5)


def test_when_the_correction_is_an_impulse_then_it_is_added_to_the_state_once() -> None:
    codec = pitch_codec(IMPULSE)
    state = CodecState(0, (0.1, -0.2, 1.0, 2.0), codec.initial().coder)
    opened = codec.open(state, (-1,))
    assert opened.held == (0.0, 0.0)
    assert opened.model == (0.1 - 0.4 * 0.5, -0.2 - 0.6 * 0.5, 1.0, 2.0)


@every_codec
def test_when_a_word_is_erased_then_nothing_is_corrected(codec: Codec) -> None:
    state = codec.initial()
    for word, commands in random_inputs(codec, 3):
        state = codec.step(state, word, commands)
    opened = codec.open(state, ERASED)
    assert opened.model == state.model
    assert opened.held == codec.nothing_held


@every_codec
def test_when_a_state_is_packed_then_unpacking_gives_it_back(codec: Codec) -> None:
    state = codec.initial()
    for word, commands in random_inputs(codec, 30):
        state = codec.step(state, word, commands)
        assert codec.unpack(codec.pack(state)) == state


@every_codec
def test_when_a_zero_is_negative_then_bytes_and_digest_are_those_of_plain_zero(codec: Codec) -> None:
    state = codec.initial()
    sizes = len(state.model), len(state.coder)
    plain = CodecState(3, (0.0,) * sizes[0], (0.0,) * sizes[1])
    negative = CodecState(3, (-0.0,) * sizes[0], (-0.0,) * sizes[1])
    assert codec.pack(negative) == codec.pack(plain)
    assert codec.digest(negative) == codec.digest(plain)
    assert struct.pack("<d", -0.0)[-1:] not in codec.pack(negative)


@every_codec
def test_when_any_single_field_changes_by_its_last_bit_then_the_digest_changes(codec: Codec) -> None:
    state = codec.initial()
    for word, commands in random_inputs(codec, 9):
        state = codec.step(state, word, commands)
    variants = [state, state._replace(sample=state.sample + 1)]
    for index, value in enumerate(state.model):
        variants.append(state._replace(model=replaced(state.model, index, last_bit_flipped(value))))
    for index, value in enumerate(state.coder):
        variants.append(state._replace(coder=replaced(state.coder, index, last_bit_flipped(value))))
    digests = {codec.digest(variant) for variant in variants}
    assert len(digests) == len(variants) == 2 + len(state.model) + len(state.coder)
    assert all(0 <= digest < 2**64 for digest in digests)


def test_when_bytes_have_another_length_then_unpack_names_both() -> None:
    codec = pitch_codec()
    data = codec.pack(codec.initial())
    for wrong in (b"", data[:-1], data + b"\0"):
        with pytest.raises(ValueError) as caught:
            codec.unpack(wrong)
        assert f"{len(data)} bytes, got {len(wrong)}" in str(caught.value)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_when_packed_values_are_not_finite_then_unpack_refuses(value: float) -> None:
    codec = pitch_codec()
    state = codec.initial()
    for place in range(len(state.model)):
        data = codec.pack(state._replace(model=replaced(state.model, place, value)))
        with pytest.raises(ValueError, match="not finite"):
            codec.unpack(data)


def test_when_a_packed_index_is_negative_then_unpack_refuses() -> None:
    codec = pitch_codec()
    with pytest.raises(ValueError, match="negative index"):
        codec.unpack(codec.pack(codec.initial()._replace(sample=-1)))


@pytest.mark.parametrize("count", [0, 1, 9, 11])
def test_when_the_number_of_commands_is_wrong_then_the_step_refuses(count: int) -> None:
    codec = pitch_codec()
    with pytest.raises(ValueError, match=f"10 ticks, got {count}"):
        codec.step(codec.initial(), (1,), [(0.0, 0.0)] * count)


def test_when_a_command_has_too_many_voltages_then_the_step_refuses() -> None:
    codec = pitch_codec()
    with pytest.raises(ValueError):
        codec.step(codec.initial(), (1,), [(0.0, 0.0, 0.0)] * 10)


@pytest.mark.parametrize("ticks", [0, -1])
def test_when_a_sample_has_no_tick_then_the_codec_is_refused(ticks: int) -> None:
    with pytest.raises(ValueError, match="at least one tick"):
        pitch_codec(ticks_per_sample=ticks)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, STATE_MAX, -STATE_MAX])
def test_when_a_state_leaves_every_sensible_range_then_closing_it_reports_divergence(
    value: float,
) -> None:
    codec = pitch_codec()
    state = codec.initial()._replace(sample=41)
    opened = codec.open(state, (1,))
    for place in range(4):
        with pytest.raises(CodecDiverged, match="sample 41"):
            codec.close(state, opened, replaced(opened.model, place, value))


def test_when_commands_drive_the_estimate_away_then_divergence_is_reported() -> None:
    codec = Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), 4)
    state = codec.step(codec.initial(), ERASED, [(20.0 * STATE_MAX, 0.0)] * 4)
    with pytest.raises(CodecDiverged, match="diverged at sample 1"):
        codec.step(state, ERASED, [(20.0 * STATE_MAX, 0.0)] * 4)


def test_when_the_angle_is_beyond_what_sine_takes_then_divergence_is_reported() -> None:
    codec = pitch_codec()
    state = codec.initial()._replace(model=(0.0, 4e4, 0.0, 0.0))
    with pytest.raises(CodecDiverged):  # noqa: PT012 - which step it is does not matter
        for _ in range(100):
            state = codec.step(state, (1,), [(0.0, 0.0)] * 10)


@every_codec
def test_when_the_measurement_equals_the_prediction_then_every_sign_is_plus(codec: Codec) -> None:
    state = codec.initial()
    measurement = codec.model.measured(state.model)
    assert codec.encode(state, measurement) == (1,) * len(measurement)
    below = tuple(math.nextafter(value, -1.0) for value in measurement)
    assert codec.encode(state, below) == (-1,) * len(measurement)
