"""A finished flight as the page shows it: at any moment the message that a live board would give.

Curves of a long window are thinned to the lowest and highest points of each stretch, so that spikes
stay; a short window has every tick.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from channel.codec.signals import Signal
from channel.errors import TenbaudError
from tenbaud.recording.envelope import extremes
from tenbaud.recording.run import Run
from tenbaud.recording.signals import Source
from tenbaud.recording.table import Series
from tenbaud.telemetry.common import OF_TRANSMITTER, is_shown, named_signal
from tenbaud.view.board import EVENTS_KEPT, SAMPLES_KEPT
from tenbaud.view.samples import RATE_SPAN_S, SAMPLE_FIELDS, RecordedSamples

RUNS_MAX = 4
"""Runs that have a colour of their own."""
POINTS = 1000
"""Of each curve; a window of fewer ticks is not thinned."""
LATENESS_TICKS = 1000
PHASES = {"started": "flying", "rejoin": "flying", "rejoin_asked": "rejoining", "ended": "ended"}
COLUMNS: dict[str, dict[str, Sequence[str]]] = {
    "transmitter": {
        "tick": ("tick", "measured", "true", "applied", "lateness_ms", "guard"),
        "estimate": ("tick", "coded_state"),
        "sample": SAMPLE_FIELDS,
        "gap": ("sample", "rms_over_floor"),
        "hypotheses": ("sample", "confirmed_to", "size", "rest"),
        "down_symbols": ("sample", "symbols"),
    },
    "receiver": {
        "tick": ("tick", "reference", "live_state"),
        "sample": SAMPLE_FIELDS,
    },
}
"""What the page shows of each end's topics."""


class RunsDiffer(TenbaudError):
    """Runs that cannot be shown in the same curves; the text says why."""


class RecordedFlight:
    """One run. Raises RecordingError for one that cannot be read or holds no ticks."""

    def __init__(self, run: Run) -> None:
        self.run = run
        for end in run.ends:
            run.tables(end).read(COLUMNS[end])
        up, down = (run.tables(end) if end in run.ends else None for end in COLUMNS)
        self._has = {end: end in run.ends for end in COLUMNS}
        self._tables = up.topics if up else {}
        self.base = run.base
        self._source = Source(self.base, up, down)
        self.samples = RecordedSamples(up, down)
        self.plant = run.plant
        self.sample_s = self.base.tick_s * self.base.ticks_per_sample
        self.duration_s = float(self.base.ticks[-1] + 1) * self.base.tick_s
        self.events = [_event(one) for one in run.events if one.get("time_s") is not None]
        self._events_s = np.array([one["time_s"] for one in self.events])
        places = range(len(self.plant.outputs))
        rows = [self.plant.row(place) for place in places]
        coded = [self._source.coded(row) for row in rows]
        if all(one is None for one in coded):
            coded = [self._source.live(row) for row in rows]
        self._values = self._columns([self._source.output(place) for place in places])
        self._estimates = self._columns(coded)
        self._ranges = self._columns([self._source.samples("range", place) for place in places])
        self._references = self._columns(
            [self._source.ticks("receiver", "tick", "reference", place) for place in places]
        )
        self._applied = self._columns(
            [self._source.applied(place) for place in range(len(self.plant.inputs))]
        )

    @property
    def name(self) -> str:
        """The run's folder, with its preset where the name does not say it."""
        name, preset = self.run.path.resolve().name, self.run.metadata.get("preset", "")
        return name if not preset or preset in name else f"{name} ({preset})"

    @property
    def missing(self) -> str:
        """Why digests cannot be compared; empty where they can."""
        if not self._has["transmitter"]:
            return "the transmitter's recording is not here"
        if self.samples.compared:
            return ""
        if "hypotheses" in self._tables and not self._has["receiver"]:
            return "no digest comes down, and the receiver's recording is not here"
        return "no digests were recorded"

    @property
    def notes(self) -> list[str]:
        """What to know before trusting the page: cuts, holes, other versions, what was not recorded."""
        absent = {
            "the transmitter's recording: no outputs, no errors": self._has["transmitter"],
            "the receiver's recording: no set-points, no rate": self._has["receiver"],
            "estimates": not np.isnan(self._estimates).all(),
        }
        missing = [what for what, there in absent.items() if not there]
        return [*self.run.notes, *(f"{self.name} is without {what}" for what in missing)]

    def _lists(self, event: dict[str, Any]) -> bool:
        return is_shown(event) or (not self._has["transmitter"] and event["kind"] in OF_TRANSMITTER)

    @property
    def events_s(self) -> set[float]:
        """The times of the events that the page lists."""
        return {max(0.0, one["time_s"]) for one in self.events if self._lists(one)}

    def _columns(self, found: Sequence[Series | None]) -> Series:
        nothing = np.full(len(self.base.ticks), np.nan)
        columns = [nothing if one is None else one for one in found]
        return np.column_stack(columns) if columns else nothing[:, :0]

    def moment(self, at_s: float, window: tuple[float, float] | None = None) -> dict[str, Any]:
        """Return what a board would show at a flight time; with the curves of a window of time."""
        at_s = min(max(at_s, 0.0), self.duration_s)
        tick = self._index(at_s)
        (point,), (decision,) = self._points([tick]), self._decisions([tick])
        sample = math.floor(at_s / self.sample_s + 1e-9) - 1
        after = int(np.searchsorted(self._events_s, at_s + 1e-9, side="right"))
        message = {
            "reset": True,
            "at_s": at_s,
            "point": point,
            "decision": decision,
            "heads": self._heads(at_s, tick, sample, self.events[:after]),
            "samples": self.samples.last(sample, SAMPLES_KEPT),
            "events": [one for one in self.events[:after] if self._lists(one)][-EVENTS_KEPT:],
        }
        if window is not None:
            first, last = (self._index(end) for end in window)
            message["points"] = self._points(self._thinned(first, last))
            message["decisions"] = self._decisions(self._steps(first, last))
        return message

    def _index(self, time_s: float) -> int:
        """Return the place of the tick of a flight time."""
        tick = math.floor(time_s / self.base.tick_s + 1e-9) - int(self.base.ticks[0])
        return min(max(tick, 0), len(self.base.ticks) - 1)

    def _times(self, places: Any) -> Series:
        times: Series = self.base.ticks[places] * self.base.tick_s
        return times

    def _points(self, places: Any) -> list[Any]:
        columns = (self._values, self._estimates, self._ranges)
        return _rows(self._times(places), *(one[places] for one in columns))

    def _decisions(self, places: Any) -> list[Any]:
        return _rows(self._times(places), self._references[places])

    def _thinned(self, first: int, last: int) -> NDArray[np.intp]:
        """Return the places of the ticks that a window shows."""
        if last - first < POINTS:
            return np.arange(first, last + 1)
        span = slice(first, last + 1)
        values, estimates = self._values[span], self._estimates[span]
        return self._extremes(first, values, estimates, values - estimates, self._ranges[span])

    def _extremes(self, first: int, *curves: Series) -> NDArray[np.intp]:
        """Return the places of the ends and of the lowest and highest points of curves from `first`."""
        last = first + len(curves[0]) - 1
        times = self._times(slice(first, last + 1))
        chosen = [extremes(times, curve, POINTS) for curve in np.column_stack(curves).T]
        return first + np.unique(np.concatenate((*chosen, [0, last - first])))

    def _steps(self, first: int, last: int) -> NDArray[np.intp]:
        """Return the places at which a set-point of a window is another one than before."""
        span = self._references[first : last + 1]
        is_new = (span[1:] != span[:-1]) & ~(np.isnan(span[1:]) & np.isnan(span[:-1]))
        changed = 1 + np.flatnonzero(is_new.any(axis=1))
        if len(changed) > POINTS:
            return self._extremes(first, span)
        return first + np.unique(np.concatenate(([0], changed, [last - first])))

    def _heads(
        self, at_s: float, tick: int, sample: int, events: list[dict[str, Any]]
    ) -> dict[str, dict[str, Any]]:
        own = "transmitter" if self._has["transmitter"] else "receiver"
        found = [one for one in events if one["role"] == own]
        turns = [one["kind"] for one in found if one["kind"] in PHASES]
        counts = {
            "erasures": self.samples.erased_by(sample),
            "desyncs": sum(one["kind"] == "desync" for one in found),
            "rejoins": sum(one["kind"] == "rejoin" for one in found),
            "digest_checks": self.samples.compared_by(sample),
        }
        common = {
            "plant": self._described,
            "time_s": at_s,
            "phase": PHASES[turns[-1]] if turns else "waiting",
            "counts": counts,
            "epoch": next((one["epoch"] for one in reversed(found) if "epoch" in one), 0),
        }
        heads = {}
        if self._has["transmitter"]:
            period_s = self.sample_s / self.samples.symbols_per_word
            gap = float(self._row("gap", sample).get("rms_over_floor", math.nan))
            heads["transmitter"] = common | {
                "clock": self.run.metadata.get("clock", ""),
                "symbol_period_s": period_s,
                "baud_configured": self.run.summary.get("baud_configured") or 1.0 / period_s,
                "guard": str(self._row("tick", int(self.base.ticks[tick])).get("guard", "")),
                "applied": self._applied[tick].tolist(),
                "lateness": self._lateness(tick),
                "gap_to_floor": None if math.isnan(gap) else gap,
                "narrow": self._narrow_at(sample),
            }
        if self._has["receiver"]:
            heads["receiver"] = common | {"baud_measured": self.samples.rate_at(sample)}
        return heads

    @cached_property
    def _described(self) -> dict[str, Any]:
        return {
            "picture": self.plant.picture,
            "outputs": _named(self.plant.outputs, self._values),
            "inputs": _named(self.plant.inputs, self._applied),
        }

    def _row(self, topic: str, key: int) -> dict[str, Any]:
        """Return the transmitter's last row of a topic up to a tick or sample; {} without one."""
        table = self._tables.get(topic)
        row = -1 if table is None else int(np.searchsorted(table.keys, key, side="right")) - 1
        if table is None or row < 0:
            return {}
        names = COLUMNS["transmitter"][topic]
        return {name: table[name][row] for name in names if name in table.names}

    def _lateness(self, tick: int) -> dict[str, float] | None:
        late = self._source.loop("lateness_ms") if self.run.metadata.get("clock") == "real" else None
        last = np.zeros(0) if late is None else late[max(0, tick + 1 - LATENESS_TICKS) : tick + 1]
        last = last[~np.isnan(last)]
        return {"p99_ms": float(np.percentile(last, 99.0))} if len(last) else None

    @cached_property
    def _shared(self) -> dict[str, Any]:
        shared: dict[str, Any] = json.loads(self.run.metadata["shared_config"])
        return shared

    def _narrow_at(self, sample: int) -> dict[str, Any] | None:
        """Return what the transmitter knew of the receiver's state once it had heard of a sample."""
        row = self._row("hypotheses", sample)
        if not row:
            return None
        return {
            "sample": sample,
            "confirmed_to": int(row["confirmed_to"]),
            "size": int(row["size"]),
            "rest": float(row["rest"]),
            "hash_symbols": None,
            "baud_measured": self._down_rate_at(sample),
            "baud_configured": self._shared["channel"]["downlink_baud"],
            "is_mirrored": self._shared["downlink"]["scheme"] == "mirrored",
        }

    def _down_rate_at(self, sample: int) -> float | None:
        """Return the down symbols per second that came in the last 5 s of flight time."""
        table, rows = self._tables.get("down_symbols"), round(RATE_SPAN_S / self.sample_s)
        if table is None:
            return None
        last = int(np.searchsorted(table.keys, sample, side="right"))
        came = ~np.isnan(table["symbols"][max(0, last - rows) : last])
        return float(came.sum()) / (len(came) * self.sample_s) if len(came) else None


def _named(signals: Sequence[Signal], values: Series) -> list[dict[str, Any]]:
    """Return signals as messages name them; one without limits gets its largest value for its bar."""
    named = [named_signal(one) for one in signals]
    for one, column in zip(named, values.T, strict=True):
        if (one["low"] is None or one["high"] is None) and not np.isnan(column).all():
            one["high"] = float(np.nanmax(np.abs(column)))
            one["low"] = -one["high"]
    return named


def _rows(times: Series, *columns: Series) -> list[Any]:
    return [list(row) for row in zip(times.tolist(), *(one.tolist() for one in columns), strict=True)]


def _event(one: dict[str, Any]) -> dict[str, Any]:
    fields = {name: value for name, value in one.items() if value is not None and name != "end"}
    return {"role": one["end"], **fields}


def recorded_flights(runs: Sequence[Run]) -> list[RecordedFlight]:
    """Return the flights to lay over each other. RunsDiffer for too many, or for unlike outputs."""
    if len(runs) > RUNS_MAX:
        raise RunsDiffer(f"{len(runs)} runs are given, and the page shows at most {RUNS_MAX} at once")
    flights = [RecordedFlight(run) for run in runs]
    first, *others = flights
    for other in others:
        one, two = (_outputs(flight.plant.outputs) for flight in (first, other))
        if one != two:
            raise RunsDiffer(
                f"the outputs of these runs differ: {first.run.path} has {one}, {other.run.path} has "
                f"{two}. Runs in the same curves need the same outputs; open them one by one."
            )
    return flights


def _outputs(outputs: Sequence[Signal]) -> str:
    return "; ".join(one.label for one in outputs)
