"""Flying one point of a study: compiled where that is possible, with the nodes themselves where not."""

from __future__ import annotations

import math
import sys
from copy import copy
from dataclasses import replace
from typing import Any

import numpy as np

from channel.codec.codec import Codec
from channel.codec.coders.base import FunctionCoder
from channel.codec.numerics import sin
from channel.codec.signals import Signals, signals_of
from channel.flight_log import FlightLog
from tenbaud.build.controllers import build_controller
from tenbaud.build.ends import build_observer, guard_settings
from tenbaud.build.flight import Agreement, kind_of_link
from tenbaud.build.flight_log import read_flight_log
from tenbaud.build.rig import build_plant
from tenbaud.config.kinds import PLANTS
from tenbaud.config.schema import FlightConfig
from tenbaud.flight.verdict import FlightCounts, faults_of
from tenbaud.studies.arrays import (
    observer_arrays,
    recorded_arrays,
    signal_arrays,
    targets_of,
    work_arrays,
)
from tenbaud.studies.compiled import arrays_of, compiled, part, reader, states_read, whole_of
from tenbaud.studies.figures import FlightFigures, OutputFigures, shared_parts
from tenbaud.studies.flight_data import Given, Numbers, Work
from tenbaud.studies.kernel import fly
from tenbaud.studies.laws import law_of
from tenbaud.studies.machine_code import make_ready
from tenbaud.studies.plants import AtRest, PlantParts, plant_parts
from tenbaud.studies.schedule import Schedule, Uncommon, schedule_of
from transmitter.encoder_watch import window_ticks


class CompiledPoint:
    """One configuration, ready to be flown with any seed.

    Building it raises Uncommon where only the nodes can fly it, ConfigError where nobody can.
    `scored_from`: the tick from which errors count, where it is not the usual one.
    """

    _log: FlightLog | None = None
    _clean: Any = None
    _ready = False

    def __init__(self, config: FlightConfig, scored_from: int | None = None) -> None:
        """Build all that does not depend on the seed."""
        self.config, self.scored_from = config, scored_from
        self.agreement = agreement = replace(shared_parts(config), scored_from=scored_from)
        codec, signals, tick_s = agreement.codec, agreement.signals, config.timing.tick_s
        _require_ordinary(config, codec)
        ticks = agreement.flight_ticks
        replay = config.transmitter.rig == "replay"
        self._plant: Any = AtRest()
        if replay:
            self._log = read_flight_log(config, signals)
            ticks = min(ticks, len(self._log))
        else:
            self._plant = build_plant(config, tick_s, signals)
        parts = plant_parts(self._plant, len(signals.outputs))
        pushes = self._plant.pushes(2)
        self._pushed = len(pushes) > 1
        """whether the plant has a disturbance, so that every seed has a plant of its own"""
        law, law_constants = law_of(build_controller(config, model=codec.model), signals, tick_s)
        self.numbers = Numbers(
            ticks=ticks,
            per_sample=agreement.terms.ticks_per_sample,
            lead=agreement.terms.lead_ticks,
            window_start=agreement.window_start_tick,
            impulse=codec.coder.impulse,
            replay=replay,
            uses_rates=codec.uses_rates,
            watch=sys.maxsize if replay else window_ticks(codec.model, agreement.terms.tick_ns / 1e9),
        )
        self.constants: Any = (
            arrays_of(codec.model.constants),  # type: ignore[attr-defined]
            arrays_of(codec.coder.constants),  # type: ignore[attr-defined]
            parts.constants,
            law_constants,
        )
        self.targets = targets_of(agreement, self._ahead, replay)
        self._flight = compiled_flight(codec, signals, law, parts, pushes.shape[1])
        self._start = np.array(parts.start)
        self._timeout_ticks = guard_settings(agreement).timeout_ticks
        self.steady: dict[str, Any] = (
            signal_arrays(agreement)
            | observer_arrays(build_observer(agreement))
            | recorded_arrays(self._log, self._ahead, signals)
        )
        """arrays that do not depend on the seed"""
        self._work = work_arrays(codec, signals, self._samples, ticks, self._ahead)

    @property
    def _samples(self) -> int:
        return -(-self.numbers.ticks // self.numbers.per_sample)

    @property
    def _ahead(self) -> int:
        """Return how many ticks have a command."""
        return self._samples * self.numbers.per_sample + self.numbers.lead

    def fly(self, seed: int) -> tuple[FlightFigures, Work]:
        """Fly with one seed; Uncommon when the flight leaves the ordinary course.

        What it wrote holds until the next flight of this point.
        """
        agreement = self.agreement
        if seed != self.config.seed:
            config = self.config.model_copy(update={"seed": seed})
            agreement = Agreement(
                config, "virtual", agreement.codec, agreement.terms, agreement.identity
            )
        schedule = self.schedule(agreement)
        work = self._work
        if schedule.longest_late > self._timeout_ticks:
            raise Uncommon("a flight whose guard steps in")
        arguments = (self.numbers, self.constants, self.given(schedule, agreement), work)
        if not self._ready:
            make_ready(self._flight, *arguments)
            self._ready = True
        try:
            kept = self._flight(*arguments)
        except ValueError as error:
            raise Uncommon(str(error)) from error
        if not kept:
            raise Uncommon("the flight left its ordinary course")
        if faults_of(self._counts(schedule)):
            raise Uncommon("what does not count as flown, for the reason that the nodes give")
        return self._figures(schedule), work

    def on(self, log: FlightLog, scored_from: int) -> CompiledPoint:
        """Return this point on another record, which is no longer than its own; `use` comes first."""
        agreement = replace(self.agreement, scored_from=scored_from)
        other = copy(self)
        other.agreement, other.scored_from = agreement, scored_from
        other._log, other._clean = log, None
        other.numbers = self.numbers._replace(ticks=len(log), window_start=scored_from)
        other.steady = self.steady | recorded_arrays(log, other._ahead, agreement.signals)
        del other._work
        return other

    def use(self, agreement: Agreement, observer: dict[str, Any]) -> None:
        """Fly with another model and coder of the same kinds, and arrays of their observer."""
        self.agreement = replace(agreement, scored_from=self.scored_from)
        self.config, codec = agreement.config, agreement.codec
        model: Any = codec.model
        coder: Any = codec.coder
        self.constants = (arrays_of(model.constants), arrays_of(coder.constants), *self.constants[2:])
        self.steady = self.steady | observer
        ticks, signals = self.numbers.ticks, agreement.signals
        self._work = work_arrays(codec, signals, self._samples, ticks, self._ahead)

    def rest(self) -> None:
        """Give back what a flight wrote: points of a long record need the room in turn."""
        del self._work

    def _counts(self, schedule: Schedule) -> FlightCounts:
        """Return the counts for the verdict on a flight; a compiled one has no rejoin and no stop."""
        ticks = self.numbers.ticks
        return FlightCounts(
            samples=self._samples,
            confirmed=int(np.count_nonzero(schedule.scored)),
            erased=schedule.erasures,
            rejoins=0,
            ticks=ticks,
            ticks_commanded=ticks - schedule.commands_late,
        )

    def _figures(self, schedule: Schedule) -> FlightFigures:
        numbers, work = self.numbers, self._work
        coded, live = work.counted.tolist()
        followed = numbers.ticks - numbers.window_start
        figures = []
        for squares, largest, follows in zip(
            work.squares.tolist(), work.largest.tolist(), self.steady["follows"], strict=True
        ):
            figures.append(
                OutputFigures(
                    error_coded_rms=_rms(squares[0], coded),
                    error_coded_max=largest[0],
                    error_live_rms=_rms(squares[1], live),
                    error_live_max=largest[1],
                    tracking_rms=_rms(squares[2], followed if follows else 0),
                    amplitude=largest[2],
                )
            )
        return FlightFigures(
            outcome="ok",
            engine="compiled",
            not_compiled="",
            outputs=tuple(figures),
            erasures=schedule.erasures,
            commands_late=schedule.commands_late,
            samples=self._samples,
        )

    def schedule(self, agreement: Agreement) -> Schedule:
        """Return the line's effects; without faults the same for all seeds."""
        if self._clean is None or agreement.faults.any:
            self._clean = schedule_of(agreement, self._samples, self.numbers.ticks)
        clean: Schedule = self._clean
        return clean

    def given(self, schedule: Schedule, agreement: Agreement) -> Given:
        plant = self._plant
        if self._pushed and agreement is not self.agreement:
            plant = build_plant(agreement.config, agreement.config.timing.tick_s, agreement.signals)
        return Given(
            start=self._start,
            shifts=schedule.shifts,
            known=schedule.known,
            late=schedule.late,
            scored=schedule.scored,
            pushes=plant.pushes(self.numbers.ticks),
            targets=self.targets,
            **self.steady,
        )


def compiled_flight(codec: Codec, signals: Signals, law: Any, plant: PlantParts, places: int) -> Any:
    """Return the compiled flight for the kinds of model, coder, law and plant, pushed in `places`."""
    encode, decode, allocates = codec.coder.functions  # type: ignore[attr-defined]
    inputs, outputs = len(signals.inputs), len(signals.outputs)
    row = getattr(codec.model, "row_function", None)
    output = getattr(codec.model, "output_function", None)
    parts = (
        ("INPUTS", inputs),
        ("OUTPUTS", outputs),
        ("tick", whole_of(row, True) if row else part(codec.model.tick_function)),  # type: ignore[attr-defined]
        ("output_of", part(output) if output else states_read(signals.output_states)),
        ("encode", part(encode, allocates=allocates, inlined=not allocates)),
        ("decode", part(decode, allocates=allocates, inlined=not allocates)),
        ("law", part(law, (("INPUTS", inputs),))),
        ("state_of", reader(codec.model.state_size)),
        ("held_of", reader(codec.model.correction_size)),
        ("command_of", reader(inputs)),
        ("plant_of", plant.of),
        ("push_of", reader(places)),
        ("plant_step", plant.step),
        ("plant_output", plant.output),
        ("sine", part(sin)),
    )
    return compiled(fly, parts)


def _require_ordinary(config: FlightConfig, codec: Codec) -> None:
    """Raise Uncommon where parts are configured that only the nodes have."""
    rig, plant = config.transmitter.rig, config.plant_kind
    if (rig == "replay") != (config.receiver.controller == "recorded"):
        raise Uncommon(f"the rig {rig} with the controller {config.receiver.controller}")
    if rig == "simulated" and plant not in PLANTS.built_in:
        raise Uncommon("a plant from outside")
    if config.transmitter.sabotage or config.receiver.sabotage or config.transmitter.dry_run:
        raise Uncommon("sabotage and dry runs")
    if config.channel.downlink != "full":
        raise Uncommon(f"the {config.channel.downlink} downlink")
    if kind_of_link(config).changes_terms:
        raise Uncommon("a link on which bytes take time, such as a serial line")
    model, coder = codec.model, codec.coder
    written = hasattr(model, "tick_function") or hasattr(model, "row_function")
    if not (written and isinstance(coder, FunctionCoder)):
        raise Uncommon("a model or coder that is not written as functions")
    unread = None in signals_of(model).output_states and not hasattr(model, "output_function")
    if unread:
        raise Uncommon("a model whose outputs are neither states nor written as a function")


def _rms(squares: float, count: int) -> float:
    return math.sqrt(squares / count) if count else math.nan
