"""A preset as objects: the parts of the flight of `tenbaud demo --preset NAME`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from channel.codec.codec import Codec
from channel.protocol.terms import Terms
from plant_sim.plant import Plant
from receiver.controllers.base import Controller
from tenbaud.build.controllers import build_controller
from tenbaud.build.flight import agree
from tenbaud.build.rig import build_plant
from tenbaud.config.load import load_config, nested
from tenbaud.config.schema import FlightConfig


@dataclass(frozen=True, slots=True)
class Preset:
    """The parts of a flight, each new: the plant and the controller are at their beginning."""

    config: FlightConfig
    """every setting, checked"""
    codec: Codec
    terms: Terms
    plant: Plant
    controller: Controller


def load_preset(name: str, settings: Mapping[str, Any] | None = None) -> Preset:
    """Return the parts of a preset, for the virtual clock.

    `settings` are fields by their full names that are to differ, `{"transmitter.plant.mismatch": 0.1}`.
    Raises ConfigError for an unknown name, field or value.
    """
    config = load_config(name, overrides=nested(settings or {}), allow_code=True)
    agreement = agree(config, "virtual")
    plant = build_plant(config, config.timing.tick_s)
    return Preset(config, agreement.codec, agreement.terms, plant, build_controller(config))
