"""The transmitted data of a recorded flight: words, commands, and the shared configuration."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from channel.codec.codec import ERASED, CodecState, Vector
from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.filters import Array
from plant_sim.identification.from_symbols import identify_symbols
from plant_sim.identification.likelihood import follow
from plant_sim.identification.record import Record
from plant_sim.identification.structures import LinearStructure
from plant_sim.identification.symbols import Symbols
from tenbaud.build.flight import Agreement
from tenbaud.build.signals import encoder_steps
from tenbaud.config.schema import FlightConfig
from tenbaud.identification.linearised import Linearised, linearised, start_values
from tenbaud.identification.run import Identified
from tenbaud.identification.statements import Statement, statements_of
from tenbaud.identification.structure import choose, record_of
from tenbaud.replay.pack import Epoch
from tenbaud.replay.record import FlightRecord, epochs_of, load_record

SKIPPED_MAX = 1_000_000
"""samples between two epochs; each of them is computed"""
UNSURE = 4.0
"""first ranges by which the plant may be off the start that both ends assume"""
SHARPEST = 1e-5
"""of that: the least reading error"""


@dataclass(frozen=True, slots=True, eq=False)
class Bits:
    """The words of a flight as statements, and the commands of its ticks."""

    agreement: Agreement
    statements: list[list[Statement]]
    """of each sample; none of an erased one, and none of one that was skipped between two epochs"""
    states: list[Vector]
    """the codec's model state before each sample; of a skipped one that of the next epoch's start"""
    commands: Array
    arrived: int
    """symbols of all words that were consumed"""
    ends: tuple[str, ...]
    """whose recordings the run holds"""

    @property
    def config(self) -> FlightConfig:
        return self.agreement.config

    def record(self) -> Record:
        """Return the codec's own estimate of the outputs and the commands, tick by tick."""
        signals = self.agreement.signals
        model, ticks = self.agreement.codec.model, self.agreement.terms.ticks_per_sample
        outputs = np.array([model.measured(state) for state in self.states])
        at, samples = np.arange(len(self.commands)) / ticks, np.arange(len(outputs))
        between = np.stack([np.interp(at, samples, one) for one in outputs.T], axis=1)
        tick_s, steps = self.agreement.terms.tick_ns / 1e9, encoder_steps(self.config, signals)
        return record_of(tick_s, between, self.commands, signals, steps)


def read_bits(path: Path) -> Bits:
    """Read the words and commands of a run; RecordingError, IdentificationError."""
    record = load_record(path)
    codec = record.agreement.codec
    recorded = {row.sample: row for row in record.rows[record.consumer].topics["sample"].rows}
    epochs = [epoch for epoch in epochs_of(record) if epoch.words]
    if not epochs:
        raise IdentificationError(f"{path}: no sample was flown: there is nothing to identify from")
    statements: list[list[Statement]] = []
    states: list[Vector] = []
    for epoch in epochs:
        state = epoch.start
        skipped = state.sample - epochs[0].start.sample - len(states)
        if skipped > SKIPPED_MAX:
            raise IdentificationError(
                f"{path}: epoch {epoch.number} begins {skipped} samples after the last one ended, and "
                f"at most {SKIPPED_MAX} are identified over: identify from the run's measurements"
            )
        states += [state.model] * skipped
        statements += [[] for _ in range(skipped)]
        for word in epoch.words:
            states.append(state.model)
            statements.append([] if word is ERASED else list(statements_of(codec, state, word)))
            row = recorded[state.sample]
            state = CodecState(state.sample + 1, row.state, row.coder)
    commands = _commands(record, epochs, len(states))
    arrived = sum(len(word) for epoch in epochs for word in epoch.words if word is not ERASED)
    return Bits(record.agreement, statements, states, commands, arrived, tuple(record.tables))


def _commands(record: FlightRecord, epochs: list[Epoch], samples: int) -> Array:
    """Return the command of every tick; one that is missing is the one before."""
    field = "command" if record.consumer == "receiver" else "commanded"
    terms, rows = record.agreement.terms, record.rows[record.consumer].topics
    given = {row.tick: one for row in rows["tick"].rows if (one := getattr(row, field))}
    firsts = [epoch.start.sample * terms.ticks_per_sample for epoch in epochs]
    for first, epoch in zip(firsts, epochs, strict=True):
        # Until the first command that was decided in the epoch; the one before may reach into it.
        given |= dict.fromkeys(range(first, first + terms.lead_ticks), epoch.hold)
    held, commands = epochs[0].hold, []
    for tick in range(firsts[0], firsts[0] + samples * terms.ticks_per_sample):
        held = given.get(tick, held)
        commands.append(held)
    return np.array(commands, dtype=np.float64)


def symbols_of(bits: Bits, order: int) -> tuple[Symbols, Linearised]:
    """Return the statements in outputs and rates, and the codec's model in them."""
    codec, terms = bits.agreement.codec, bits.agreement.terms
    tick_s, period_s = terms.tick_ns / 1e9, terms.sample_ns / 1e9
    known = linearised(codec.model, order, tick_s, terms.initial_command)
    size, outputs = len(known.state), len(bits.agreement.signals.outputs)
    ranges = np.array(codec.coder.ranges(codec.initial().coder))[:outputs]
    start_deviations = np.concatenate(
        [UNSURE * one / period_s ** np.arange(order) for one in ranges.tolist()]
    )
    flat = [one for sample in bits.statements for one in sample]
    if not flat:
        raise IdentificationError("no symbol of this flight arrived: there is nothing to identify from")
    combinations = np.array([one[0] for one in flat], dtype=np.float64).reshape(len(flat), -1)
    edges = np.array([one[1:] for one in flat], dtype=np.float64).reshape(len(flat), 2)
    if codec.uses_rates and combinations.shape[1] != size:
        raise IdentificationError(
            f"the coder asks about {combinations.shape[1]} states, and the structure has {size}: ask "
            "for another one, or identify from the measurements"
        )
    if codec.uses_rates:
        # c' x of the corrected states x = x0 + W (z - z0)
        turned = np.linalg.inv(known.by_corrected)
        edges += (combinations @ (turned @ known.state - known.corrected))[:, None]
        combinations = combinations @ turned
    else:
        whole = np.zeros((len(flat), size))
        whole[:, ::order] = combinations
        combinations = whole
    rates = bits.config.transmitter.rate_observer_bandwidth_rad_s
    reading = np.array(encoder_steps(bits.config, bits.agreement.signals)) / math.sqrt(12.0)
    errors = np.concatenate(
        [one * (rates * math.sqrt(rates * tick_s)) ** np.arange(order) for one in reading.tolist()]
    )
    errors = np.hypot(errors, SHARPEST * start_deviations)
    states = np.array([state[:size] for state in bits.states])
    symbols = Symbols(
        period_s,
        np.concatenate(([0], np.cumsum([len(one) for one in bits.statements]))),
        np.ascontiguousarray(combinations),
        np.ascontiguousarray(edges[:, 0]),
        np.ascontiguousarray(edges[:, 1]),
        combinations**2 @ errors**2,
        bits.commands,
        known.state + known.by_corrected @ (states[0] - known.corrected),
        start_deviations,
        known.state + (states - known.corrected) @ known.by_corrected.T,
        bits.arrived,
    )
    return symbols, known


def run_bits(name: str, bits: Bits, wanted: str, equilibrium: str, lag_s: float | None) -> Identified:
    """Identify the plant of a flight from its transmitted data."""
    from tenbaud.studies.compiled import compiled, require

    require("numba")
    record = bits.record()
    pitches = bits.config.model.kind == "pitch"
    where = "estimate" if equilibrium == "auto" and pitches else equilibrium
    chosen = choose(record, wanted, where, pitches=pitches)
    if isinstance(chosen.structure, LinearStructure) and chosen.structure.input_order:
        raise IdentificationError(f"--structure {chosen.structure.kind}: from the bits, give siso:N,0")
    if lag_s is None:
        lag_s = float(getattr(bits.config.model, "motor_lag_s", 0.0))
    symbols, known = symbols_of(bits, chosen.structure.order)
    start = start_values(chosen.structure, known)
    found = identify_symbols(symbols, chosen.structure, lag_s, start, compiled(follow))
    origin = f"from {symbols.arrived} symbols of {symbols.period_s * len(symbols):.6g} s"
    return Identified(name, record, found, chosen, (origin, *found.notes), found.warnings, "")
