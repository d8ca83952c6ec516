"""Sources of a record: the configured rig, a log or a run, or arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from channel.codec.signals import Signals
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.excitation import excite, parse_excitation
from plant_sim.identification.record import Record
from tenbaud.build.first_contact import drives_motors
from tenbaud.build.rig import build_rig, real_rig_name
from tenbaud.build.signals import build_encoders, configured_signals, encoder_steps
from tenbaud.config.schema import FlightConfig, FlightLogSection
from tenbaud.identification.bits import Bits, read_bits
from tenbaud.identification.structure import SPEEDS, record_of
from tenbaud.log.angles import step_of
from tenbaud.log.table import LogError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

ALIASES = ("angle", "output", "input", "time", "index", "front", "rear")


@dataclass(frozen=True, slots=True, eq=False)
class Source:
    """A record, its name, and the changes to its file."""

    name: str
    record: Record
    notes: tuple[str, ...] = ()
    file: Path | None = None
    dropped: tuple[str, ...] = ()
    """set-points in the file, which are no inputs"""
    excited: bool = False
    """the configured rig moved as this command made it"""
    bits: Bits | None = None
    """the transmitted data of the run, where nothing else may be used"""


def from_rig(config: FlightConfig, excitation: str, duration_s: float) -> Record:
    """Excite the configured rig and return its encoder's readings."""
    if drives_motors(config):
        named = real_rig_name(config.transmitter)
        raise IdentificationError(
            f"the motors of {named} stay off: this command excites simulated rigs only. Fly it and "
            "give the run: `tenbaud demo --clock real --config FILE --out run`, then "
            "`tenbaud identify run`"
        )
    tick_s = config.timing.tick_s
    signals = configured_signals(config)
    if len(signals.outputs) != 1 or len(signals.inputs) != 2:
        raise IdentificationError(
            "only a pitch axis is excited by this command; record a flight of this rig, with its "
            "commands, and give the file or the folder of the run"
        )
    with build_rig(config) as rig:

        def step(tick: int, front: float, rear: float) -> float | None:
            reading = rig.read(tick)
            rig.write(tick, (front, rear))
            return None if reading is None else reading.measured[0]

        signal = parse_excitation(excitation, tick_s)
        force = config.receiver.pid.normal_force_volts
        record = excite(step, signal, tick_s, duration_s, normal_force_volts=force)
    return replace(record, steps=tuple(encoder_steps(config, signals)))


def from_log(
    config: FlightConfig, structure: str = "", tick_s: float | None = None
) -> tuple[Record, tuple[str, ...]]:
    """Return the record in the log that a configuration names, and the changes to the file.

    The signals are those of the model, or the file's own where the structure is none of the model.
    `tick_s` is the time between rows of a file without a clock. LogError where it cannot be used.
    """
    from tenbaud.log.read import read_log

    # On the file's own clock: a flight may resample it, an identification need not.
    signals = None if _own_signals(config, structure) else configured_signals(config)
    encoders = () if signals is None else build_encoders(config, signals)
    log = read_log(config.flight_log, signals, encoders, tick_s)
    return record_of(log.tick_s, log.measured, log.commands, log.signals, log.steps), log.notes


def from_bits(path: Path) -> Source:
    """Return the transmitted data of a run; the file is named if it also holds measurements."""
    bits = read_bits(path)
    measured = "transmitter" in bits.ends
    note = () if measured else ("the run holds no measurements, so nothing can be flown over them",)
    return Source(path.name, bits.record(), note, path if measured else None, bits=bits)


def from_arrays(
    arrays: Mapping[str, ArrayLike],
    outputs: tuple[str, ...],
    inputs: tuple[str, ...],
    tick_s: float | None,
    units: Mapping[str, str],
) -> Source:
    """Return the record in a table of arrays; IdentificationError where they cannot form one."""
    if tick_s is None or not outputs:
        raise IdentificationError(
            "arrays need tick_s, the time between two rows, and outputs=(name, ...)"
        )
    missing = [name for name in (*outputs, *inputs) if name not in arrays]
    if missing:
        raise IdentificationError(f"no array is called {missing[0]}; there are {', '.join(arrays)}")
    columns = {name: np.asarray(arrays[name], dtype=np.float64) for name in (*outputs, *inputs)}
    lengths = {values.shape for values in columns.values()}
    if len(lengths) != 1 or len(next(iter(lengths))) != 1:
        raise IdentificationError(
            f"the arrays differ in shape: {sorted(lengths)}; give vectors of one length"
        )
    rows = len(columns[outputs[0]])
    record = Record(
        tick_s,
        np.stack([columns[name] for name in outputs], axis=1),
        np.stack([columns[name] for name in inputs], axis=1) if inputs else np.empty((rows, 0)),
        outputs,
        inputs,
        tuple(units.get(name, "") for name in outputs),
        tuple(units.get(name, "") for name in inputs),
        tuple(step_of(columns[name]) for name in outputs),
    )
    return Source("arrays", record)


def _own_signals(config: FlightConfig, structure: str) -> bool:
    """Return whether a log's signals are its own, and not those of the configured model."""
    if structure:
        # The structure pitch has the model's signals, under their names.
        return structure != "pitch" and config.model.kind in ("pitch", "hold", "pendulum")
    from tenbaud.log.beside import with_file_beside

    log = with_file_beside(config.flight_log)
    signals = configured_signals(config)
    known = {one.name for one in (*signals.outputs, *signals.inputs)}
    named = {name.removeprefix("out:").removeprefix("in:") for name in log.columns}
    named -= {*known, *ALIASES}
    if not all(name.isdigit() for name in named):
        return True
    given = log.columns or log.join
    return config.model.kind == "pitch" and not given and _is_no_angle(log, signals)


class _Seen(LogError):
    """The names of the columns were seen; readers let it pass, and so read no rows."""

    def __init__(self, no_angle: bool) -> None:
        super().__init__()
        self.no_angle = no_angle


def _is_no_angle(log: FlightLogSection, signals: Signals) -> bool:
    """Return whether the column that would be read as the angle is a speed, a level or the like."""
    from tenbaud.log.reader import read_table
    from tenbaud.log.roles import Roles
    from tenbaud.log.units import COUNTS, factor, split_unit, stem_of, unit_named

    roles = Roles(log.file, log, signals)

    def wanted(names: Sequence[str], units: Sequence[str], known: Mapping[str, str]) -> list[int]:
        signal, place = roles.choose(names, units, known).outputs[0]
        given = roles.setting(log.units, f"out:{signal.name}", "angle")
        unit = str(given or unit_named(units[place]) or split_unit(names[place])[1])
        converts = unit_named(unit) == COUNTS or factor(unit, signal.unit) is not None
        raise _Seen(not converts or (not given and stem_of(names[place]) in (*SPEEDS, "level")))

    try:
        read_table(log.file, wanted)
    except _Seen as seen:
        return seen.no_angle
    return False
