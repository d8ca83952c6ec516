"""The recordings of one flight, from one run folder or from one at each machine."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any

from channel.codec.codec import CodecState
from channel.codec.downlink.machine import TwoWay
from tenbaud.build.flight import Agreement, agree
from tenbaud.config.deprecated import with_current_names
from tenbaud.config.outside_code import require_allowed, require_regular_files
from tenbaud.config.schema import FlightConfig
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.reader import Recording
from tenbaud.recording.recorded import ENDS
from tenbaud.recording.run import Run
from tenbaud.replay.pack import Epoch
from tenbaud.replay.rows import EndRows, read_rows

NUMBER_MAX = 1e9
"""Of a state or a command, in rad, rad/s or V."""


@dataclass(frozen=True, slots=True)
class FlightRecord:
    """The recordings of a flight with the configuration that was flown."""

    agreement: Agreement
    tables: dict[str, Recording]
    """of each end that is here, the transmitter's first"""
    summaries: dict[str, dict[str, Any]]
    """of each end that left one"""
    rows: dict[str, EndRows]
    """of each end that is here"""

    @property
    def consumer(self) -> str:
        """The end whose recording the consumed words are taken from: the receiver, if it is there."""
        return "receiver" if "receiver" in self.tables else "transmitter"


def load_record(path: Path, other: Path | None = None, *, allow_code: bool = False) -> FlightRecord:
    """Read the recordings of a flight; `other` is the folder of the other machine, if there is one.

    CodeNotAllowed if the configuration names classes from outside, unless `allow_code` permits them.
    Raises RecordingError for what cannot be read, and where this machine or this version of the
    configuration is not the one that was flown.
    """
    homes: dict[str, Run] = {}
    for run in [Run(path), *([Run(other)] if other is not None else [])]:
        for end in run.ends:
            if end in homes:
                raise RecordingError(f"{path} and {other} both hold a {end}'s recording. Give one.")
            homes[end] = run
    tables = {end: homes[end].tables(end) for end in ENDS if end in homes}
    home = homes.get("receiver") or homes["transmitter"]
    agreement = _agreement(home, next(iter(tables.values())), allow_code)
    for end, one in tables.items():
        _check_same(one, agreement, end)
    rows = {end: read_rows(end, one) for end, one in tables.items()}
    return FlightRecord(agreement, tables, {end: run.summary for end, run in homes.items()}, rows)


def _agreement(run: Run, tables: Recording, allow_code: bool) -> Agreement:
    clock = tables.metadata.get("clock", "")
    if clock not in ("real", "virtual"):
        raise RecordingError(f"{tables.path} does not say on which clock it was flown.")
    return agree_again(_with_files_of(run.folder.path, run.config), clock, allow_code)


def agree_again(config: FlightConfig, clock: str, allow_code: bool) -> Agreement:
    """Return the agreement of a flight that was recorded, on the real clock or the virtual one.

    CodeNotAllowed if the configuration names classes from outside, unless `allow_code` permits them.
    """
    config = config.allowing_code() if allow_code else config
    require_allowed(config)
    require_regular_files(config)
    return agree(config, "real" if clock == "real" else "virtual", recorded=True)


def _with_files_of(folder: Path, config: FlightConfig) -> FlightConfig:
    """Return a configuration whose set-points are read from the run's folder, if their file is there.

    A path in it is of the place and the working folder of the flight; the run may have been moved.
    """
    reference = config.receiver.reference
    sections: dict[str, Any] = {}
    for name, one in {"": reference, **reference.by_name}.items():
        # Both kinds of separators: the flight may have been on another system.
        beside = folder / PureWindowsPath(one.file).name
        if one.kind == "csv" and one.file and beside.is_file():
            changed = {"file": str(beside)}
            sections |= {name: one.model_copy(update=changed)} if name else changed
    found = reference.model_copy(update=sections)
    receiver = config.receiver.model_copy(update={"reference": found})
    return config.model_copy(update={"receiver": receiver})


def _check_same(tables: Recording, agreement: Agreement, end: str) -> None:
    identity = agreement.identity
    recorded = _with_current_names(tables.metadata.get("shared_config", ""))
    if recorded != identity.config:
        from channel.protocol.identity import differing_fields

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


def _with_current_names(shared: str) -> str:
    """Return a recorded shared configuration as this version writes the same settings."""
    try:
        values = with_current_names(json.loads(shared), "", warn=False)
        downlink = values.pop("downlink", None)
        return FlightConfig.model_validate(values).shared_json(values["timing"]["lead_ticks"], downlink)
    except (ValueError, KeyError, TypeError):
        return shared


def epochs_of(record: FlightRecord) -> list[Epoch]:
    """Return the epochs of a flight with the words consumed in each.

    They are the receiver's, if its recording is here. Raises RecordingError where samples are missing
    within an epoch: what came after cannot be computed.
    """
    agreement, codec = record.agreement, record.agreement.codec
    tables, rows = record.tables[record.consumer], record.rows[record.consumer].topics
    samples = rows["sample"].rows
    epochs = [
        Epoch(row.epoch, CodecState(row.sample, row.state, row.coder), row.hold)
        for row in rows["epoch"]
    ]
    before = bool(epochs and samples) and samples[0].sample < epochs[0].start.sample
    if before or (tables.holes and not epochs):
        raise RecordingError(
            f"{tables.path} lacks the epoch of its first samples, and with it the state that "
            "they start from: nothing can be computed from its symbols."
        )
    if not epochs:
        # From before epochs were recorded: one of them, from the common initial state.
        first = samples[0].sample if samples else 0
        initial = codec.initial()._replace(sample=first)
        epochs = [Epoch(0, initial, agreement.terms.initial_command)]
    for epoch in epochs:
        check_epoch(epoch, agreement, str(tables.path))
    _fill(epochs, record)
    if agreement.two_way is not None:
        _fill_downlink(epochs, record, agreement.two_way)
    return epochs


def _fill(epochs: list[Epoch], record: FlightRecord) -> None:
    """Add the words that were consumed to their epochs."""
    agreement, tables = record.agreement, record.tables[record.consumer]
    index = 0
    for row in record.rows[record.consumer].topics["sample"].rows:
        while index + 1 < len(epochs) and epochs[index + 1].start.sample <= row.sample:
            index += 1
        epoch = epochs[index]
        expected = epoch.start.sample + len(epoch.words)
        if row.sample > expected:
            raise RecordingError(
                f"{tables.path} lacks sample {expected}: the next one recorded is {row.sample}. "
                "Rows were lost, so later states cannot be computed from the symbols."
            )
        if row.sample < expected:
            raise RecordingError(
                f"{tables.path} holds sample {row.sample} where sample {expected} is due: a row is "
                "doubled or out of order, so what follows cannot be computed from the symbols."
            )
        if row.word is not None and not _is_word(row.word, agreement):
            raise RecordingError(
                f"{tables.path}: sample {row.sample} consumed {list(row.word)!r:.60}, which is no word "
                "of the flight's coder. The file was changed, or its configuration is another one."
            )
        epoch.words.append(row.word)


def _fill_downlink(epochs: list[Epoch], record: FlightRecord, machine: TwoWay) -> None:
    """Add to their epochs the state that they start from and the symbols that were sent down."""
    topics, where = record.rows[record.consumer].topics, record.tables[record.consumer].path
    starts = {(row.epoch, row.sample): row.state for row in topics["two_way"]}
    sent = topics["down_symbols" if record.consumer == "receiver" else "confirmed"].rows
    symbols = {row.sample: row.symbols for row in sent}
    for epoch in epochs:
        state = starts.get((epoch.number, epoch.start.sample))
        if state is None:
            raise RecordingError(
                f"{where} lacks the row of the topic two_way of epoch {epoch.number}, sample "
                f"{epoch.start.sample}, and with it the state that it starts from: nothing can be "
                "computed from its symbols."
            )
        try:
            epoch.two_way = machine.unpack(bytes.fromhex(state))
        except ValueError as error:
            raise RecordingError(f"{where}: two_way, epoch {epoch.number}: {error}.") from error
        for sample in range(epoch.start.sample, epoch.start.sample + len(epoch.words)):
            found = symbols.get(sample)
            if found is None:
                raise RecordingError(f"{where} lacks the down symbols of sample {sample}.")
            if len(found) != machine.layout.symbols_per_sample or not {0, 1}.issuperset(found):
                raise RecordingError(
                    f"{where}: the down symbols of sample {sample} are {list(found)!r:.60}, and not "
                    f"{machine.layout.symbols_per_sample} bits. The file was changed, or its "
                    "configuration is another one."
                )
            epoch.symbols.append(tuple(found))


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
