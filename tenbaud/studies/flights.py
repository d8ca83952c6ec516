"""Flying one point of a study: compiled where that is possible, with the nodes themselves where not."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from channel.codec.codec import Codec, Vector
from channel.codec.coders.base import FunctionCoder
from channel.codec.models.linear import LinearModel
from channel.codec.numerics import sin
from channel.codec.signals import Signal
from channel.flight_log import FlightLog
from plant_sim.disturbance import parse_disturbance
from plant_sim.encoder import Encoder
from plant_sim.pitch import pitch_constants
from receiver.controllers.base import Controller
from receiver.controllers.pid import PidConstants, PidLoops
from receiver.controllers.recorded import RecordedController
from tenbaud.build.controllers import build_controller
from tenbaud.build.ends import build_observer, guard_settings
from tenbaud.build.flight import Agreement, kind_of_link, read_flight_log
from tenbaud.build.references import reference_of, reference_sections
from tenbaud.build.rig import nominal_plant
from tenbaud.build.signals import build_encoders
from tenbaud.config.load import ConfigError
from tenbaud.config.schema import FlightConfig, FlightLogSection, ReferenceSection
from tenbaud.flight.verdict import FlightCounts, faults_of
from tenbaud.studies.compiled import arrays_of, compiled, reader, tick_of_rows
from tenbaud.studies.figures import FlightFigures, shared_parts
from tenbaud.studies.flight_data import DONE, Errors, Given, Motion, Numbers, Work
from tenbaud.studies.kernel import fly
from tenbaud.studies.schedule import Schedule, Uncommon, schedule_of
from transmitter.encoder_watch import window_ticks
from transmitter.session.state_observer import StateObserver

NOTHING = np.zeros(0)
NO_PAIRS = np.zeros((0, 2))


@dataclass(slots=True)
class Trace:
    """States of a compiled flight, for comparisons."""

    models: Any
    coders: Any
    coded: Any
    live: Any
    front: Any
    rear: Any


@dataclass(slots=True)
class CompiledPoint:
    """One configuration, ready to be flown with any seed.

    Building it raises Uncommon where only the nodes can fly it, ConfigError where nobody can.
    """

    config: FlightConfig
    scored_from: int | None = None
    """the tick from which errors count, where it is not the usual one"""
    agreement: Agreement = field(init=False)
    numbers: Numbers = field(init=False)
    constants: Any = field(init=False)
    _log: FlightLog | None = field(init=False, default=None)
    reference: Any = field(init=False)
    _clean: Any = field(init=False, default=None)
    _observer: StateObserver | None = field(init=False)
    _work: Work = field(init=False)

    def __post_init__(self) -> None:
        """Build all that does not depend on the seed."""
        config = self.config
        self.agreement = replace(shared_parts(config), scored_from=self.scored_from)
        _require_ordinary(config, self.agreement.codec)
        replay = config.transmitter.rig == "replay"
        ticks = self.agreement.flight_ticks
        if replay:
            self._log = recorded_flight(config)
            ticks = min(ticks, len(self._log))
        controller = build_controller(config, model=self.agreement.codec.model)
        pid, bias = _pid(controller, self.agreement.codec.model.initial())
        self.numbers = _numbers(self.agreement, ticks, replay, bias)
        plant = nominal_plant(config).mismatched(config.transmitter.plant.mismatch)
        codec = self.agreement.codec
        self._observer = build_observer(self.agreement)
        self.constants = (
            arrays_of(codec.model.constants),  # type: ignore[attr-defined]
            arrays_of(codec.coder.constants),  # type: ignore[attr-defined]
            pitch_constants(plant, config.timing.tick_s),
            pid,
        )
        self.reference = NOTHING if replay else _reference(self.agreement, self._ahead)
        self._work = _work(codec, self._samples, ticks, self._ahead)

    @property
    def _samples(self) -> int:
        return -(-self.numbers.ticks // self.numbers.per_sample)

    @property
    def _ahead(self) -> int:
        """Return how many ticks have a command."""
        return self._samples * self.numbers.per_sample + self.numbers.lead

    def fly(self, seed: int) -> tuple[FlightFigures, Trace]:
        """Fly with one seed; Uncommon when the flight leaves the ordinary course.

        The trace holds until the next flight of this point.
        """
        agreement = self.agreement
        if seed != self.config.seed:
            config = self.config.model_copy(update={"seed": seed})
            agreement = Agreement(
                config, "virtual", agreement.codec, agreement.terms, agreement.identity
            )
        schedule = self.schedule(agreement)
        work = self._work
        torque = torque_of(agreement.config, agreement.config.seed, self.numbers.ticks)
        given = self.given(schedule, torque)
        flight = compiled_flight(agreement.codec)
        try:
            status, motion, errors = flight(self.numbers, self.constants, given, work)
        except ValueError as error:
            raise Uncommon(str(error)) from error
        if status != DONE:
            raise Uncommon("the flight left its ordinary course")
        if faults_of(self._counts(schedule, motion)):
            raise Uncommon("what does not count as flown, for the reason that the nodes give")
        figures = flight_figures(errors, motion, schedule.erasures, self._samples)
        return figures, Trace(work.models, work.coders, work.coded, work.live, work.front, work.rear)

    def _counts(self, schedule: Schedule, motion: Motion) -> FlightCounts:
        """Return what the verdict on a flight rests on; a compiled one has no rejoin and no stop."""
        ticks = self.numbers.ticks
        return FlightCounts(
            samples=self._samples,
            confirmed=int(np.count_nonzero(schedule.scored)),
            erased=schedule.erasures,
            rejoins=0,
            ticks=ticks,
            ticks_commanded=ticks - motion.late,
        )

    def figures(self, seed: int) -> FlightFigures | None:
        """Fly with one seed; None for a flight that only the nodes can fly."""
        try:
            return self.fly(seed)[0]
        except Uncommon:
            return None

    def schedule(self, agreement: Agreement) -> Schedule:
        """Return what the line does; on one without faults the same for all seeds."""
        if self._clean is None or agreement.faults.any:
            self._clean = schedule_of(agreement, self._samples, self.numbers.ticks)
        clean: Schedule = self._clean
        return clean

    def given(self, schedule: Schedule, torque: Any) -> Given:
        """Return what a flight reads."""
        return Given(
            np.array([(*self.config.transmitter.plant.initial_outputs, 0.0)[0], 0.0]),
            np.array(self.agreement.codec.coder.alphabet.symbols, dtype=np.int64),
            schedule.shifts,
            schedule.known,
            schedule.late,
            schedule.scored,
            self.reference,
            torque,
            *_recorded(self._log, self._ahead),
            *_observer(self._observer),
        )


def compiled_flight(codec: Codec) -> Any:
    """Return the compiled flight for a codec's kinds of model and coder."""
    encode, decode, allocates = codec.coder.functions  # type: ignore[attr-defined]
    parts = (
        ("tick", _compiled_tick(codec.model)),
        ("encode", compiled(encode, allocates=allocates)),
        ("decode", compiled(decode, allocates=allocates)),
        ("state_of", reader(codec.model.state_size)),
        ("held_of", reader(codec.model.correction_size)),
        ("sine", compiled(sin)),
    )
    return compiled(fly, parts)


def _compiled_tick(model: Any) -> Any:
    if hasattr(model, "row_function"):
        return tick_of_rows(model.row_function, model.state_size)
    return compiled(model.tick_function)


def _observer(observer: StateObserver | None) -> tuple[Any, Any, Any]:
    """Return gains, gains after a gap and largest states of the transmitter's observer."""
    if observer is None:
        return NO_PAIRS, NO_PAIRS, NOTHING
    return np.array(observer.gains), np.array(observer.anew), np.array(observer.largest)


def _require_ordinary(config: FlightConfig, codec: Codec) -> None:
    """Raise Uncommon where parts are configured that only the nodes have."""
    rig, controller = config.transmitter.rig, config.receiver.controller
    if (rig, controller) not in (("simulated", "pid"), ("replay", "recorded")):
        raise Uncommon(f"the rig {rig} with the controller {controller}")
    if rig == "simulated" and config.plant_kind != "pitch":
        raise Uncommon("a plant from outside")
    if config.transmitter.sabotage or config.receiver.sabotage or config.transmitter.dry_run:
        raise Uncommon("sabotage and dry runs")
    if kind_of_link(config).changes_terms:
        raise Uncommon("a link on which bytes take time, such as a serial line")
    model, coder = codec.model, codec.coder
    if model.input_size != 2 or len(model.measured(model.initial())) != 1:
        raise Uncommon("a plant that is not of one output and two inputs")
    functions = hasattr(model, "tick_function") or hasattr(model, "row_function")
    if not (functions and isinstance(coder, FunctionCoder)):
        raise Uncommon("a model or coder that is not written as functions")
    if isinstance(model, LinearModel) and model.outputs != ((1.0, *[0.0] * (model.state_size - 1)),):
        raise Uncommon("a linear model whose output is not its first state")


def _numbers(agreement: Agreement, ticks: int, replay: bool, bias: tuple[float, float]) -> Numbers:
    config, terms = agreement.config, agreement.terms
    settings = guard_settings(agreement)
    encoder = build_encoders(config, agreement.signals)[0]
    if not isinstance(encoder, Encoder):
        raise Uncommon("an output that is read exactly")
    return Numbers(
        ticks=ticks,
        per_sample=terms.ticks_per_sample,
        lead=terms.lead_ticks,
        window_start=agreement.window_start_tick,
        impulse=agreement.codec.coder.impulse,
        replay=replay,
        command_max=_pair(terms.limits.command_max),
        slew=_pair(terms.limits.slew_per_tick),
        steps_per_unit=_pair(terms.signals.steps_per_unit),
        bias=bias,
        initial_front=float(terms.initial_command[0]),
        initial_rear=float(terms.initial_command[1]),
        safe_front=float(settings.safe_command[0]),
        safe_rear=float(settings.safe_command[1]),
        guard_timeout=settings.timeout_ticks,
        soft_limit=float(settings.soft_limits[0]) if settings.soft_limits else math.inf,
        watch=window_ticks(agreement.codec.model, terms.tick_ns / 1e9),
        counts_per_turn=int(encoder.counts_per_turn),
        uses_rates=agreement.codec.uses_rates,
        sign=encoder.sign,
        zero_counts=encoder.zero_counts,
    )


def _pair(values: Vector) -> tuple[float, float]:
    return values[0], values[1]


def _pid(controller: Controller, state: Vector) -> tuple[PidConstants, tuple[float, float]]:
    """Return the one loop of a controller, and the bias; Uncommon for another than the kernel's."""
    if not isinstance(controller, PidLoops):
        return PidConstants(0.0, 0.0, 0.0, (0.0, 0.0), False), (0.0, 0.0)
    places = tuple(float(place) for place in range(len(state)))
    for loop in controller.loops:
        if (len(controller.loops), loop.value(places), loop.rate(places)) != (1, 0.0, 1.0):
            raise Uncommon("a controller that is not one loop on the first state and its rate")
    return controller.loops[0].constants, _pair(controller.bias)


def _work(codec: Codec, samples: int, ticks: int, ahead: int) -> Work:
    states, coder = codec.model.state_size, codec.initial().coder
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
        correction=np.empty(codec.model.correction_size),
        nothing=np.zeros(codec.model.correction_size),
        seen=np.empty(states),
        given_out=np.empty(2),
        coded=np.empty(ahead),
        live=np.empty(ahead),
        front=np.empty(ahead),
        rear=np.empty(ahead),
        applied=np.empty((ticks, 2)),
    )


def _reference(agreement: Agreement, ticks: int) -> Any:
    output, section = reference_sections(agreement.config, agreement.signals)[0]
    if section is None:
        return NOTHING
    return _values(section.model_dump_json(), agreement.config.timing.tick_s, output, ticks)


@lru_cache(maxsize=64)
def _values(section: str, tick_s: float, output: Signal, ticks: int) -> Any:
    """Return the set-point of every tick; the section as JSON, so that it can be remembered."""
    reference = reference_of(ReferenceSection.model_validate_json(section), tick_s, output)
    return np.array([reference.value(tick) for tick in range(ticks)])


def recorded_flight(config: FlightConfig) -> FlightLog:
    """Return the recorded flight of a configuration, read once as long as its file stays the same."""
    path = Path(config.flight_log.file)
    changed = path.stat().st_mtime_ns if path.exists() else 0
    return _recorded_flight(config.flight_log.model_dump_json(), changed)


@lru_cache(maxsize=4)
def _recorded_flight(section: str, changed: int) -> FlightLog:
    log = FlightLogSection.model_validate_json(section)
    return read_flight_log(FlightConfig(flight_log=log))


def torque_of(config: FlightConfig, seed: int, ticks: int) -> Any:
    """Return the torque of every tick; empty without a disturbance."""
    text = config.transmitter.plant.disturbance
    if not text or config.transmitter.rig == "replay":
        return NOTHING
    try:
        return parse_disturbance(text, config.timing.tick_s, seed).torques(ticks)
    except ValueError as error:
        raise ConfigError(f"transmitter.plant.disturbance: {error}") from error


def _recorded(log: FlightLog | None, ahead: int) -> tuple[Any, Any, Any]:
    """Return counts, commands and applied voltages of a recording; empty without one."""
    if log is None:
        return NOTHING.astype(np.int64), NO_PAIRS, NO_PAIRS
    counts = np.array([row[0] for row in log.counts], dtype=np.int64)
    controller = RecordedController(log)
    commands = np.array([controller.command(tick, ()) for tick in range(ahead)])
    return counts, commands, np.array(log.volts, dtype=float)


def flight_figures(errors: Errors, motion: Motion, erasures: int, samples: int) -> FlightFigures:
    """Return what a study keeps of a compiled flight."""
    return FlightFigures(
        outcome="ok",
        engine="compiled",
        error_coded_rms=_rms(errors.coded_squares, errors.coded_count),
        error_coded_max=errors.coded_max,
        error_live_rms=_rms(errors.live_squares, errors.live_count),
        error_live_max=errors.live_max,
        tracking_rms=_rms(errors.tracking_squares, errors.tracking_count),
        pitch_amplitude=errors.angle_max,
        erasures=erasures,
        commands_late=motion.late,
        samples=samples,
    )


def _rms(squares: float, count: int) -> float:
    return math.sqrt(squares / count) if count else math.nan
