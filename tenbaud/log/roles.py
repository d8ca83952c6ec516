"""Which column is which signal: as given, or guessed from names, with a note."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from channel.codec.signals import InputSignal, Signal, Signals
from tenbaud.config.schema import FlightLogSection
from tenbaud.log.table import LogError, find_column, listed
from tenbaud.log.units import CLOCK_WORDS, COUNTS, split_unit, stem_of, unit_named, units_like

NO_COLUMN = "0"
EVERY = {"angle": ("angles", "outputs"), "input": ("inputs",)}
"""Names of all signals of a kind, in tables such as `units`."""
ALL = ("angles", "outputs", "inputs")
CLOCKS = ("time", "index")
_INDEX = ("step", "index", "sample", "n", "k", "tick", "row")
_ANGLES = (
    *("pitch", "angle", "theta", "winkel", "pos", "position", "y", "output", "measured", "encoder"),
    *("alpha", "phi", "psi", "x", "heading", "elevation", "travel"),
    *("speed", "omega", "velocity", "rate", "level"),
)
_FRONT = ("front", "right", "uf", "right_motor", "front_motor")
_REAR = ("rear", "left", "back", "ur", "left_motor", "rear_motor", "back_motor")
_INPUTS = (
    *("u", "input", "volts", "voltage", "volt", "v", "spannung", "command", "cmd", "eingang", "mu"),
    *("torque", "current", "pwm", "motor", "control", "i"),
)


@dataclass(frozen=True)
class Chosen:
    """The columns of the signals, by their places in the file."""

    outputs: tuple[tuple[Signal, int], ...]
    inputs: tuple[tuple[InputSignal, int | None], ...]
    """None: there is no such column, and the input is zero"""
    time: int | None
    index: int | None
    notes: tuple[str, ...] = ()

    @property
    def places(self) -> list[int]:
        found = [place for _, place in self.outputs]
        found += [place for _, place in self.inputs if place is not None]
        return found + [place for place in (self.time, self.index) if place is not None]


@dataclass
class Roles:
    """The configured columns of one file, and the guessed ones."""

    path: str
    section: FlightLogSection
    signals: Signals | None
    notes: list[str] = field(default_factory=list)

    def choose(self, names: Sequence[str], units: Sequence[str], known: Mapping[str, str]) -> Chosen:
        """Return the columns; LogError where one is missing, or none can be found."""
        self.notes.clear()  # a file of several sets of signals asks for each
        given = self._given(known)
        clock = {name: self._clock(name, given, names) for name in CLOCKS}
        if clock["time"] is not None and "index" not in given:
            clock["index"] = None
        taken = {place for place in clock.values() if place is not None}
        if self.signals is None:
            outputs, inputs = self._own(given, names, units, taken)
        else:
            outputs, inputs = self._of_model(given, names, taken)
        return Chosen(tuple(outputs), tuple(inputs), clock["time"], clock["index"], tuple(self.notes))

    def _given(self, known: Mapping[str, str]) -> dict[str, str]:
        """Return the columns that are given, by "time", "index", `out:NAME` and `in:NAME`."""
        section = self.section
        found: dict[str, str] = {}
        for role, column in known.items():
            try:
                found[self.role(role)] = column
            except LogError:
                self.notes.append(f"column {column}: left out, {role} is no signal of the model")
        if section.period_s is not None:
            if "time" in section.columns:
                raise LogError(
                    f"{self.path}: both a clock and a period are given; leave out --period, or say "
                    "that the column counts the rows (--columns index=NAME)"
                )
            if "time" in found:  # as the format suggests; at most it counts the rows
                found["index"] = found.pop("time")
        return found | {self.role(name): column for name, column in section.columns.items()}

    def role(self, name: str) -> str:
        """Return `out:NAME`, `in:NAME`, "time" or "index" for a name that a person gives."""
        kind, (prefix, colon, rest) = "", name.partition(":")
        if colon and prefix in ("out", "in"):
            kind, name = prefix, rest
        if not kind and name in CLOCKS:
            return name
        if self.signals is None:
            return f"{kind or ('in' if _is_input(name) else 'out')}:{name}"
        outputs = [one.name for one in self.signals.outputs]
        inputs = [one.name for one in self.signals.inputs]
        for own, signals, aliases in (
            ("out", outputs, ("angle", "output")),
            ("in", inputs, ("input",)),
        ):
            if kind in ("", own) and (name in signals or identifier(name) in signals):
                return f"{own}:{name if name in signals else identifier(name)}"
            if kind in ("", own) and name in aliases and signals:
                return f"{own}:{signals[0]}"
            if kind == own and name.isdigit() and 1 <= int(name) <= len(signals):
                return f"{own}:{signals[int(name) - 1]}"
        raise LogError(
            f"{name} is no signal of the model; it has the outputs {', '.join(outputs)} and the "
            f"inputs {', '.join(inputs)}; time and index are the others"
        )

    def setting(self, values: Mapping[str, object], role: str, kind: str) -> object | None:
        """Return the entry of a signal in a table such as `units`; None if there is none."""
        every = EVERY.get(kind, ())
        own = [value for name, value in values.items() if name not in ALL and self.role(name) == role]
        return (own or [value for name, value in values.items() if name in every] or [None])[-1]

    def _clock(self, name: str, given: Mapping[str, str], names: Sequence[str]) -> int | None:
        if name in given:
            return find_column(self.path, names, given[name])
        if self.section.period_s is not None or any(one in given for one in CLOCKS):
            return None
        words = CLOCK_WORDS if name == "time" else _INDEX
        return self._guess(name, words, names, set())

    def _guess(
        self, what: str, words: Sequence[str], names: Sequence[str], taken: set[int]
    ) -> int | None:
        """Return the first column whose name is one of some words, in the order of the words."""
        stems = [stem_of(name) for name in names]
        for word in words:
            for place, stem in enumerate(stems):
                if stem == word and place not in taken:
                    self.notes.append(f"{what}: column {names[place]}, by its name")
                    return place
        return None

    def _of_model(
        self, given: Mapping[str, str], names: Sequence[str], taken: set[int]
    ) -> tuple[list[tuple[Signal, int]], list[tuple[InputSignal, int | None]]]:
        assert self.signals is not None
        outputs: list[tuple[Signal, int]] = []
        for at, signal in enumerate(self.signals.outputs):
            if column := given.get(f"out:{signal.name}"):
                place: int | None = find_column(self.path, names, column)
            else:
                words = [
                    signal.column,
                    signal.name,
                    *(_ANGLES if len(self.signals.outputs) == 1 else ()),
                ]
                place = self._guess(signal.name, words, names, taken)
            if place is None:
                key = "angle" if not at else signal.name
                raise LogError(
                    f"{self.path}: which column is the {signal.name}? Give --columns {key}=NAME; "
                    f"present: {listed(names)}; `tenbaud log` describes each"
                )
            taken.add(place)
            outputs.append((signal, place))
        named = any(role.startswith("in:") for role in given)
        inputs: list[tuple[InputSignal, int | None]] = []
        for at, one in enumerate(self.signals.inputs):
            column = given.get(f"in:{one.name}", "")
            place = None
            if column and (column != NO_COLUMN or NO_COLUMN in names):
                place = find_column(self.path, names, column)
            elif not column and not named:
                words = _input_words(one, at, len(self.signals.inputs), names)
                place = self._guess(one.name, words, names, taken)
            if place is not None:
                taken.add(place)
            inputs.append((one, place))
        missing = [one.name for one, place in inputs if place is None]
        if missing and len(missing) < len(inputs):
            self.notes.append(f"{', '.join(missing)}: no column, zero")
        return outputs, inputs

    def _own(
        self, given: Mapping[str, str], names: Sequence[str], units: Sequence[str], taken: set[int]
    ) -> tuple[list[tuple[Signal, int]], list[tuple[InputSignal, int | None]]]:
        """Return signals of the file's own: those that are given, or guessed from the names."""
        found: dict[str, dict[str, int | None]] = {"out": {}, "in": {}}
        for role, column in given.items():
            kind, _, name = role.partition(":")
            if kind in found:
                none = column == NO_COLUMN and NO_COLUMN not in names
                found[kind][name] = None if none else find_column(self.path, names, column)
        rest = [place for place in range(len(names)) if place not in taken]
        for kind, words in (("out", _ANGLES), ("in", (*_INPUTS, *_FRONT, *_REAR))):
            for place in rest if not found[kind] else ():
                stem = stem_of(names[place])
                what = "output" if kind == "out" else "input"
                if stem in words or (kind == "in" and _is_input(names[place])):
                    stem += f"_{place + 1}" * (stem in found[kind])
                    found[kind][stem] = place
                    self.notes.append(f"{what} {stem}: column {names[place]}, by its name")
        if not found["out"]:
            raise LogError(
                f"{self.path}: which column is the output? Give --columns out:NAME=COLUMN,"
                f"in:NAME=COLUMN; present: {listed(names)}"
            )
        places = {kind: {identifier(name): at for name, at in found[kind].items()} for kind in found}
        bare = tuple([Signal(name) for name in places["out"]])
        # From here on `units` and its like may name them, or say `angle` and `input`.
        self.signals = Signals(bare, tuple([InputSignal(name) for name in places["in"]]), bare)
        outputs = [
            (Signal(name, self._unit(f"out:{name}", "angle", units[place])), place)
            for name, place in places["out"].items()
            if place is not None
        ]
        inputs = [
            (InputSignal(name, self._unit(f"in:{name}", "input", "" if at is None else units[at])), at)
            for name, at in places["in"].items()
        ]
        self.signals = Signals(
            tuple([one for one, _ in outputs]),
            tuple([one for one, _ in inputs]),
            tuple([one for one, _ in outputs]),
        )
        return outputs, inputs

    def _unit(self, role: str, kind: str, in_file: str) -> str:
        given = str(self.setting(self.section.units, role, kind) or "")
        if given and not unit_named(given):
            known = ", ".join(units_like(""))
            raise LogError(
                f"--units: {given!r} is no unit of {role[role.find(':') + 1 :]}; known are {known}"
            )
        unit = unit_named(given or in_file) or in_file
        return {"deg": "rad", COUNTS: "rad" if kind == "angle" else "", "mV": "V", "mA": "A"}.get(
            unit, unit
        )


def _input_words(signal: InputSignal, at: int, count: int, names: Sequence[str]) -> list[str]:
    """Return the names that an input may have in a file, the likeliest first."""
    words = [stem_of(signal.column), signal.name, *((_FRONT, _REAR)[at] if count == 2 else ())]
    stems = {stem_of(name) for name in names}
    for word in _INPUTS:
        for mark in ("", "_"):
            first = 0 if f"{word}{mark}0" in stems else 1
            words.append(f"{word}{mark}{at + first}")
    return words + ([] if at else list(_INPUTS))


def _is_input(name: str) -> bool:
    stem = stem_of(name)
    numbered = re.sub(r"_?\d+$|_[a-d]$", "", stem)
    return stem in (*_INPUTS, *_FRONT, *_REAR) or (numbered in _INPUTS and numbered != "v")


def identifier(name: str) -> str:
    """Return the name of a signal for the name of a column."""
    text = re.sub(r"[^a-z0-9_]+", "_", split_unit(name)[0].casefold()).strip("_")
    return text if text[:1].isalpha() else f"column_{text or 1}"
