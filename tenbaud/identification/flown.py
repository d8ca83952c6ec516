"""The record, flown with the model identified from it, and with a coder fitted to it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from channel.errors import TenbaudError
from tenbaud.build.recorded import flight_config
from tenbaud.config.load import merged
from tenbaud.config.schema import FlightConfig
from tenbaud.studies.figures import FlightFigures

PLAIN_TICKS = 10_000
"""flown faster by the sessions than a flight is compiled"""


class Flown(NamedTuple):
    """The result of the flight."""

    outcome: str
    """ok, or why there are no figures"""
    rate_bit_s: float
    outputs: tuple[tuple[str, float, float, float], ...]
    """name, rms and largest error, and largest value of each output, in its unit"""

    @property
    def error(self) -> float:
        """Return the rms error in units of the largest values; infinite without a whole flight."""
        shares = [rms / largest for _, rms, _, largest in self.outputs if largest]
        return math.hypot(*shares) if self.outcome == "ok" and shares else math.inf

    def sentence(self) -> str:
        if self.outcome != "ok":
            return f"the record could not be flown with it: {self.outcome}"
        parts = [
            f"{name}: rms error {100.0 * rms / largest:.2g} %, largest {100.0 * most / largest:.2g} % "
            f"of the largest value {largest:.4g}"
            for name, rms, most, largest in self.outputs
            if largest
        ]
        return f"flown over the record at {self.rate_bit_s:g} bit/s: {'; '.join(parts)}"


def replayed(values: Mapping[str, Any]) -> FlightConfig:
    """Return the configuration with which `tenbaud demo --rig replay` flies settings, once written."""
    over = {
        "transmitter": {"rig": "replay"},
        "receiver": {"controller": "recorded"},
        "link": {"kind": "memory"},
    }
    return flight_config(values["preset"], None, merged(dict(values), over))


def fly_record(values: Mapping[str, Any]) -> Flown:
    """Fly the log that settings name with the model and the coder in them."""
    from tenbaud.build.codec import configured_rate
    from tenbaud.build.signals import configured_signals

    config = replayed(values)
    figures = _fly(config)
    names = [one.name for one in configured_signals(config).outputs]
    return Flown(
        figures.outcome,
        configured_rate(config),
        tuple(
            (name, one.error_live_rms, one.error_live_max, one.amplitude)
            for name, one in zip(names, figures.outputs, strict=False)
        ),
    )


def _fly(config: FlightConfig) -> FlightFigures:
    from tenbaud.studies.chunk import fly_point

    seeds = (config.seed,)
    if config.duration_s > PLAIN_TICKS * config.timing.tick_s:
        with suppress(ImportError):  # numba is an extra
            return fly_point(config, seeds, "auto")[0]
    return fly_point(config, seeds, "plain")[0]


def with_coder(values: Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    """Return settings with a coder fitted quickly to their record, and a note where it could not be.

    Then the coder stays that of the preset, or as it was designed for a linear model.
    """
    settings = dict(values)
    try:
        from tenbaud.studies.quick import quick_coder

        found = quick_coder(replayed(settings))
    except ImportError as error:
        missing = f"{error.name} is missing: install tenbaud[studies]"
        return settings, f"the coder was not fitted to the record, as {missing}"
    except TenbaudError as error:
        return settings, f"the coder was not fitted to the record: {error}"
    return merged(settings, found.sections), ""
