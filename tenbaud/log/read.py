"""From a file and its section of the configuration to a flight log."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from channel.codec.signals import Signal, Signals
from channel.flight_log import FlightLog
from plant_sim.encoder import Encoder, OutputReader
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.angles import counts_of, step_of, turn_of, unwrapped, without_spikes
from tenbaud.log.beside import with_file_beside
from tenbaud.log.clock import Clock, by_index, by_period, by_time, counts_rows, has_fractions
from tenbaud.log.join import table_of
from tenbaud.log.reader import Reader, read_table
from tenbaud.log.roles import Chosen, Roles
from tenbaud.log.table import Array, LogError, Table
from tenbaud.log.units import (
    COUNTS,
    DATE_TIME,
    factor,
    is_speed,
    says_counts,
    split_unit,
    unit_named,
    units_like,
)

ROWS_MIN = 2
COUNTS_MAX = 2.0**53
ROWS_NAMED = 3


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Log(FlightLog):
    """A flight log, and which signals its columns are."""

    signals: Signals


def read_log(
    section: FlightLogSection,
    signals: Signals | None,
    encoders: tuple[OutputReader, ...] = (),
    tick_s: float | None = None,
    read: Reader = read_table,
) -> Log:
    """Return the log that a section names, in the units of `signals`.

    Without signals they are the file's own: those that the section names, or guessed from the
    columns. `encoders` read the outputs; `tick_s` is the time between rows where neither file nor
    section say it. `read` is what reads a file. LogError names file, line, column and the next step.
    """
    if not section.file:
        raise LogError("flight_log.file names no recording; give --rig replay:FILE")
    section = with_file_beside(section)
    roles = Roles(section.file, section, signals)
    chosen: list[Chosen] = []

    def wanted(*columns: Any) -> list[int]:
        chosen.append(roles.choose(*columns))
        return chosen[-1].places

    def held() -> list[int | None]:
        return [place for _, place in chosen[-1].inputs]

    table, joined = table_of(section, read, wanted, held)
    notes = (table.source, *joined, *chosen[-1].notes)
    return _Reading(table, chosen[-1], roles, encoders, tick_s, list(notes)).log()


@dataclass
class _Reading:
    """One table on its way to a flight log."""

    table: Table
    chosen: Chosen
    roles: Roles
    encoders: tuple[OutputReader, ...]
    tick_s: float | None
    notes: list[str]

    def __post_init__(self) -> None:
        self.section = self.roles.section
        self.at = {place: at for at, place in enumerate(self.chosen.places)}
        """place in the file to place in the table"""

    def log(self) -> Log:
        clock = self._clock()
        rows = clock.rows.stop - clock.rows.start
        if rows < ROWS_MIN:
            raise LogError(
                f"{self.table.path}: {rows} row(s) of numbers; a log needs at least {ROWS_MIN}"
            )
        self.notes += clock.notes
        outputs, inputs = self.chosen.outputs, self.chosen.inputs
        measured = np.empty((clock.count, len(outputs)))
        counts = np.empty((clock.count, len(outputs)), dtype=np.int64)
        steps = [
            self._output(at, signal, self.at[place], clock, measured, counts)
            for at, (signal, place) in enumerate(outputs)
        ]
        commands = np.zeros((clock.count, len(inputs)))
        for at, (signal, found) in enumerate(inputs):
            if found is not None:
                commands[:, at] = clock.held(self._input(signal, self.at[found], clock))
        if not self._has_inputs():
            commands = np.zeros((clock.count, 0))
        return Log(
            clock.tick_s,
            measured,
            commands,
            counts,
            clock.start_s,
            tuple(self.notes),
            tuple(steps),
            signals=cast(Signals, self.roles.signals),
        )

    def _has_inputs(self) -> bool:
        named = any(self.roles.role(name).startswith("in:") for name in self.section.columns)
        return named or any(place is not None for _, place in self.chosen.inputs)

    def _clock(self) -> Clock:
        section, chosen, table = self.section, self.chosen, self.table
        index = None if chosen.index is None else self.at[chosen.index]
        time = chosen.time
        if index is not None and section.period_s is not None:
            if not counts_rows(table.columns[index]):
                self.notes.append(f"column {table.names[index]} not used: the period is given")
                index = None
        elif time is None and index is not None and has_fractions(table.columns[index]):
            time = chosen.index
            self.notes.append(f"column {table.names[index]}: the clock, as its values are not whole")
        if time is not None:
            column = self.at[time]
            given = str(self.roles.setting(section.units, "time", "time") or "")
            if given and table.units[column] == DATE_TIME:
                raise LogError(
                    f"{table.path}, column {table.names[column]}: the times are dates, which have no "
                    f"unit; leave out --units time={given}"
                )
            unit = given or table.units[column]
            scale, offset = self._linear("time", "time")
            return by_time(table, column, scale, offset, unit, section.start_s, section.end_s)
        period_s = section.period_s or table.period_s
        if period_s is None:
            period_s = self.tick_s
            if period_s is None:
                raise LogError(
                    f"{table.path}: no column is a clock; say which is (--columns time=NAME), or how "
                    "far apart the rows are (--period SECONDS)"
                )
            self._refuse_unused_clock()
            self.notes.append(f"rows {period_s:g} s apart: timing.tick_s, as the file has no clock")
        if index is not None:
            return by_index(table, index, period_s, section.start_s, section.end_s)
        return by_period(len(table), period_s, section.start_s, section.end_s)

    def _refuse_unused_clock(self) -> None:
        """Raise LogError where the first column looks like a clock that nobody named."""
        if self.section.join or self.chosen.index is not None or 0 in self.chosen.places:
            return
        first = read_table(self.section.file, lambda names, units, known: [0])
        values = first.columns[0]
        if len(values) < ROWS_MIN or not np.all(np.diff(values) > 0.0):
            return
        name, step = first.names[0], float(np.median(np.diff(values)))
        raise LogError(
            f"{first.path}: column {name} rises by {step:g} a row; if it is the clock, give --columns "
            f"time={name}, if it counts the rows, --columns index={name}, if neither, --period SECONDS"
        )

    def _given_unit(self, role: str, kind: str, signal: Signal) -> str:
        given = str(self.roles.setting(self.section.units, role, kind) or "")
        unit = unit_named(given)
        fits = (kind == "angle" and unit == COUNTS) or (unit and factor(unit, signal.unit) is not None)
        if given not in ("", signal.unit) and not fits:
            raise LogError(
                f"--units: {given!r} is no unit of {signal.name}; known are "
                f"{', '.join(units_like(signal.unit))}"
            )
        return unit or given

    def _linear(self, role: str, kind: str) -> tuple[float, float]:
        """Return the factor of a column's numbers, and the offset added then."""
        section, setting = self.section, self.roles.setting
        sign = cast(float | None, setting(section.signs, role, kind))
        scale = cast(float | None, setting(section.scales, role, kind))
        offset = cast(float | None, setting(section.offsets, role, kind))
        by = (1.0 if sign is None else sign) * (1.0 if scale is None else scale)
        return by, offset or 0.0

    def _values(self, column: int, role: str, kind: str, clock: Clock) -> Array:
        by, offset = self._linear(role, kind)
        values = self.table.check(column, clock.rows)
        return values if (by, offset) == (1.0, 0.0) else by * values + offset

    def _output(
        self, at: int, signal: Signal, column: int, clock: Clock, measured: Array, counts: np.ndarray
    ) -> float:
        """Fill in one output; return how far its values lie apart."""
        role = f"out:{signal.name}"
        values = self._values(column, role, "angle", clock)
        unit = self._given_unit(role, "angle", signal) or self._unit_of(column, values, signal)
        encoder = self.encoders[at] if self.encoders else None
        values = self._straight(values, turn_of(unit, encoder), column, clock, signal)
        if unit == COUNTS:
            if not isinstance(encoder, Encoder):
                encoder = Encoder(4096)
                self.notes.append(f"{signal.name}: 4096 counts a turn, as nothing says how many")
            self._check_whole(values, column, clock)
            counts[:, at] = np.round(clock.line(values)).astype(np.int64)
            turned = encoder.sign * (counts[:, at] - encoder.zero_counts) * encoder.turn
            measured[:, at] = turned / encoder.counts_per_turn
            return encoder.step
        by = self._factor(unit, signal)
        measured[:, at] = clock.line(values) * by
        step = step_of(values) * by
        counts[:, at] = counts_of(measured[:, at], Encoder(1.0 / step, turn=1.0) if step else None)
        return step

    def _unit_of(self, column: int, values: Array, signal: Signal) -> str:
        unit = unit_named(self.table.units[column]) or split_unit(self.table.names[column])[1]
        if unit:
            return unit
        name = self.table.names[column]
        if (
            np.all(values == np.floor(values))
            and np.ptp(values) > 0.0
            and signal.unit in ("", "rad", "deg")
        ):
            if is_speed(name) or not (signal.unit or says_counts(name)):
                raise LogError(
                    f"{self.table.path}, column {name}: whole numbers of an unknown unit; say which: "
                    f"--units {signal.name}=counts, deg, rpm ..."
                )
            self.notes.append(f"{signal.name}: in counts, as all its values are whole numbers")
            return COUNTS
        largest = float(np.max(np.abs(values)))
        if signal.unit == "rad" and largest > 30.0:
            self.notes.append(
                f"{signal.name}: taken as rad, and it reaches {largest:.4g}; if it is deg, give "
                f"--units {signal.name}=deg"
            )
        return signal.unit

    def _factor(self, unit: str, signal: Signal) -> float:
        found = factor(unit, signal.unit)
        if found is None:
            self.notes.append(
                f"{signal.name}: in {unit}, and the model's is in {signal.unit}: taken as it is"
            )
        return 1.0 if found is None else found

    def _straight(
        self, values: Array, turn: float | None, column: int, clock: Clock, signal: Signal
    ) -> Array:
        cleaned, name = without_spikes(values, turn), signal.name
        if cleaned.rows:
            found = f"{name}: {len(cleaned.rows)} spike(s), {self._lines(cleaned.rows, clock)}"
            if self.section.remove_spikes:
                values = cleaned.values
            done = ": removed" if self.section.remove_spikes else "; --remove-spikes removes them"
            self.notes.append(found + done)
        if np.ptp(values) == 0.0:
            self.notes.append(f"{name}: constant")
        if turn is None:
            return values
        whole = unwrapped(values, turn)
        if whole.rows:
            lines = self._lines(whole.rows, clock)
            self.notes.append(f"{name}: unwrapped at {len(whole.rows)} jump(s) of a turn, {lines}")
        if np.ptp(whole.values) > 2.0 * turn:
            self.notes.append(f"{name}: turns {np.ptp(whole.values) / turn:.1f} times")
        return whole.values

    def _lines(self, rows: tuple[int, ...], clock: Clock) -> str:
        places = [self.table.place(row + clock.rows.start) for row in rows[:ROWS_NAMED]]
        return ", ".join(places) + (" ..." if len(rows) > ROWS_NAMED else "")

    def _check_whole(self, values: Array, column: int, clock: Clock) -> None:
        wrong = np.flatnonzero((values != np.floor(values)) | (np.abs(values) > COUNTS_MAX))
        if len(wrong):
            row = int(wrong[0])
            raise self.table.fault(
                clock.rows.start + row,
                column,
                f"'{values[row]:g}' is not a whole number within +-2^53, and the column is in counts; "
                "give its unit with --units: rad or deg",
            )

    def _input(self, signal: Signal, column: int, clock: Clock) -> Array:
        role = f"in:{signal.name}"
        values = self._values(column, role, "input", clock)
        unit = self._given_unit(role, "input", signal) or unit_named(self.table.units[column])
        return values * self._factor(unit, signal)
