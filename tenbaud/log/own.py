"""The tool's own recordings and JSON exports as tables: their columns need no options."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import orjson

from channel.codec.signals import Signal
from tenbaud.log.frames import read_messages
from tenbaud.log.signal_sets import flat_table, table_of
from tenbaud.log.table import Array, LogError, Table, Wanted
from tenbaud.log.variables import Clock, Variable, seconds
from tenbaud.recording.encoding import recorded_signals
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.folder import find_recordings
from tenbaud.recording.reader import Recording


def read_run(path: Path, wanted: Wanted | None = None) -> Table:
    """Return a run's measured and applied signals, tick by tick.

    `path` is the folder of a run or an MCAP file; that of another program is read as messages.
    """
    try:
        recording = Recording(find_recordings(path)[0])
        topics = recording.topics if recording.metadata else {}
    except RecordingError as error:
        if path.is_dir():
            raise LogError(str(error)) from error
        return read_messages(path, wanted)
    if not topics:
        return read_messages(path, wanted)
    if "flight" in topics:
        flight = topics["flight"]
        return flat_table(
            path, "flight exported to MCAP", flight.units, lambda name: flight.read(name)[0], wanted
        )
    if "tick" not in topics or "measured" not in topics["tick"].names:
        raise LogError(
            f"{recording.path} holds no measured angles; give the folder of the run, or its "
            "transmitter.mcap"
        )
    return _of_ticks(path, recording, wanted)


def _of_ticks(path: Path, recording: Recording, wanted: Wanted | None) -> Table:
    try:
        period_s = float(recording.metadata["tick_s"])
    except (KeyError, ValueError):
        raise LogError(f"{recording.path} does not say how long its ticks are") from None
    plant = recorded_signals(recording.metadata)
    ticks, measured, applied = recording.topics["tick"].read("tick", "measured", "applied")
    signals: list[tuple[str, Signal]] = [("out", one) for one in plant.outputs]
    signals += [("in", one) for one in plant.inputs]
    columns: list[Array] = [ticks, *measured.T, *applied.T]
    if len(columns) != 1 + len(signals):
        raise LogError(
            f"{recording.path}: a tick has {len(columns) - 1} values, and the plant has {len(signals)} "
            "outputs and inputs; give the recording of one flight"
        )
    # A tick without a reading is a gap, which the index shows.
    whole = ~np.logical_or.reduce([np.isnan(one) for one in columns])
    names = ["tick", *(one.column for _, one in signals)]
    units = ["", *(one.unit for _, one in signals)]
    roles = {"index": "tick"} | {f"{kind}:{one.name}": one.column for kind, one in signals}
    return Table(
        str(path),
        f"recorded flight, ticks of {period_s:g} s, outputs as measured and inputs as applied",
        tuple(names),
        tuple(units),
        tuple([column[whole] for column in columns]),
        place=lambda row: f"tick {ticks[whole][row]:.0f}",
        period_s=period_s,
        roles=roles,
    ).only(wanted)


def read_json(path: Path, wanted: Wanted | None = None) -> Table:
    """Return the signals of a flight that was exported to JSON; LogError for any other JSON."""
    try:
        content: Any = orjson.loads(path.read_bytes())
        clock = Clock("time_s", seconds(np.array(content["time_s"], dtype=np.float64)), "s")
        found = [
            Variable(name, np.array(one["values"], dtype=np.float64), one["unit"], clock)
            for name, one in content["signals"].items()
        ]
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise LogError(
            f"{path} is JSON, but no flight that `tenbaud convert` wrote. Save the signals as CSV."
        ) from error
    return table_of(path, "flight exported to JSON", found, wanted)
