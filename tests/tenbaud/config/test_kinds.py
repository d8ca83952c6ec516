"""Sections that come in kinds: which one is meant, what it takes, and how errors name it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from channel.codec.coders.open_loop_zoom import OpenLoopZoomCoder
from channel.codec.coders.pcm import PcmCoder
from channel.codec.coders.zoom import ZoomCoder
from tenbaud.build.flight import agree
from tenbaud.config.load import ConfigError, dump_config, load_config, preset_names


@pytest.mark.parametrize("preset", preset_names())
def test_when_a_preset_is_dumped_and_loaded_then_it_makes_the_same_flight(
    preset: str, tmp_path: Path
) -> None:
    config = load_config(preset)
    written = tmp_path / "config.toml"
    written.write_text(dump_config(config))
    again = load_config(None, written)
    assert again == config
    assert agree(again, "virtual").identity == agree(config, "virtual").identity


@pytest.mark.parametrize(
    ("preset", "coder"),
    [
        ("paper-10baud", ZoomCoder),
        ("fixed-10baud", OpenLoopZoomCoder),
        ("open-loop-zoom-10baud", OpenLoopZoomCoder),
        ("usual-1000baud", PcmCoder),
    ],
)
def test_when_a_preset_names_no_kind_or_another_then_that_coder_is_built(
    preset: str, coder: type
) -> None:
    assert type(agree(load_config(preset), "virtual").codec.coder) is coder


@pytest.mark.parametrize(
    ("model", "given", "kind"),
    [
        ("pitch", "auto", "pitch"),
        ("hold", "auto", "pitch"),
        ("pendulum", "auto", "pendulum"),
        ("linear", "auto", "linear"),
        ("linear", "pendulum", "pendulum"),
        ("my:Model", "auto", "pitch"),
    ],
)
def test_when_no_plant_is_named_then_it_is_the_model_s(model: str, given: str, kind: str) -> None:
    section = {"kind": model} | (
        {"C": [[1.0]], "A": [[0.0]], "B": [[1.0]]} if model == "linear" else {}
    )
    overrides = {"model": section, "transmitter": {"plant": {"kind": given}}}
    assert load_config("paper-10baud", None, overrides).plant_kind == kind


def test_when_the_kind_changes_then_fields_of_the_old_kind_are_gone() -> None:
    config = load_config("paper-10baud", None, {"coder": {"kind": "fixed", "range_rad": 0.2}})
    assert config.coder.kind == "fixed"


def test_when_the_kind_is_repeated_then_the_preset_s_fields_stay() -> None:
    config = load_config("paper-20baud", None, {"coder": {"kind": "zoom", "decay": 0.9}})
    assert config.coder.model_dump()["minimum_range_rad"] == 0.05


@pytest.mark.parametrize(
    ("overrides", "text"),
    [
        ({"coder": {"kind": "zom"}}, "coder.kind = 'zom': known are zoom, fixed"),
        ({"model": {"kind": "pich"}}, "model.kind = 'pich': known are pitch, hold"),
        ({"coder": {"windw_signs": 3}}, "coder.windw_signs: unknown field; did you mean window_signs"),
        ({"downlink": "narrow"}, r"a section with the fields scheme, .* mean channel\.downlink or"),
        ({"coder": {"kind": "fixed", "window_signs": 3}}, "coder.window_signs: unknown field"),
        ({"coder": {"decay": 2.0}}, "coder.decay = 2.0"),
    ],
)
def test_when_a_field_is_wrong_then_its_name_has_no_kind_in_it(
    overrides: dict[str, Any], text: str
) -> None:
    with pytest.raises(ConfigError, match=text):
        load_config("paper-10baud", None, overrides)


def test_when_coder_and_model_do_not_go_together_then_both_are_named() -> None:
    with pytest.raises(ConfigError, match=r"coder\.kind = 'pcm' and model\.kind = 'pitch'"):
        agree(load_config("paper-10baud", None, {"coder": {"kind": "pcm"}}), "virtual")
