"""The recorded flight of a configuration, read again only if its files change."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from channel.codec.signals import Signals
from channel.flight_log import FlightLog
from plant_sim.encoder import OutputReader
from tenbaud.build.signals import build_encoders, configured_signals, encoder_steps
from tenbaud.config.schema import FlightConfig, FlightLogSection

SAME = 1e-3
"""Share by which rows may lie further apart than ticks, and still be one for each."""


def read_flight_log(config: FlightConfig, signals: Signals | None = None) -> FlightLog:
    """Return the recorded flight that a configuration names, in its ticks; LogError without one.

    `signals` take the place of those of the configured model.
    """
    return _recording_of(config, signals).at(config.timing.tick_s)


def recorded_tick_s(config: FlightConfig) -> float:
    """Return the time between two rows of the recorded flight that a configuration names."""
    return _recording_of(config, None).log(config.timing.tick_s).tick_s


def output_steps(config: FlightConfig, signals: Signals) -> list[float]:
    """Return how far the values of each output lie apart on its rig; 0 where it is read exactly."""
    if config.transmitter.rig == "replay":
        return list(read_flight_log(config, signals).steps)
    return encoder_steps(config, signals)


def _recording_of(config: FlightConfig, signals: Signals | None) -> _Recording:
    signals = signals or configured_signals(config)
    section, encoders = config.flight_log, build_encoders(config, signals)
    changed = tuple(map(_changed, (section.file, f"{section.file}.toml", *section.join)))
    text = section.as_text(exclude_unset=True, exclude={"digest"})
    return _recording(text, signals, encoders, changed)


def _changed(name: str) -> tuple[tuple[str, int, int], ...]:
    """Return a stamp that changes with a file, or with one in a folder."""
    path = Path(name)
    files = sorted(path.iterdir()) if path.is_dir() else [path]
    stats = [(one.name, one.stat()) for one in files if one.is_file()]
    return tuple([(own, stat.st_size, stat.st_mtime_ns) for own, stat in stats])


@lru_cache(maxsize=2)
def _recording(
    section: str, signals: Signals, encoders: tuple[OutputReader, ...], changed: tuple[Any, ...]
) -> _Recording:
    return _Recording(FlightLogSection.of_text(section), signals, encoders)


class _Recording:
    """One recording, as its file has it and in ticks of a flight."""

    def __init__(
        self, section: FlightLogSection, signals: Signals, encoders: tuple[OutputReader, ...]
    ) -> None:
        self._section, self._signals, self._encoders = section, signals, encoders
        self._log: FlightLog | None = None
        self._asked_s = 0.0
        self._in_ticks: FlightLog | None = None

    def log(self, tick_s: float) -> FlightLog:
        """Return the log as its file has it; `tick_s` lies between rows where the file does not say."""
        known = self._log is not None and (tick_s == self._asked_s or self._log.tick_s != self._asked_s)
        if self._log is None or not known:
            # pandas is slow to load, and few flights read a log.
            from tenbaud.log.read import read_log

            self._log = read_log(self._section, self._signals, self._encoders, tick_s)
            self._asked_s = tick_s
        return self._log

    def at(self, tick_s: float) -> FlightLog:
        """Return the log with a row for every tick."""
        log = self.log(tick_s)
        if math.isclose(log.tick_s, tick_s, rel_tol=SAME):
            return log
        if self._in_ticks is None or self._in_ticks.tick_s != tick_s:
            self._in_ticks = _resampled(log, tick_s)
        return self._in_ticks


def _resampled(log: FlightLog, tick_s: float) -> FlightLog:
    """Return a log at other times: measured values between rows, commands held from row to row."""
    count = math.floor(len(log) * log.tick_s / tick_s + 1e-6)
    times = np.arange(count) * (tick_s / log.tick_s)
    held = np.minimum(np.floor(times + 1e-6).astype(np.int64), len(log) - 1)
    rows = np.arange(len(log))
    columns = [np.interp(times, rows, column) for column in log.measured.T]
    return replace(
        log,
        tick_s=tick_s,
        measured=np.column_stack(columns),
        commands=log.commands[held],
        counts=log.counts[np.minimum(np.rint(times).astype(np.int64), len(log) - 1)],
        notes=(*log.notes, f"resampled: rows {log.tick_s:g} s apart, ticks {tick_s:g} s"),
    )
