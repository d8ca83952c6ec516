"""The configuration of a flight; a replay takes unset fields from the recording.

Both ends call this with the same file and the same settings, and come to the same shared configuration.
Only `tenbaud.log` knows what files look like; here it is known what a flight needs of them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from hashlib import blake2b
from pathlib import Path
from typing import Any

import numpy as np

from channel.codec.codec import Vector
from channel.codec.models.learned import plant_model
from channel.codec.signals import STEPS_MAX, Signals, signals_of
from channel.flight_log import FlightLog
from channel.protocol.limits import per_input
from tenbaud.build.codec import build_model
from tenbaud.build.flight_log import read_flight_log, recorded_tick_s
from tenbaud.build.signals import build_limits, configured_signals, initial_command
from tenbaud.config.load import (
    ConfigError,
    checked,
    given_names,
    load_config,
    merged,
    merged_values,
    nested,
    read_toml,
)
from tenbaud.config.models import LinearModelSection
from tenbaud.config.models import ModelSection as BuiltInModel
from tenbaud.config.schema import FlightConfig, Timing
from tenbaud.config.warned import warn

PRESET = "uiuc-10baud"
"""Of a recording for which none is given."""
ROUND = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""What a limit is rounded up to, times a power of ten."""
STEPS_LEAST = 1000.0
"""Steps in which the largest command of a recording must travel at least, where they can be chosen."""
DIGITS = 12
"""Of computed values: two libraries differ in the last of 16."""


def flight_config(
    preset: str | None = None,
    path: Path | None = None,
    overrides: dict[str, Any] | None = None,
    *,
    allow_code: bool = False,
) -> FlightConfig:
    """Return the checked configuration of a flight, as `load_config` does.

    A replay takes from its recording the tick, the duration, limits, input steps and the start, unless
    file or overrides set them. Raises ConfigError where they contradict the recording, LogError where
    that cannot be read.
    """
    given = given_names(path, overrides)
    overrides = overrides or {}
    if preset is None and path is None and _replays(overrides):
        preset = PRESET
    values = merged_values(preset, path, overrides)
    if _replays(values) and "timing.tick_s" not in given:
        _fit_tick(values.setdefault("timing", {}))
    config = checked(values, path, allow_code=allow_code)
    written = path is not None and FlightConfig.model_fields.keys() <= read_toml(path).keys()
    changed = given_names(None, overrides)
    _warn_of_downlink(changed if written else given, config)
    if config.transmitter.rig != "replay":
        return config.giving((_decided(given, config) | changed) if written else given)
    return _Adoption(values, path, given, config).config()


def _warn_of_downlink(given: set[str], config: FlightConfig) -> None:
    """Warn of settings of the narrow downlink that a person gave for another one."""
    rung = config.channel.downlink
    unused = [one for one in given if one == "channel.downlink_baud" or one.startswith("downlink.")]
    if unused and rung != "narrow":
        text = f'{", ".join(sorted(unused))}: without effect with channel.downlink = "{rung}"'
        warn(f'{text}: set "narrow", or leave it out', UserWarning)


def _decided(given: set[str], config: FlightConfig) -> set[str]:
    """Return the names that a person gave: a file that a flight wrote has every field of its preset."""
    if config.limits.command_max == load_config(config.preset).limits.command_max:
        return given - {"limits.command_max"}
    return given


def _replays(overrides: dict[str, Any]) -> bool:
    section = overrides.get("transmitter")
    return isinstance(section, dict) and section.get("rig") == "replay"


def _fit_tick(timing: Any) -> None:
    """Change a preset's tick so that a symbol period that is given has a whole number of them."""
    if not isinstance(timing, dict):
        return  # `checked` says so
    usual = Timing()
    tick_s = timing.get("tick_s", usual.tick_s)
    symbol_s = timing.get("symbol_period_s", usual.symbol_period_s)
    if all(isinstance(one, int | float) and 1e-5 <= one <= 60.0 for one in (tick_s, symbol_s)):
        timing["tick_s"] = nearest_tick_s(tick_s, symbol_s)


class _Adoption:
    """One recording and the configuration that replays it."""

    def __init__(
        self, values: dict[str, Any], path: Path | None, given: set[str], config: FlightConfig
    ) -> None:
        self._values, self._path, self._given = values, path, given
        self._config = config

    def config(self) -> FlightConfig:
        """Return the configuration with the recording's settings."""
        self._take_tick(recorded_tick_s(self._config))
        # From here on in its own ticks.
        log = read_flight_log(self._config)
        asked_s, length_s = self._config.duration_s, len(log) * self._config.timing.tick_s
        if not self._is_given("duration_s") or asked_s > length_s:
            self._take({"duration_s": float(f"{length_s:.{DIGITS}g}")})
        self._take(self._commands(log))
        self._take(self._start(log))
        self._take({"flight_log.digest": digest_of(log, configured_signals(self._config))})
        if self._is_given("duration_s") and asked_s > length_s:
            return self._config.noting(f"{asked_s:g} s were asked for; the recording ends before")
        return self._config

    def _take(self, settings: dict[str, Any]) -> None:
        if settings:
            self._values = merged(self._values, nested(settings))
            allowed = self._config.code_allowed
            self._config = checked(self._values, self._path, allow_code=allowed)

    def _is_given(self, name: str) -> bool:
        return any(one == name or one.startswith(f"{name}.") for one in self._given)

    def _take_tick(self, recorded_s: float) -> None:
        """Fly in the ticks of the recording: a whole number of them makes a symbol period."""
        section = self._config.model
        if self._is_given("timing.tick_s") or math.isclose(recorded_s, self._config.timing.tick_s):
            return
        settings: dict[str, Any] = {
            "timing.tick_s": nearest_tick_s(recorded_s, self._config.timing.symbol_period_s)
        }
        if isinstance(section, LinearModelSection):
            if not section.A:
                return  # F and E are those of the configured tick, so it stays
            # scipy takes half a second to load, and other flights need not wait.
            from plant_sim.zero_order_hold import discretised

            matrices = discretised(section.A, section.B, settings["timing.tick_s"])
            settings |= {
                f"model.{name}": [[_shortened(one) for one in row] for row in matrix.tolist()]
                for name, matrix in zip("FE", matrices, strict=True)
            }
        self._take(settings)

    def _commands(self, log: FlightLog) -> dict[str, Any]:
        """Return limits and steps with which every command of the recording passes as it is."""
        signals = configured_signals(self._config)
        before = build_limits(self._config, signals).command_max
        most, steps = list(before), list(signals.steps_per_unit)
        limit_given = self._is_given("limits.command_max")
        steps_free = isinstance(self._config.model, LinearModelSection)
        steps_free = steps_free and not self._is_given("model.input_steps_per_unit")
        for place, largest in enumerate(largest_commands(log, signals)):
            coarse = steps_free and 0.0 < largest * steps[place] < STEPS_LEAST
            if largest > most[place] or (coarse and not limit_given):
                if limit_given:
                    would = f"limits.command_max = {most[place]:g} would clamp it"
                    raise self._refusal(signals, place, largest, f"{would}: leave it out, or raise it")
                most[place] = _rounded_up(largest)
            if steps_free and (coarse or most[place] * steps[place] > STEPS_MAX):
                steps[place] = 10.0 ** math.floor(math.log10(STEPS_MAX / most[place]))
            elif largest > (carried := signals.inputs[place].largest):
                scale = f"give its unit or a scale, --scale {signals.inputs[place].name}=0.01"
                why = f"a command carries at most {carried:g}: {scale}"
                raise self._refusal(signals, place, largest, why)
            most[place] = min(most[place], STEPS_MAX / steps[place])
        settings: dict[str, Any] = self._slew(log, signals, most)
        if tuple(most) != before:
            settings["limits.command_max"] = most
        if tuple(steps) != signals.steps_per_unit:
            settings["model.input_steps_per_unit"] = steps
        first = tuple(log.commands[0].tolist()) if log.commands.size else ()
        known = self._is_given("limits.initial_command") or not first
        if not known and first != initial_command(self._config, signals):
            settings["limits.initial_command"] = list(first)
        return settings

    def _refusal(self, signals: Signals, place: int, largest: float, why: str) -> ConfigError:
        one = signals.inputs[place]
        reaches = f"the input {one.name} reaches {largest:g} {one.unit}".rstrip()
        return ConfigError(f"{self._name}: {reaches}, and {why}")

    def _slew(self, log: FlightLog, signals: Signals, most: list[float]) -> dict[str, Any]:
        """Return rate limits that no change of a recorded command meets, after a lost one either."""
        field, tick_s = "limits.command_slew_per_s", self._config.timing.tick_s
        slew = per_input(field, self._config.limits.command_slew_per_s, signals)
        wanted = [2.0 * one / tick_s for one in most]
        if not log.commands.size or all(has >= one for has, one in zip(slew, wanted, strict=True)):
            return {}
        if not self._is_given(field):
            return {field: [max(has, _rounded_up(one)) for has, one in zip(slew, wanted, strict=True)]}
        steps = np.abs(np.diff(log.commands, axis=0)).max(axis=0) / tick_s
        for one, fastest, has in zip(signals.inputs, steps.tolist(), slew, strict=True):
            if fastest > has:
                raise ConfigError(
                    f"{self._name}: the input {one.name} changes by up to {fastest:g} {one.unit}/s, "
                    f"and {field} = {has:g} would slow it down: leave {field} out, or raise it"
                )
        return {}

    def _start(self, log: FlightLog) -> dict[str, Any]:
        """Return the state at which both codecs begin: at the first values that were measured."""
        section = self._config.model
        known = isinstance(section, BuiltInModel) and section.start and self._is_given("model.start")
        return {} if known else start_at(self._config, log)

    @property
    def _name(self) -> str:
        return Path(self._config.flight_log.file).name


def start_at(config: FlightConfig, log: FlightLog) -> dict[str, Any]:
    """Return `model.start` with which a codec begins at the first row; {} where it does by itself."""
    model = plant_model(build_model(config))
    first, state = log.measured[0], np.array(model.initial())
    outside = not isinstance(config.model, BuiltInModel)
    if outside or tuple(first.tolist()) == model.measured(model.initial()):
        return {}
    signals = signals_of(model)
    rows = np.array([signals.row(place) or np.zeros(len(state)) for place in range(len(first))])
    places = [at for at in signals.output_states if at is not None]
    if len(places) == len(first):
        state[places] = first
        return {"model.start": state.tolist()}
    # The smallest change of the state that shows what was measured.
    state += np.linalg.pinv(rows) @ (first - np.array(model.measured(model.initial())))
    return {"model.start": [_shortened(one) for one in state.tolist()]}


def digest_of(log: FlightLog, signals: Signals) -> str:
    """Return what both ends of a replay must have alike: time, rows, and commands as they travel."""
    digest = blake2b(repr((log.tick_s, log.start_s, log.commands.shape)).encode(), digest_size=8)
    for column, steps in zip(log.commands.T, signals.steps_per_unit, strict=False):
        digest.update(np.rint(column * steps).astype("<i8").tobytes())
    return digest.hexdigest()


def nearest_tick_s(period_s: float, symbol_period_s: float) -> float:
    """Return the tick nearest to the time between rows: a whole number of them is a symbol period."""
    symbol_ns = round(symbol_period_s * 1e9)
    nearest = symbol_period_s / period_s

    def distance(ticks: int) -> float:
        return abs(math.log(ticks / nearest))

    # Ends share whole nanoseconds, so only divisors will do.
    pairs = [
        (ticks, symbol_ns // ticks)
        for ticks in range(1, math.isqrt(symbol_ns) + 1)
        if symbol_ns % ticks == 0
    ]
    return symbol_ns / min((one for pair in pairs for one in pair), key=distance) / 1e9


def largest_commands(log: FlightLog, signals: Signals) -> Vector:
    """Return the largest value of each input, either way; zeros where none was recorded."""
    if not log.commands.size:
        return (0.0,) * len(signals.inputs)
    largest = np.maximum(log.commands.max(axis=0), -log.commands.min(axis=0))
    return tuple((largest + 0.0).tolist())


def replay_notes(config: FlightConfig) -> tuple[str, ...]:
    """Return notes on a replay's use of its recording, a line each; () for other flights."""
    return tuple(_notes(config)) if config.transmitter.rig == "replay" else ()


def _notes(config: FlightConfig) -> Iterator[str]:
    log, tick_s = read_flight_log(config), config.timing.tick_s
    model = build_model(config)
    signals = signals_of(model)
    yield f"{len(log)} rows, {len(log) * tick_s:g} s; tick {tick_s:g} s"
    yield from config.notes
    yield from log.notes
    if log.commands.size:
        limits = build_limits(config, signals).command_max
        described = [
            f"{one.name} up to {largest:g} {one.unit}".rstrip() + f" (limit {limit:g})"
            for one, largest, limit in zip(
                signals.inputs, largest_commands(log, signals), limits, strict=True
            )
        ]
        yield f"commands as recorded: {', '.join(described)}"
    else:
        yield "the file has no commands: zero is commanded"
    begin = model.measured(model.initial())
    for one, first, value in zip(signals.outputs, log.measured[0].tolist(), begin, strict=True):
        if not math.isclose(first, value, rel_tol=1e-9, abs_tol=1e-12):
            yield (
                f"the codec starts at {one.name} = {value:g} {one.unit}, and the recording at "
                f"{first:g}: set model.start"
            )
        elif first:
            yield f"the codec starts at {one.name} = {first:g} {one.unit}, as the recording".rstrip()


def _rounded_up(value: float) -> float:
    """Return the next of `ROUND` times a power of ten, at least the value."""
    power = 10.0 ** math.floor(math.log10(value))
    return next(float(f"{step * power:.3g}") for step in ROUND if step * power >= value * (1.0 - 1e-9))


def _shortened(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")
