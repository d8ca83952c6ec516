"""The codec of a configuration: a model and a coder of their registered kinds, or from outside."""

from __future__ import annotations

from typing import Any

from channel.codec.codec import Codec, Coder, CoderContext, Model, ModelContext
from channel.codec.coders.pcm import PcmCoder
from channel.codec.models.hold import HoldModel
from channel.line.line import bit_rate
from channel.registry import Registry
from tenbaud.build.parts import Parts, check_codec
from tenbaud.build.plugins import build_part
from tenbaud.config.kinds import CODERS, MODELS, kind_of, model_kind
from tenbaud.config.schema import FlightConfig
from tenbaud.config.section import KindSection, OutsideSection


def build_codec(config: FlightConfig, parts: Parts | None = None) -> Codec:
    """Return the codec of a configuration; ValueError where its parts do not fit each other."""
    parts = parts or Parts()
    codec = unchecked_codec(config, parts)
    kind = model_kind(config.model)
    if parts.model is None and kind and kind.linear and kind.may_grow(config.model):
        from tenbaud.design.described import check_plant

        check_plant(config, codec)
    if isinstance(config.model, OutsideSection) or isinstance(config.coder, OutsideSection):
        where = f"model.kind = {config.model.kind!r} with coder.kind = {config.coder.kind!r}"
        check_codec(where, codec)
    return codec


def unchecked_codec(config: FlightConfig, parts: Parts | None = None) -> Codec:
    """Return the codec without checking that its rate is enough for its plant."""
    parts = parts or Parts()
    ticks = round(config.timing.symbol_period_s / config.timing.tick_s)
    model = build_model(config, parts)
    context = CoderContext(config.timing.tick_s, config.timing.symbol_period_s, model)
    coder = parts.coder or _built(config, CODERS, config.coder, context, Coder)
    needs_hold = isinstance(coder, PcmCoder)
    if needs_hold != isinstance(model, HoldModel):
        raise ValueError(
            f"coder.kind = {config.coder.kind!r} and model.kind = {config.model.kind!r} do not go "
            "together: the coder 'pcm' sets angle and rate of the model 'hold', and no other"
        )
    return Codec(model, coder, ticks)


def configured_rate(config: FlightConfig) -> float:
    """Return the bit/s of a configuration's words, be they enough for its plant or not."""
    designed = config.coder.kind not in ("direction", "learning") and getattr(config.model, "F", True)
    if isinstance(config.coder, OutsideSection) or designed:
        return bit_rate(unchecked_codec(config), config.timing.tick_s)
    # Without a codec: a linear model and its coder may not have been designed yet.
    return float(getattr(config.coder, "bits", 1)) / config.timing.symbol_period_s


def build_model(config: FlightConfig, parts: Parts | None = None) -> Model:
    """Return the prediction model of a configuration."""
    if parts is not None and parts.model is not None:
        return parts.model
    section = config.model
    context = ModelContext(config.timing.tick_s, config.timing.symbol_period_s)
    model: Model = _built(config, MODELS, section, context, Model)
    if not isinstance(section, OutsideSection) and len(model.initial()) != model.state_size:
        raise ValueError(
            f"model.start has {len(model.initial())} numbers, one for each of {model.state_size} "
            "states is needed"
        )
    return model


def _built(
    config: FlightConfig, registry: Registry, section: KindSection, context: object, protocol: type
) -> Any:
    """Return the part of a section: of a kind that is built in, or from outside."""
    if isinstance(section, OutsideSection):
        return build_part(config, registry, section.kind, context, section.options, protocol)
    return kind_of(registry, section.kind).build(section, context)
