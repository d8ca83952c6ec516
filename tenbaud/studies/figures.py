"""The figures that a study keeps of a flight, and its checks before the flight."""

from __future__ import annotations

import math
from typing import NamedTuple

from channel.protocol.identity import Identity
from tenbaud.build.codec import build_codec
from tenbaud.build.flight import REAL_RIGS, Agreement, checked_terms
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.schema import FlightConfig


class OutputFigures(NamedTuple):
    """The figures of one output, in its unit; NaN where there is none."""

    error_coded_rms: float = math.nan
    error_coded_max: float = math.nan
    error_live_rms: float = math.nan
    error_live_max: float = math.nan
    tracking_rms: float = math.nan
    amplitude: float = math.nan


class FlightFigures(NamedTuple):
    """The figures that a study keeps of one flight."""

    outcome: str
    """ok, or why the flight has no figures"""
    engine: str
    """compiled, or plain: flown by the nodes themselves"""
    not_compiled: str
    """why the nodes flew it; empty if they did not, or were asked to"""
    outputs: tuple[OutputFigures, ...]
    """none of a flight without figures"""
    erasures: int
    commands_late: int
    samples: int

    @property
    def first(self) -> OutputFigures:
        return self.outputs[0] if self.outputs else OutputFigures()


def shared_parts(config: FlightConfig) -> Agreement:
    """Return what both ends would agree on, without the handshake's identity; ConfigError."""
    if config.transmitter.rig in REAL_RIGS:
        raise ConfigError(
            f"the {config.transmitter.rig} rig moves in real time and cannot be flown some hundred "
            "times: record a flight of it and replay that"
        )
    with config_errors():
        codec = build_codec(config)
        terms = checked_terms(config, codec, "virtual")
    return Agreement(config, "virtual", codec, terms, Identity("", "", b""))
