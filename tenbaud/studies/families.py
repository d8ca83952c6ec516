"""Coders of one kind with a few numbers to choose, each a share of its range from 0 to 1.

A fit of few numbers needs few flights and follows a record's chances less than one of whole tables.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

from tenbaud.config.coders import DirectionCoderSection, HistoryCoderSection
from tenbaud.config.load import load_config
from tenbaud.config.models import LinearModelSection
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed


class HistoryFamily:
    """The coder `history`: its table for white torque with other sizes, growths, range and floor."""

    FLOOR_GAIN = 0.06
    RANGE = (1e-5, 1.0)
    """of the smallest range, rad"""

    def __init__(self, config: FlightConfig) -> None:
        """Take the table of the preset of this coder."""
        self._config = config
        self._table = load_config("history-10baud").coder
        # Beyond this a rate is the encoder's steps.
        self._fastest = min(200.0, 1.0 / config.timing.tick_s)
        self.scan: Sequence[Sequence[float]]
        """points to begin with; the best one is where the search starts"""
        middle = (0.5, 0.5, 0.5, 0.25)
        self.scan = tuple((*middle, size / 12.0, 0.3, 0.6) for size in range(2, 12))

    def at(self, shares: Sequence[float]) -> FlightConfig:
        angle, rate, growth, run, smallest, exponent, bandwidth = shares
        assert isinstance(self._table, HistoryCoderSection)
        rows = [
            [a * between(0.4, 2.5, angle), b * between(0.4, 2.5, rate), g * between(0.8, 1.25, growth)]
            for a, b, g in self._table.rows
        ]
        rows[-1][2] *= between(0.8, 2.0, run)
        minimum = between(*self.RANGE, smallest)
        coder = HistoryCoderSection(
            rows=tuple(map(tuple, rows)),
            initial_range_rad=minimum,
            minimum_range_rad=minimum,
            weights=self._table.weights,
            lookahead=self._table.lookahead,
            floor_gain=self.FLOOR_GAIN,
            floor_exponent=0.6 * exponent,
        )
        rates = between(0.05 * self._fastest, self._fastest, bandwidth)
        observer = {"rate_observer_bandwidth_rad_s": rates}
        transmitter = self._config.transmitter.model_copy(update=observer)
        return self._config.model_copy(update={"coder": coder, "transmitter": transmitter})


class DirectionFamily:
    """The coder `direction`, designed for the model; the strength of its disturbance, and its steps."""

    STRENGTH = (1e-10, 1e10)
    """of the assumed disturbance, in units of the configured one"""

    def __init__(self, config: FlightConfig) -> None:
        """Design for the disturbance as configured: another strength scales Q and P alone."""
        # As many as the line carries: rounded up they would come late.
        bits = max(1, math.floor(config.channel.rate_baud * config.timing.symbol_period_s + 1e-6))
        given = config.model_dump(mode="json", include={"timing", "model", "transmitter"})
        done = completed({**given, "coder": {"kind": "direction", "bits": bits}})
        model = type(config.model).model_validate(done["model"])
        self._coder = DirectionCoderSection.model_validate(done["coder"])
        self._config = config.model_copy(update={"model": model, "coder": self._coder})
        self.scan: Sequence[Sequence[float]]
        self.scan = tuple((size / 20.0, 0.5, 0.5, 0.5) for size in range(2, 19))

    def at(self, shares: Sequence[float]) -> FlightConfig:
        strength = between(*self.STRENGTH, shares[0])
        coder = self._coder.model_copy(
            update={
                "noise": scaled(self._coder.noise, strength),
                "start": scaled(self._coder.start, strength),
                "step": self._coder.step * between(0.7, 1.43, shares[1]),
                "removed": min(self._coder.removed * between(0.8, 1.25, shares[2]), 0.99),
                "minimum_strength": between(0.01, 1.0, shares[3]),
            }
        )
        model = self._config.model
        if isinstance(model, LinearModelSection):
            densities = tuple([strength * one for one in model.densities])
            model = model.model_copy(update={"densities": densities})
        return self._config.model_copy(update={"coder": coder, "model": model})


Family: TypeAlias = HistoryFamily | DirectionFamily


def family_of(config: FlightConfig) -> Family:
    """Return the coders that suit the model of a configuration."""
    return HistoryFamily(config) if config.model.kind == "pitch" else DirectionFamily(config)


def between(least: float, most: float, share: float) -> float:
    """Return a value between two ends on a log scale."""
    return math.exp(math.log(least) * (1.0 - share) + math.log(most) * share)


def scaled(rows: Sequence[Sequence[float]], factor: float) -> tuple[tuple[float, ...], ...]:
    """Return a matrix times a factor."""
    return tuple([tuple([factor * value for value in row]) for row in rows])
