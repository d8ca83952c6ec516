"""What was recorded of one flight, from one run folder or from one at each machine."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from channel.codec.codec import CodecState, Vector
from channel.codec.words import Word
from tenbaud.build.flight import Agreement, agree
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.run import Run
from tenbaud.recording.table import Table, Tables

NUMBER_MAX = 1e9
"""Of a state or a command, in rad, rad/s or V."""


@dataclass(slots=True)
class Epoch:
    """A stretch of samples that begins from a common state, and the words consumed in it."""

    number: int
    start: CodecState
    hold: Vector
    words: list[Word] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class FlightRecord:
    """The recordings of a flight with the configuration that was flown."""

    agreement: Agreement
    transmitter: Tables | None
    receiver: Tables | None
    summaries: dict[str, dict[str, Any]]
    """of each end that left one"""

    @property
    def consumer(self) -> Tables:
        """The recording that the consumed words are taken from: the receiver's, if it is there."""
        tables = self.receiver or self.transmitter
        if tables is None:
            raise RecordingError("There is no recording of either end.")
        return tables

    def ends(self) -> list[tuple[str, Tables]]:
        """Return the recordings that are there, by the name of the end."""
        both = (("transmitter", self.transmitter), ("receiver", self.receiver))
        return [(name, tables) for name, tables in both if tables is not None]


def load_record(path: Path, other: Path | None = None) -> FlightRecord:
    """Read the recordings of a flight; `other` is the folder of the other machine, if there is one.

    Raises RecordingError for what cannot be read, and where this machine or this version of the
    configuration is not the one that was flown.
    """
    tables: dict[str, Tables] = {}
    summaries: dict[str, dict[str, Any]] = {}
    homes: dict[str, Run] = {}
    for run in [Run(path), *([Run(other)] if other is not None else [])]:
        for end in run.ends:
            if end in tables:
                raise RecordingError(f"{path} and {other} both hold a {end}'s recording. Give one.")
            tables[end], summaries[end], homes[end] = run.tables(end), run.summary, run
    home = homes.get("receiver") or homes["transmitter"]
    agreement = _agreement(home, next(iter(tables.values())))
    for end, one in tables.items():
        _check_same(one, agreement, end)
    return FlightRecord(agreement, tables.get("transmitter"), tables.get("receiver"), summaries)


def _agreement(run: Run, tables: Tables) -> Agreement:
    clock = tables.metadata.get("clock", "")
    if clock == "real":
        return agree(run.config, "real")
    if clock == "virtual":
        return agree(run.config, "virtual")
    raise RecordingError(f"{tables.path} does not say on which clock it was flown.")


def _check_same(tables: Tables, agreement: Agreement, end: str) -> None:
    identity = agreement.identity
    if tables.metadata.get("shared_config") != identity.config:
        from channel.protocol.identity import differing_fields

        recorded = tables.metadata.get("shared_config", "")
        lines = "\n  ".join(differing_fields(identity.config, recorded)[:6])
        raise RecordingError(
            f"The {end}'s recording was flown with another configuration than the run's config.toml "
            f"says:\n  {lines}"
        )
    if tables.metadata.get("numerics_probe") != identity.numerics_probe.hex():
        raise RecordingError(
            f"The {end}'s recording was made by a codec that computes otherwise than the one here "
            f"(numerics probe {tables.metadata.get('numerics_probe')}, here "
            f"{identity.numerics_probe.hex()}). Replay it with the version and the plug-ins that flew "
            f"it: {tables.metadata.get('version')}."
        )


def epochs_of(tables: Tables, agreement: Agreement) -> list[Epoch]:
    """Return the epochs of one end's recording with the words consumed in each.

    Raises RecordingError where samples are missing within an epoch: what came after cannot be
    computed.
    """
    codec, terms = agreement.codec, agreement.terms
    samples = tables.topic("sample").rows
    epochs = [_epoch(row) for row in tables.topics["epoch"].rows] if "epoch" in tables.topics else []
    before = bool(epochs and samples) and samples[0]["sample"] < epochs[0].start.sample
    if tables.holes and (not epochs or before):
        raise RecordingError(
            f"{tables.path} lacks the state that its first epoch starts from: it is in a hole, "
            "so nothing can be computed from its symbols."
        )
    if not epochs:
        # From before epochs were recorded: one of them, from the common initial state.
        first = samples[0]["sample"] if samples else 0
        epochs = [Epoch(0, codec.initial()._replace(sample=first), terms.initial_command)]
    for epoch in epochs:
        check_epoch(epoch, agreement, str(tables.path))
    index = 0
    for row in samples:
        sample = row["sample"]
        while index + 1 < len(epochs) and epochs[index + 1].start.sample <= sample:
            index += 1
        epoch = epochs[index]
        expected = epoch.start.sample + len(epoch.words)
        if sample != expected:
            raise RecordingError(
                f"{tables.path} lacks sample {expected}: the next one recorded is {sample}. "
                "Rows were lost, so what follows cannot be computed from the symbols."
            )
        word = None if row["word"] is None else tuple(row["word"])
        if word is not None and not _is_word(word, agreement):
            raise RecordingError(
                f"{tables.path}: sample {sample} consumed {list(word)!r:.60}, which is no word of the "
                "flight's coder. The file was changed, or its configuration is another one."
            )
        epoch.words.append(word)
    return epochs


def check_epoch(epoch: Epoch, agreement: Agreement, where: str) -> None:
    """Raise RecordingError where an epoch starts from no state and command of this flight's codec."""
    initial = agreement.codec.initial()
    for name, values, like in (
        ("state", epoch.start.model, initial.model),
        ("coder state", epoch.start.coder, initial.coder),
        ("held command", epoch.hold, agreement.terms.initial_command),
    ):
        if len(values) != len(like) or not all(abs(one) <= NUMBER_MAX for one in values):
            raise RecordingError(
                f"{where}: epoch {epoch.number} starts with the {name} {list(values)!r:.60}, and the "
                f"flight's has {len(like)} numbers up to {NUMBER_MAX:g}. The file was changed, or its "
                "configuration is another one."
            )


def _is_word(word: tuple[int, ...], agreement: Agreement) -> bool:
    alphabet = agreement.codec.coder.alphabet
    return len(word) == alphabet.symbols_per_word and all(one in alphabet.symbols for one in word)


def _epoch(row: dict[str, Any]) -> Epoch:
    start = CodecState(row["sample"], tuple(row["state"]), tuple(row["coder"]))
    return Epoch(row["epoch"], start, tuple(row["hold_volts"]))


def by_key(table: Table) -> dict[int, dict[str, Any]]:
    """Return the rows of a topic by their first field."""
    key = table.names[0]
    return {row[key]: row for row in table.rows}
