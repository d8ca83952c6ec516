"""The codec of a configuration: one entry per kind of model and per kind of coder.

A new kind needs a section in `tenbaud.config.schema` and one entry here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from channel.codec.codec import Codec, Coder, Model
from channel.codec.coders.history import HistoryCoder, HistoryParameters
from channel.codec.coders.static import StaticCoder, StaticParameters
from channel.codec.coders.timed import TimedCoder, TimedParameters
from channel.codec.coders.words import WordsCoder, WordsParameters
from channel.codec.coders.zoom import ZoomCoder, ZoomParameters
from channel.codec.models.hold import HoldModel
from channel.codec.models.pitch import PitchModel, PitchParameters
from channel.codec.plugin_context import CoderContext, ModelContext
from tenbaud.build.parts import Parts, check_codec
from tenbaud.build.plugins import build_plugin
from tenbaud.config.schema import (
    FixedCoderSection,
    FlightConfig,
    HistoryCoderSection,
    HoldModelSection,
    PitchModelSection,
    PluginCoderSection,
    PluginModelSection,
    StaticCoderSection,
    TimedCoderSection,
    WordsCoderSection,
    ZoomCoderSection,
)


def build_codec(config: FlightConfig, parts: Parts | None = None) -> Codec:
    """Return the codec of a configuration; ValueError where its parts do not fit each other."""
    parts = parts or Parts()
    ticks = round(config.timing.symbol_period_s / config.timing.tick_s)
    model = parts.model or _build_model(config)
    coder = parts.coder or _build_coder(config, model)
    needs_hold = isinstance(coder, WordsCoder)
    if needs_hold != isinstance(model, HoldModel):
        raise ValueError(
            f"coder.kind = {config.coder.kind!r} and model.kind = {config.model.kind!r} do not go "
            "together: the coder 'words' sets angle and rate of the model 'hold', and no other"
        )
    codec = Codec(model, coder, ticks)
    if isinstance(config.model, PluginModelSection) or isinstance(config.coder, PluginCoderSection):
        where = f"model.kind = {config.model.kind!r} with coder.kind = {config.coder.kind!r}"
        check_codec(where, codec, config.limits.initial_volts)
    return codec


def _build_model(config: FlightConfig) -> Model:
    section = config.model
    if not isinstance(section, PluginModelSection):
        return MODELS[section.kind](section, config)
    context = ModelContext(config.timing.tick_s, config.timing.symbol_period_s)
    model: Model = build_plugin(config, "model.kind", section.kind, context, section.options, Model)
    return model


def _build_coder(config: FlightConfig, model: Model) -> Coder:
    section = config.coder
    if not isinstance(section, PluginCoderSection):
        return CODERS[section.kind](section, config)
    context = CoderContext(config.timing.tick_s, config.timing.symbol_period_s, model)
    coder: Coder = build_plugin(config, "coder.kind", section.kind, context, section.options, Coder)
    return coder


def model_parameters(section: PitchModelSection) -> PitchParameters:
    """Return the parameters of the pitch model."""
    return PitchParameters(**section.model_dump(exclude={"kind"}))


def _pitch(section: PitchModelSection, config: FlightConfig) -> Model:
    return PitchModel(model_parameters(section), config.timing.tick_s)


def _hold(section: HoldModelSection, config: FlightConfig) -> Model:
    return HoldModel(config.timing.tick_s)


def _gains(gains: tuple[float, float]) -> tuple[tuple[float, ...], ...]:
    return tuple((gain,) for gain in gains)


def _common(section: Any) -> dict[str, Any]:
    """Return what every coder of signs and gains takes."""
    return {"gains": _gains(section.gains), "impulse": section.correction == "impulse"}


def _zoom(section: ZoomCoderSection, config: FlightConfig) -> Coder:
    return ZoomCoder(
        ZoomParameters(
            initial_range=section.initial_range_rad,
            minimum_range=section.minimum_range_rad,
            decay=section.decay,
            window=section.window_signs,
            **_common(section),
        )
    )


def _timed(section: TimedCoderSection, config: FlightConfig) -> Coder:
    return TimedCoder(
        TimedParameters(
            initial_range=section.initial_range_rad,
            minimum_range=section.minimum_range_rad,
            decay=section.decay,
            **_common(section),
        )
    )


def _fixed(section: FixedCoderSection, config: FlightConfig) -> Coder:
    """A timed coder whose range has nowhere to go."""
    size = section.range_rad
    return TimedCoder(
        TimedParameters(initial_range=size, minimum_range=size, decay=1.0, **_common(section))
    )


def _static(section: StaticCoderSection, config: FlightConfig) -> Coder:
    return StaticCoder(StaticParameters(bits=section.bits, range=section.range_rad, **_common(section)))


def _words(section: WordsCoderSection, config: FlightConfig) -> Coder:
    return WordsCoder(
        WordsParameters(
            bits=section.bits,
            range=section.range_rad,
            period_s=config.timing.symbol_period_s,
            rate_filter_s=section.rate_filter_s,
        )
    )


def _history(section: HistoryCoderSection, config: FlightConfig) -> Coder:
    return HistoryCoder(
        HistoryParameters(
            rows=section.rows,
            initial_range=section.initial_range_rad,
            minimum_range=section.minimum_range_rad,
            maximum_range=section.maximum_range_rad,
            period_s=config.timing.symbol_period_s,
            weights=section.weights,
            lookahead=section.lookahead,
        )
    )


MODELS: dict[str, Callable[[Any, FlightConfig], Model]] = {"pitch": _pitch, "hold": _hold}

CODERS: dict[str, Callable[[Any, FlightConfig], Coder]] = {
    "zoom": _zoom,
    "fixed": _fixed,
    "timed": _timed,
    "static": _static,
    "words": _words,
    "history": _history,
}
