"""The codec of a configuration: a model and a coder of their registered kinds, or from outside."""

from __future__ import annotations

from channel.codec.codec import Codec, Coder, Model
from channel.codec.coders.words import WordsCoder
from channel.codec.models.hold import HoldModel
from channel.codec.plugin_context import CoderContext, ModelContext
from channel.codec.words import ERASED
from tenbaud.build.plugins import CODER, MODEL, PluginError, build_plugin
from tenbaud.config.kinds import CODERS, MODELS, kind_of
from tenbaud.config.schema import FlightConfig
from tenbaud.config.section import OutsideSection


def build_codec(config: FlightConfig) -> Codec:
    """Return the codec of a configuration; ValueError where its parts do not fit each other."""
    ticks = round(config.timing.symbol_period_s / config.timing.tick_s)
    model = _build_model(config)
    coder = _build_coder(config, model)
    needs_hold = isinstance(coder, WordsCoder)
    if needs_hold != isinstance(model, HoldModel):
        raise ValueError(
            f"coder.kind = {config.coder.kind!r} and model.kind = {config.model.kind!r} do not go "
            "together: the coder 'words' sets angle and rate of the model 'hold', and no other"
        )
    codec = Codec(model, coder, ticks)
    if isinstance(config.model, OutsideSection) or isinstance(config.coder, OutsideSection):
        _try_out(codec, config)
    return codec


def _build_model(config: FlightConfig) -> Model:
    section = config.model
    context = ModelContext(config.timing.tick_s, config.timing.symbol_period_s)
    model: Model
    if isinstance(section, OutsideSection):
        model = build_plugin(config, MODELS, section.kind, context, section.options, MODEL)
    else:
        model = kind_of(MODELS, section.kind).build(section, context)
    return model


def _build_coder(config: FlightConfig, model: Model) -> Coder:
    section = config.coder
    context = CoderContext(config.timing.tick_s, config.timing.symbol_period_s, model)
    coder: Coder
    if isinstance(section, OutsideSection):
        coder = build_plugin(config, CODERS, section.kind, context, section.options, CODER)
    else:
        coder = kind_of(CODERS, section.kind).build(section, context)
    return coder


def _try_out(codec: Codec, config: FlightConfig) -> None:
    """Run parts from outside through a sample and an erasure, so that what does not fit is told now."""
    command = config.limits.initial_volts
    try:
        if codec.model.input_size != len(command):
            raise ValueError(
                f"the model's input_size is {codec.model.input_size}, and a command has {len(command)} "
                "motor voltages"
            )
        state = codec.initial()
        word = codec.encode(state, codec.predicted(state))
        codec.coder.alphabet.word_number(word)
        for consumed in (word, ERASED):
            before = len(state.model), len(state.coder)
            state = codec.step(state, consumed, [command] * codec.ticks_per_sample)
            if (len(state.model), len(state.coder)) != before:
                raise ValueError("the number of states changed within a sample")
            codec.pack(state)
        codec.coder.ranges(state.coder)[0]
    except Exception as error:  # it is the user's code, and anything may be wrong in it
        raise PluginError(
            f"model.kind = {config.model.kind!r} with coder.kind = {config.coder.kind!r} cannot run "
            f"one sample: {type(error).__name__}: {error}"
        ) from error
