"""The parts of one end: rig and guard of the transmitter, controller and reference of the receiver."""

from __future__ import annotations

import math
import secrets
import time
from collections.abc import Callable
from functools import partial

from channel.codec.codec import Codec
from channel.codec.coders.direction import DirectionCoder
from channel.codec.downlink.layout import DOWN_ALPHABET
from channel.codec.models.learned import plant_model
from channel.codec.models.linear import LinearModel
from channel.line.clocks import SkewedClock
from channel.line.impairments import Direction, ImpairedLine
from channel.line.line import CleanLine, Downlink, Line
from channel.protocol.recording import Recorder
from channel.protocol.sabotage import SabotagedCodec, parse_sabotage
from channel.protocol.wire import SymbolWire, Wire
from receiver.controllers.base import Controller
from receiver.endpoint import ReceiverEndpoint, SteppedEndpoint
from receiver.session.session import ReceiverSession
from tenbaud.build.codec import build_codec
from tenbaud.build.controllers import build_controller
from tenbaud.build.downlink import with_codec
from tenbaud.build.first_contact import require_safe
from tenbaud.build.flight import Agreement, ticks_of
from tenbaud.build.flight_log import output_steps
from tenbaud.build.gauge import build_gauge
from tenbaud.build.liveness import overtaking_ticks
from tenbaud.build.parts import Parts
from tenbaud.build.references import References, begin_from, build_references, values_of
from tenbaud.build.rig import build_rig
from tenbaud.build.signals import configured_signals, safe_command, soft_limits
from tenbaud.config.kinds import CONTROLLERS, model_kind
from tenbaud.config.load import ConfigError, config_errors
from tenbaud.config.schema import FlightConfig
from transmitter.endpoint import TransmitterNode
from transmitter.guard import Guard, GuardSettings
from transmitter.metrics.scores import Scores
from transmitter.session.session import TransmitterSession
from transmitter.session.state_observer import StateObserver, rate_observer


def build_transmitter(agreement: Agreement, recorder: Recorder | None) -> TransmitterNode:
    """Return the sensor node of a configuration."""
    config, terms = agreement.config, agreement.terms
    codec = sabotaged(agreement.codec, config.transmitter.sabotage, agreement.live)
    session = TransmitterSession(
        codec,
        terms,
        agreement.identity,
        secrets.randbits(32),
        recorder,
        stop_on_desync=config.transmitter.on_desync == "stop",
        state_observer=build_observer(agreement),
        overtaking_ticks=overtaking_ticks(terms, agreement.faults),
        two_way=with_codec(agreement.two_way, codec),
        line_delay_ns=agreement.faults.longest_delay_ns,
    )
    gauge = build_gauge(agreement)
    scores = Scores(
        agreement.codec.model,
        agreement.window_start_tick,
        (terms.confirmation_samples + 2) * terms.ticks_per_sample,
        _followed(agreement),
        gauge.on_errors if gauge is not None else lambda _errors: None,
    )
    # Only a rig that hurts nobody is armed again by itself.
    harmless = config.transmitter.rig in ("simulated", "replay")
    rearm_ticks = ticks_of(config.link.peer_timeout_s, config) if harmless else None
    return TransmitterNode(
        session,
        build_rig(config, agreement.parts.plant, agreement.signals),
        Guard(terms.limits, guard_settings(agreement)),
        scores,
        recorder,
        rearm_ticks,
        gauge,
    )


def _followed(agreement: Agreement) -> Callable[[int], tuple[float | None, ...]]:
    """Return the set-points that the tracking errors are against."""
    if agreement.parts.controller is not None:
        return agreement.parts.controller.references
    if agreement.config.receiver.controller == "recorded":
        return values_of((None,) * len(agreement.signals.outputs))
    return values_of(build_references(agreement.config, agreement.signals, agreement.codec.model))


def build_observer(agreement: Agreement) -> StateObserver | None:
    """Return the observer of a coder that uses rates, None for others."""
    codec = agreement.codec
    if not codec.uses_rates:
        return None
    config, tick_s = agreement.config, agreement.terms.tick_ns / 1e9
    with config_errors(f"coder.kind = {config.coder.kind!r}"):
        kind = model_kind(config.model)
        # A coder that was designed for a plant stands near its limit: it needs the best view of it.
        is_designed = isinstance(codec.coder, DirectionCoder) and kind is not None and kind.linear
        if (
            is_designed
            or isinstance(plant_model(codec.model), LinearModel)
            or len(agreement.signals.outputs) > 1
        ):
            from tenbaud.design.observer import configured_observer

            steps = output_steps(config, agreement.signals)
            return configured_observer(codec.model, config, steps)
        return rate_observer(codec.model, tick_s, config.transmitter.rate_observer_bandwidth_rad_s)


def build_line(agreement: Agreement, direction: Direction, wire: SymbolWire) -> Line:
    """Return one direction of the line, with its impairments."""
    one = agreement.faults.up if direction == "up" else agreement.faults.down
    if not one.any and not agreement.live:
        return CleanLine()
    alphabet = agreement.codec.coder.alphabet if direction == "up" else DOWN_ALPHABET
    return ImpairedLine(one, alphabet, f"{agreement.config.seed} {direction}", wire)


def sabotaged(codec: Codec, text: str, live: bool = False) -> Codec:
    """Return the codec, corrupted as configured; `live`: it may be corrupted in flight."""
    if not text:
        return SabotagedCodec(codec) if live else codec
    with config_errors():
        return SabotagedCodec(codec, parse_sabotage(text))


def build_receiver(
    agreement: Agreement,
    recorder: Recorder | None,
    wire: Wire,
    take_over: bool = False,
    references: References | None = None,
) -> ReceiverEndpoint:
    """Return the controller node of a configuration.

    `take_over` from another one, on purpose; it follows `references` if they are given.
    """
    if references is None and agreement.parts.controller is None:
        model = agreement.codec.model
        references = build_references(agreement.config, agreement.signals, model)
    terms = agreement.terms
    codec = sabotaged(agreement.codec, agreement.config.receiver.sabotage, agreement.live)
    session = ReceiverSession(
        codec,
        terms,
        agreement.parts.controller
        or build_controller(agreement.config, references, agreement.codec.model),
        agreement.identity,
        secrets.randbits(31) + 1,
        recorder,
        take_over=take_over,
        begins=partial(begin_from, references or ()),
        two_way=with_codec(agreement.two_way, codec),
    )
    if agreement.clock == "virtual":
        # There the transmitter's process holds both directions of the line, and the receiver's clock.
        return SteppedEndpoint(session, Downlink(wire, None, terms, recorder))
    faults = agreement.faults
    clock = SkewedClock(faults, time.monotonic_ns()) if faults.bad_clock else None
    line = build_line(agreement, "down", wire)
    return ReceiverEndpoint(session, Downlink(wire, line, terms, recorder), clock)


def check_parts(config: FlightConfig, parts: Parts | None = None) -> None:
    """Build the parts from files and texts, so that errors are reported before anything starts.

    `parts` are objects in place of what is configured; they are checked already.
    """
    parts = parts or Parts()
    build_rig(config, parts.plant, configured_signals(config, parts))
    if parts.controller is None:
        controller = build_controller(config, model=parts.model)
        if config.receiver.controller not in CONTROLLERS.built_in:
            _check_command(config, controller, parts)


def check_flight(agreement: Agreement, accept_risk: bool = False) -> bool:
    """Return whether motors of a real rig will turn; for a process that opens the rig.

    Everything is checked before it starts. ConfigError for parts that cannot be built, a sabotage at a
    sample that the flight does not have, and motors that would turn without what `require_safe` asks
    for; LinkError where a serial port of the rig is not there.
    """
    config = agreement.config
    check_parts(config, agreement.parts)
    samples = agreement.flight_ticks // agreement.terms.ticks_per_sample
    for role, text in (
        ("transmitter", config.transmitter.sabotage),
        ("receiver", config.receiver.sabotage),
    ):
        if text and parse_sabotage(text).sample >= samples:
            raise ConfigError(f"{role}.sabotage = {text!r}: the flight has only {samples} samples")
    if config.transmitter.rig == "serial":
        from channel.links.serial.port import check_port

        section = config.transmitter.serial
        for port in filter(None, (section.port, section.motor_port)):
            check_port(port, insecure=True)
    return require_safe(config, accept_risk, agreement.parts)


def _check_command(config: FlightConfig, controller: Controller, parts: Parts) -> None:
    """Ask a controller from outside for its first command; ConfigError if no motor could follow it."""
    model, name = build_codec(config, parts).model, config.receiver.controller
    try:
        volts = [float(value) for value in controller.command(0, model.initial())]
    except Exception as error:
        raise ConfigError(
            f"receiver.controller {name}: command(0, {model.initial()}) must return "
            f"{model.input_size} value(s); it raised {type(error).__name__}: {error}"
        ) from error
    if len(volts) != model.input_size or not all(map(math.isfinite, volts)):
        raise ConfigError(
            f"receiver.controller {name}: command(0, {model.initial()}) must return "
            f"{model.input_size} finite value(s), one for each input of the model; it returned {volts}"
        )


def guard_settings(agreement: Agreement) -> GuardSettings:
    """Return when the guard steps in, and how.

    On a recording there is nothing to protect: only a receiver that is gone ends the flight.
    """
    section = agreement.config.transmitter
    recorded = section.rig == "replay"
    timeout_ticks = agreement.watchdog_ticks
    if recorded:
        timeout_ticks = ticks_of(agreement.config.link.peer_timeout_s, agreement.config)
    return GuardSettings(
        timeout_ticks=timeout_ticks,
        ramp_ticks=ticks_of(section.ramp_s, agreement.config),
        safe_command=safe_command(agreement.config, agreement.signals),
        soft_limits=() if recorded else soft_limits(agreement.config, agreement.signals),
        outputs=agreement.signals.outputs,
    )
