"""The recorded flight of a configuration, read once as long as its files stay the same."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from channel.codec.signals import Signals
from channel.flight_log import FlightLog
from plant_sim.encoder import OutputReader
from tenbaud.build.signals import build_encoders, configured_signals
from tenbaud.config.schema import FlightConfig, FlightLogSection


def read_flight_log(config: FlightConfig, signals: Signals | None = None) -> FlightLog:
    """Return the recorded flight that a configuration names; LogError where it cannot be used.

    `signals` take the place of those of the configured model.
    """
    signals = signals or configured_signals(config)
    section, encoders = config.flight_log, build_encoders(config, signals)
    files = [Path(one) for one in (section.file, f"{section.file}.toml", *section.join)]
    changed = tuple([one.stat().st_mtime_ns if one.is_file() else 0 for one in files])
    return _read(
        section.model_dump_json(exclude_unset=True), signals, encoders, config.timing.tick_s, changed
    )


@lru_cache(maxsize=4)
def _read(
    section: str,
    signals: Signals,
    encoders: tuple[OutputReader, ...],
    tick_s: float,
    changed: tuple[int, ...],
) -> FlightLog:
    # pandas is slow to load, and few flights read a log.
    from tenbaud.log.read import read_log

    return read_log(FlightLogSection.model_validate_json(section), signals, encoders, tick_s)
