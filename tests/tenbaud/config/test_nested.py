from __future__ import annotations

from typing import Any

import pytest

from tenbaud.cli import options
from tenbaud.config.load import ConfigError, nested


def test_when_fields_have_full_names_then_they_stand_in_their_sections() -> None:
    named = {"seed": 3, "coder.decay": 0.9, "transmitter.plant.mismatch": 0.1, "coder.kind": "zoom"}
    assert nested(named) == {
        "seed": 3,
        "coder": {"decay": 0.9, "kind": "zoom"},
        "transmitter": {"plant": {"mismatch": 0.1}},
    }


@pytest.mark.parametrize(
    "named",
    [
        {"coder": "zoom", "coder.kind": "zoom"},
        {"coder.kind": "zoom", "coder": "zoom"},
        {"transmitter.plant": 1, "transmitter.plant.pitch.kind": "pitch"},
    ],
)
def test_when_a_section_is_set_whole_and_in_parts_then_it_is_refused(
    named: dict[str, Any],
) -> None:
    with pytest.raises(ConfigError, match=r"^(coder|transmitter.plant) is set as a whole"):
        nested(named)


def test_when_a_field_is_set_twice_then_set_wins_and_the_last_one_of_several() -> None:
    values = options.overrides(
        lead=3, rig="simulated", settings=["seed=1", "timing.lead_ticks=4", "seed=2"]
    )
    assert values == {"timing": {"lead_ticks": 4}, "transmitter": {"rig": "simulated"}, "seed": 2}
