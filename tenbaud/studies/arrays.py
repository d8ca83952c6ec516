"""The arrays of a compiled flight, made from its configuration (`flight_data`)."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from channel.codec.codec import Codec
from channel.codec.signals import Signal, Signals
from channel.flight_log import FlightLog
from plant_sim.encoder import Encoder
from tenbaud.build.ends import guard_settings
from tenbaud.build.flight import Agreement
from tenbaud.build.references import (
    SetPointLimits,
    limits_kept,
    reference_of,
    reference_sections,
    set_point_limits,
)
from tenbaud.build.signals import build_encoders
from tenbaud.config.controllers import ReferenceSection
from tenbaud.studies.flight_data import Work
from transmitter.encoder_watch import motion_of
from transmitter.session.state_observer import StateObserver

NOTHING = np.zeros(0)
NO_ROWS = np.zeros((0, 1))


def observer_arrays(observer: StateObserver | None) -> dict[str, Any]:
    """Return gains, gains after a gap and largest states of the transmitter's observer."""
    if observer is None:
        return {"gains": NO_ROWS, "anew": NO_ROWS, "largest": NOTHING}
    return {
        "gains": np.array(observer.gains),
        "anew": np.array(observer.anew),
        "largest": np.array(observer.largest),
    }


def signal_arrays(agreement: Agreement) -> dict[str, Any]:
    """Return the arrays of the inputs and outputs."""
    config, terms, signals = agreement.config, agreement.terms, agreement.signals
    settings = guard_settings(agreement)
    readers = build_encoders(config, signals)
    encoders = [one if isinstance(one, Encoder) else Encoder(1.0) for one in readers]
    exact = [not isinstance(one, Encoder) for one in readers]
    outputs = len(signals.outputs)
    replay = config.transmitter.rig == "replay"
    sections = reference_sections(config, signals)
    return {
        "alphabet": np.array(agreement.codec.coder.alphabet.symbols, dtype=np.int64),
        "follows": np.array([section is not None and not replay for _, section in sections]),
        "command_max": np.array(terms.limits.command_max),
        "slew": np.array(terms.limits.slew_per_tick),
        "steps_per_unit": np.array(signals.steps_per_unit),
        "initial": np.array(terms.initial_command, dtype=float),
        "safe": np.array(settings.safe_command, dtype=float),
        "soft_limits": np.array(settings.soft_limits or (math.inf,) * outputs, dtype=float),
        "motions": np.array([motion_of(one) for one in signals.outputs]),
        "counts_per_turn": np.where(exact, 0.0, [one.counts_per_turn for one in encoders]),
        "sign": np.array([one.sign for one in encoders]),
        "zero_counts": np.array([one.zero_counts for one in encoders]),
        "turn": np.array([one.turn for one in encoders]),
    }


def work_arrays(codec: Codec, signals: Signals, samples: int, ticks: int, ahead: int) -> Work:
    """Return the arrays that a flight of `samples` and `ticks` writes; `ahead` ticks have a command."""
    states, coder = codec.model.state_size, codec.initial().coder
    inputs, outputs = len(signals.inputs), len(signals.outputs)
    models = np.empty((samples + 1, states))
    coders = np.empty((samples + 1, len(coder)))
    models[0] = codec.model.initial()
    coders[0] = coder
    per_word = codec.coder.alphabet.symbols_per_word
    return Work(
        models=models,
        coders=coders,
        sent=np.zeros(samples * per_word, dtype=np.int64),
        word=np.zeros(per_word, dtype=np.int64),
        model=np.empty(states),
        coder=np.empty(len(coder)),
        spare=np.empty(len(coder)),
        predicted=np.empty(max(states, outputs)),
        correction=np.empty(codec.model.correction_size),
        nothing=np.zeros(codec.model.correction_size),
        seen=np.empty(max(states, outputs)),
        innovation=np.empty(outputs),
        true=np.empty(outputs),
        measured=np.empty(outputs),
        reading=np.empty(outputs, dtype=np.int64),
        read_before=np.empty(outputs, dtype=np.int64),
        still=np.empty(outputs + 1, dtype=np.int64),
        known_command=np.empty(inputs),
        held=np.empty(inputs),
        wanted=np.empty(inputs),
        memory=np.empty(2 * outputs + 1),
        errors=np.empty(outputs),
        rates=np.empty(outputs),
        coded=np.empty((ahead, outputs)),
        live=np.empty((ahead, outputs)),
        commands=np.empty((ahead, inputs)),
        applied=np.empty((ticks, inputs)),
        squares=np.empty((outputs, 3)),
        largest=np.empty((outputs, 3)),
        counted=np.empty(2, dtype=np.int64),
    )


def targets_of(agreement: Agreement, ticks: int, replay: bool) -> Any:
    """Return the set-point of each output at every tick."""
    targets = np.zeros((ticks, len(agreement.signals.outputs)))
    tick_s, fields = agreement.config.timing.tick_s, set(ReferenceSection.model_fields)
    limits = set_point_limits(agreement.config, agreement.signals, agreement.codec.model)
    for place, (output, section) in enumerate(reference_sections(agreement.config, agreement.signals)):
        if section is not None and not replay:
            text = section.as_text(include=fields)
            targets[:, place] = _values(text, tick_s, output, ticks, limits[place])
    return targets


@lru_cache(maxsize=64)
def _values(section: str, tick_s: float, output: Signal, ticks: int, limits: SetPointLimits) -> Any:
    """Return the set-point of every tick; the section as JSON, so that it can be remembered."""
    reference = limits_kept(reference_of(ReferenceSection.of_text(section), tick_s, output), limits)
    return np.array([reference.value(tick) for tick in range(ticks)])


def recorded_arrays(log: FlightLog | None, ahead: int, signals: Signals) -> dict[str, Any]:
    """Return outputs, commands and applied inputs of a recording; empty without one."""
    if log is None:
        return {"recorded": NO_ROWS, "commands": NO_ROWS, "applied": NO_ROWS}
    given = {"recorded": log.measured, "commands": log.commands[:ahead], "applied": log.commands}
    if not log.commands.shape[1]:
        return given | {"commands": np.zeros((ahead, len(signals.inputs))), "applied": NO_ROWS}
    if (more := ahead - len(log.commands)) > 0:
        given["commands"] = np.pad(log.commands, ((0, more), (0, 0)), mode="edge")
    return given
