"""Who an end is: configuration digest, numerics probe, and the fields in which two ends differ."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import fields, replace

import pytest

from channel.codec import numerics
from channel.codec.codec import Codec
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.models import pitch
from channel.codec.models.linear import LinearModel
from channel.codec.models.pitch import PitchModel, PitchParameters
from channel.protocol.identity import Identity, differing_fields, numerics_probe
from tests.channel.codec.chua import CHUA_TICK_S, CHUA_ZOOM, ChuaModel
from tests.channel.codec.parts import IMPULSE, THREE_SIGNS, pitch_codec
from tests.channel.codec.two_axes import TWO_AXES_ZOOM, TwoAxes

Real = Callable[[float], float]


def one_ulp_up(function: Real) -> Real:
    return lambda x: math.nextafter(function(x), math.inf)


def next_up(value: float) -> float:
    return math.nextafter(value, math.inf)


def probe_of(parameters: PitchParameters) -> bytes:
    return numerics_probe(Codec(PitchModel(parameters, 0.01), ZoomCoder(ZoomParameters()), 10))


def test_when_the_codec_is_the_same_then_the_probe_is_the_same() -> None:
    assert numerics_probe(pitch_codec()) == numerics_probe(pitch_codec())
    assert len(numerics_probe(pitch_codec())) == 8


def test_when_the_codec_differs_then_the_probe_differs() -> None:
    codecs = [
        pitch_codec(),
        pitch_codec(THREE_SIGNS),
        pitch_codec(IMPULSE),
        pitch_codec(ticks_per_sample=5),
        pitch_codec(tick_s=next_up(0.01)),
        Codec(TwoAxes(0.01), ZoomCoder(TWO_AXES_ZOOM), 10),
    ]
    assert len({numerics_probe(codec) for codec in codecs}) == len(codecs)


@pytest.mark.parametrize("name", ["sin", "cos", "exp"])
def test_when_a_function_differs_by_one_ulp_then_the_probe_differs(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    codec = pitch_codec()
    before = numerics_probe(codec)
    monkeypatch.setattr(numerics, name, one_ulp_up(getattr(numerics, name)))
    assert numerics_probe(codec) != before


def test_when_the_models_sine_differs_by_one_ulp_then_the_probe_differs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    codec = pitch_codec()
    before = numerics_probe(codec)
    monkeypatch.setattr(pitch, "sin", one_ulp_up(numerics.sin))
    assert numerics_probe(codec) != before


@pytest.mark.parametrize(
    "name",
    [field.name for field in fields(PitchParameters)],
)
def test_when_a_parameter_of_the_model_differs_by_a_millionth_then_the_probe_differs(name: str) -> None:
    paper = PitchParameters()
    changed = replace(paper, **{name: getattr(paper, name) * 1.000001})
    assert probe_of(changed) != probe_of(paper)


def test_when_the_model_has_no_inputs_then_it_can_be_probed() -> None:
    small = CHUA_ZOOM._replace(initial_range=0.05)
    assert len(numerics_probe(Codec(ChuaModel(CHUA_TICK_S), ZoomCoder(small), 2))) == 8


def test_when_configurations_differ_in_a_letter_then_their_digests_differ() -> None:
    one = Identity("1", '{"a": 1}', b"")
    assert len(one.config_digest) == 16
    assert one.config_digest == Identity("2", '{"a": 1}', b"x").config_digest
    assert one.config_digest != Identity("1", '{"a": 2}', b"").config_digest


def test_when_configurations_differ_then_each_field_is_named_with_both_values() -> None:
    ours = {"codec": {"coder": {"decay": 0.95, "window": 2}, "tick_s": 0.01}, "rate": 10, "same": [1]}
    theirs = {"codec": {"coder": {"decay": 0.9, "window": 2}}, "rate": 10, "same": [1], "new": None}
    assert differing_fields(json.dumps(ours), json.dumps(theirs)) == [
        "codec.coder.decay: here 0.95, there 0.9",
        "codec.tick_s: here 0.01, there (absent)",
        "new: here (absent), there None",
    ]


def test_when_configurations_are_equal_then_no_field_is_named() -> None:
    assert differing_fields('{"a": 1, "b": {"c": 2}}', '{"b": {"c": 2}, "a": 1}') == []


@pytest.mark.parametrize("theirs", ["", "{", "not json", '{"a": 1} and more'])
def test_when_the_peers_configuration_is_garbage_then_it_is_reported(theirs: str) -> None:
    assert differing_fields('{"a": 1}', theirs) == ["the peer's configuration cannot be read"]


@pytest.mark.parametrize("theirs", ["[1, 2]", "7", "null", '"text"'])
def test_when_the_peers_configuration_is_no_object_then_it_still_differs(theirs: str) -> None:
    assert differing_fields('{"a": 1}', theirs)


def test_when_the_peers_configuration_is_nested_too_deeply_then_it_cannot_be_read() -> None:
    theirs = "[" * 16_000
    assert differing_fields('{"a": 1}', theirs) == ["the peer's configuration cannot be read"]


def test_when_an_unstable_plant_diverges_in_the_probe_then_it_starts_again() -> None:
    fast = LinearModel(((1.5, 0.1), (0.0, 1.0)), ((0.0,), (1.0,)), ((1.0, 0.0),), 0.01, corrected=1)
    codec = Codec(fast, ZoomCoder(ZoomParameters(gains=((1.0,),))), 10)
    assert numerics_probe(codec) == numerics_probe(codec)
