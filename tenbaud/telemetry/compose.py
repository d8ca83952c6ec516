"""From the rows that the loop left to one message: done by the telemetry's own thread."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from channel.codec.codec import Vector
from channel.codec.coders.learning import learned_of
from channel.protocol.events import EVENT_CHANNEL
from channel.protocol.recording import RecordChannel
from receiver.endpoint import ReceiverEndpoint
from receiver.session import records as receiver
from tenbaud.telemetry.common import SCHEMA_VERSION, named_signal
from tenbaud.telemetry.tap import Tap
from transmitter.session.records import (
    ESTIMATE_CHANNEL,
    HYPOTHESES_CHANNEL,
    SAMPLE_CHANNEL,
    TICK_CHANNEL,
)

if TYPE_CHECKING:
    # Composing imports on bare Python: the page of the documentation does it in the browser.
    from tenbaud.build.flight import Agreement
    from tenbaud.build.transmitter_run import TransmitterRun
    from tenbaud.telemetry.live import LiveReceiver, LiveTransmitter

POINT_PERIOD_S = 0.05
POINTS_MAX = 16
SAMPLES_MAX = 64
EVENTS_MAX = 20
TICKS_WAITING_MAX = 512
LATENESS_TICKS = 1000
EVENT_TEXT_MAX = 300

Row = Any
"""a row as its channel describes it; the tick or the sample is its first value"""


def _reader(channel: RecordChannel) -> Callable[[Row], dict[str, Any]]:
    names = [field.name for field in channel.fields]
    return lambda row: dict(zip(names, row, strict=True))


READ, ESTIMATED, SAMPLED, LISTED = map(
    _reader, (TICK_CHANNEL, ESTIMATE_CHANNEL, SAMPLE_CHANNEL, HYPOTHESES_CHANNEL)
)
DECIDED, TAKEN = map(_reader, (receiver.TICK_CHANNEL, receiver.SAMPLE_CHANNEL))


class Composer(ABC):
    """Common fields of both ends' messages."""

    def __init__(self, agreement: Agreement, tap: Tap) -> None:
        self.agreement = agreement
        self.tap = tap
        self.skipped = 0
        """messages that were not sent, because their time had passed or the network refused"""
        self._number = 0
        model = agreement.codec.model
        self._measured = model.measured
        plant = agreement.signals
        self.outputs = plant.outputs
        self._plant = {
            "model": agreement.config.model.kind,
            "picture": plant.picture,
            "outputs": [named_signal(one) for one in plant.outputs],
            "inputs": [named_signal(one) for one in plant.inputs],
        }
        self._stride = max(1, round(POINT_PERIOD_S / (agreement.terms.tick_ns / 1e9)))

    @abstractmethod
    def compose(self) -> dict[str, Any]:
        """Return the message of this moment."""

    def _common(self, session: Any, impairments: str, rows: list[tuple[str, Row]]) -> dict[str, Any]:
        self._number += 1
        events = [row for topic, row in rows if topic == "event"][-EVENTS_MAX:]
        return {
            "version": SCHEMA_VERSION,
            "session": self.agreement.config.link.session,
            "plant": self._plant,
            "flight": session.session_number,
            "number": self._number,
            "phase": session.phase.value,
            "clock": self.agreement.clock,
            "takes_commands": self.agreement.live,
            "epoch": session.epoch,
            "impairments": impairments,
            "ending": session.end and session.end.ending.name.lower(),
            "events": [_event(row) for row in events],
            "dropped": self.tap.dropped + self.skipped,
        }


class TransmitterComposer(Composer):
    """Composes the transmitter's messages."""

    def __init__(self, run: TransmitterRun, tap: Tap, live: LiveTransmitter) -> None:
        super().__init__(run.agreement, tap)
        self._run = run
        self._live = live
        self._range: Vector = (0.0,) * len(self.outputs)
        self._read_of: dict[int, dict[str, Any]] = {}
        self._estimated_of: dict[int, dict[str, Any]] = {}
        self._lateness_ms: deque[float] = deque(maxlen=LATENESS_TICKS)
        self._applied: Vector | None = None
        self._listed: dict[str, Any] | None = None
        """of the narrow downlink: the newest row of the hypotheses"""

    def compose(self) -> dict[str, Any]:
        run, config, terms = self._run, self.agreement.config, self.agreement.terms
        node, session = run.node, run.node.session
        rows = self.tap.take()
        points, samples = self._read(rows)
        gap = node.gauge.now if node.gauge is not None else None
        return {
            "role": "transmitter",
            **self._common(session, self._live.impairments, rows),
            "time_s": node.tick * terms.tick_ns / 1e9,
            "counts": {
                **{name: session.counts[name] for name in COUNTED_UP},
                "commands_late": node.commands_late,
                "commands_refused": self._live.queue.refused if self._live.queue else 0,
            },
            "preset": config.preset,
            "tick_s": terms.tick_ns / 1e9,
            "symbol_period_s": terms.sample_ns / 1e9 / terms.symbols_per_word,
            "baud_configured": config.channel.rate_baud,
            "duration_s": self.agreement.flight_ticks * terms.tick_ns / 1e9,
            "points": _thinned(points, POINTS_MAX),
            "samples": samples[-SAMPLES_MAX:],
            "guard": node.guard.state.value,
            "applied": self._applied,
            "lateness": self._lateness(),
            "paused": self._live.paused,
            "pace": self._live.pace if self.agreement.clock == "virtual" else None,
            "gap_to_floor": gap and gap.rms_over_floor,
            "narrow": self._listed and narrow_part(run, self._listed),
            # Plain tuples: named ones are no JSON for the encoder.
            "learned": {
                name: tuple(one)
                for name, one in learned_of(self.agreement.codec, session.confirmed_state).items()
            },
        }

    def _read(self, rows: list[tuple[str, Row]]) -> tuple[list[Any], list[Any]]:
        points: list[Any] = []
        samples: list[Any] = []
        stride, real = self._stride, self.agreement.clock == "real"
        for topic, row in rows:
            if topic == "tick":
                if real:
                    self._lateness_ms.append(READ(row)["lateness_ms"])
                if row[0] % stride == 0:
                    tick = READ(row)
                    self._read_of[row[0]] = {
                        name: tick[name] for name in ("time_s", "measured", "true")
                    }
                    self._applied = tick["applied"]
                    self._join(row[0], points)
            elif topic == "estimate":
                if row[0] % stride == 0:
                    live = ESTIMATED(row)["live_state"]
                    self._estimated_of[row[0]] = {
                        "coded": self._measured(ESTIMATED(row)["coded_state"]),
                        "live": live and self._measured(live),
                        "range": self._range,
                    }
                    self._join(row[0], points)
            elif topic == "sample":
                sample = SAMPLED(row)
                self._range = sample["range"]
                words = {name: _word(sample[name]) for name in ("word_sent", "word", "about")}
                known = {name: sample[name] for name in ("sample", "digest", "peer_digest")}
                samples.append(known | words)
            elif topic == "hypotheses":
                self._listed = LISTED(row)
        for waiting in (self._read_of, self._estimated_of):
            while len(waiting) > TICKS_WAITING_MAX:
                del waiting[next(iter(waiting))]
        return points, samples

    def _join(self, tick: int, points: list[Any]) -> None:
        """Make a point of a tick as soon as both reading and estimate are known."""
        if tick in self._read_of and tick in self._estimated_of:
            points.append(self._read_of.pop(tick) | self._estimated_of.pop(tick))

    def _lateness(self) -> dict[str, float] | None:
        if not self._lateness_ms:
            return None
        ordered = sorted(self._lateness_ms)
        last = len(ordered) - 1
        return {
            "p50_ms": ordered[last // 2],
            "p99_ms": ordered[round(0.99 * last)],
            "max_ms": ordered[last],
        }


class ReceiverComposer(Composer):
    """Composes the receiver's messages."""

    def __init__(
        self, agreement: Agreement, endpoint: ReceiverEndpoint, tap: Tap, live: LiveReceiver
    ) -> None:
        super().__init__(agreement, tap)
        self._endpoint = endpoint
        self._live = live

    def compose(self) -> dict[str, Any]:
        session, terms = self._endpoint.session, self.agreement.terms
        rows: list[tuple[str, Row]] = self.tap.take()
        stride = self._stride
        points = [
            {
                "time_s": row[0] * terms.tick_ns / 1e9,
                "reference": DECIDED(row)["reference"],
                "live": self._measured(DECIDED(row)["live_state"]),
            }
            for topic, row in rows
            if topic == "tick" and row[0] % stride == 0
        ]
        samples = [
            {"sample": row[0], "word": _word(one["word"]), "digest": one["digest"]}
            for topic, row in rows
            if topic == "sample" and (one := TAKEN(row))
        ]
        steering = self._live.steering or (None,) * len(self.outputs)
        return {
            "role": "receiver",
            **self._common(session, self._live.impairments, rows),
            "time_s": session.state.sample * terms.sample_ns / 1e9,
            "counts": {
                **{name: session.counts[name] for name in COUNTED_DOWN},
                "commands_refused": self._live.queue.refused if self._live.queue else 0,
            },
            "baud_measured": session.meter.baud,
            "points": _thinned(points, POINTS_MAX),
            "samples": samples[-SAMPLES_MAX:],
            "set_points": [None if one is None else one.by_hand for one in steering],
            "steerable": [one is not None for one in steering],
        }


def narrow_part(run: TransmitterRun, listed: dict[str, Any]) -> dict[str, Any]:
    """Return what a row of the hypotheses says, with what else is known of the narrow downlink."""
    terms = run.agreement.terms
    return {
        **{name: listed[name] for name in ("sample", "confirmed_to", "size", "rest")},
        "hash_symbols": run.node.session.counts["hash_symbols"],
        "baud_measured": run.endpoint.down_baud.baud,
        "baud_configured": terms.downlink_baud,
        "is_mirrored": terms.is_mirrored,
    }


COUNTED_UP = ("erasures", "desyncs", "rejoins", "digest_checks", "words_missed", "stale_frames")
COUNTED_DOWN = ("erasures", "desyncs", "rejoins", "symbols_late", "stale_frames")


def _event(row: Row) -> dict[str, Any]:
    """Return the fields of an event that have a value, its text for people cut."""
    pairs = zip(EVENT_CHANNEL.fields, row, strict=True)
    fields = {field.name: value for field, value in pairs if value is not None}
    if "detail" in fields:
        fields["detail"] = fields["detail"][:EVENT_TEXT_MAX]
    return fields


def _word(word: object) -> list[int] | None:
    """Return a recorded word as the schema has it: null for an erased one."""
    return list(word) if isinstance(word, tuple | list) else None


def _thinned(points: list[Any], most: int) -> list[Any]:
    """Return at most that number of points, the last one included."""
    if len(points) <= most:
        return points
    every = -(-len(points) // most)
    return points[(len(points) - 1) % every :: every]
