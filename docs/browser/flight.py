"""Both ends of one flight within a browser: they fly in steps, and give news to the page.

It needs bare Python. What the ends share and what is flown comes as objects that
`docs/tools/browser.py` builds from a configuration while the documentation is built.
"""

from __future__ import annotations

import io
import json
import pickle
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

from channel.codec.codec import Codec, CodecState
from channel.line.impairments import ImpairedLine, impair, parse_impairments
from channel.line.line import Downlink, Uplink
from channel.protocol.endings import End, Ending
from channel.protocol.events import ByHand, Event, EventKind, write_event
from channel.protocol.identity import Identity, numerics_probe
from channel.protocol.recording import NullRecorder, RecordChannel
from channel.protocol.sabotage import SabotagedCodec, parse_sabotage
from channel.protocol.terms import Terms
from channel.protocol.wire import DATAGRAM
from receiver.controllers.base import Controller
from receiver.controllers.references import Reference, SteeredReference
from receiver.endpoint import ReceiverEndpoint
from receiver.session.session import ReceiverSession
from tenbaud.replay.pack import Epoch, add_step, pack
from tenbaud.sentences.endings import refusal_text
from tenbaud.sentences.events import event_text
from tenbaud.telemetry.common import is_shown
from tenbaud.telemetry.compose import ReceiverComposer, TransmitterComposer
from tenbaud.telemetry.tap import Tap
from transmitter.endpoint import TransmitterEndpoint, TransmitterNode
from transmitter.guard import Guard
from transmitter.loops.virtual import VirtualFlight
from transmitter.metrics.scores import Scores
from transmitter.rigs.base import Rig
from transmitter.session.session import TransmitterSession
from transmitter.session.state_observer import StateObserver

SESSION_NUMBER = 1
"""Fixed: both ends are in this page, and no other end can answer."""
SAMPLE_FIELDS = ("sample", "word_sent", "word", "digest", "peer_digest", "about")
TICKS_AT_ONCE = 20
"""Between two looks at the clock of the wall."""


@dataclass(frozen=True, slots=True)
class KnownConfig:
    """The settings that the page shows, and all of them as a symbols file has them."""

    values: dict[str, Any]

    def __getattr__(self, name: str) -> Any:
        found = self.values[name]
        return SimpleNamespace(**found) if isinstance(found, dict) else found

    def model_dump(self, mode: str) -> dict[str, Any]:
        """Return all settings."""
        return self.values


@dataclass(frozen=True, slots=True)
class FlightParts:
    """Everything that is built from the configuration."""

    values: dict[str, Any]
    """the configuration"""
    codec: Codec
    terms: Terms
    identity: Identity
    """of the machine that built the parts"""
    rig: Rig
    guard: Guard
    rearm_ticks: int | None
    observer: StateObserver | None
    controller: Controller
    steering: tuple[SteeredReference | None, ...]
    configured: Reference
    """the first set-point as configured, for what was changed by hand"""
    lines: tuple[ImpairedLine, ImpairedLine]
    flight_ticks: int


class KeptSymbols:
    """A `Recorder` of the receiver's rows that a symbols file is made of."""

    def __init__(self, configured: Reference) -> None:
        self.epochs: list[Epoch] = []
        self.steps: list[tuple[int, float]] = []
        self.last_digest = ""
        self._configured = configured

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[Any]) -> None:
        """Keep what the file needs of one row."""
        names = [one.name for one in channel.fields]
        if channel.topic == "epoch":
            sample, number, state, coder, hold = row
            self.epochs.append(Epoch(number, CodecState(sample, state, coder), hold))
        elif channel.topic == "sample":
            self.epochs[-1].words.append(row[names.index("word")])
            self.last_digest = row[names.index("digest")]
        elif channel.topic == "tick":
            add_step(self.steps, row[0], row[names.index("reference")][0], self._configured)


@dataclass(slots=True)
class ByPage:
    """What the page has asked for, in the form that the composers read."""

    steering: tuple[SteeredReference | None, ...]
    queue: None = None
    impairments: str = ""
    paused: bool = False
    pace: float | None = 1.0


@dataclass(slots=True)
class Ends:
    """Both ends with their rows."""

    run: TransmitterEndpoint
    receiver: ReceiverEndpoint
    taps: tuple[Tap, Tap]
    symbols: KeptSymbols


def build_ends(parts: FlightParts) -> Ends:
    """Return both ends; each computes with a codec of its own, which may be corrupted."""
    symbols = KeptSymbols(parts.configured)
    up, down = taps = (Tap(NullRecorder()), Tap(symbols))
    # What this machine computes is compared with what the machine of the build computed.
    identity = replace(parts.identity, numerics_probe=numerics_probe(parts.codec))
    sender = TransmitterSession(
        SabotagedCodec(parts.codec), parts.terms, identity, 1, up, state_observer=parts.observer
    )
    node = TransmitterNode(
        sender,
        parts.rig,
        parts.guard,
        Scores(parts.codec.model, 0, parts.terms.ticks_per_sample, parts.controller.references),
        up,
        parts.rearm_ticks,
    )
    uplink = Uplink(parts.terms, parts.codec.coder.alphabet, parts.lines[0], DATAGRAM)
    taker = ReceiverSession(
        SabotagedCodec(parts.codec),
        parts.terms,
        parts.controller,
        parts.identity,
        SESSION_NUMBER,
        down,
    )
    downlink = Downlink(DATAGRAM, None, parts.terms, down)
    return Ends(TransmitterEndpoint(node, uplink), ReceiverEndpoint(taker, downlink), taps, symbols)


class BrowserFlight:
    """One flight, from the bytes of its `FlightParts`."""

    def __init__(self, data: bytes) -> None:
        parts: FlightParts = pickle.load(io.BytesIO(data))
        ends = build_ends(parts)
        self._terms, self._lines = parts.terms, parts.lines
        self._run, self._receiver = ends.run, ends.receiver
        self._symbols, self._taps, self._node = ends.symbols, ends.taps, ends.run.node
        self._asked = ByPage(parts.steering)
        self._agreement = cast(
            Any,
            SimpleNamespace(
                config=KnownConfig(parts.values),
                codec=parts.codec,
                terms=parts.terms,
                signals=parts.terms.signals,
                clock="virtual",
                live=True,
                flight_ticks=parts.flight_ticks,
                two_way=None,
            ),
        )
        run: Any = SimpleNamespace(agreement=self._agreement, node=self._node, endpoint=ends.run)
        live: Any = self._asked
        self._composers = (
            TransmitterComposer(run, ends.taps[0], live),
            ReceiverComposer(self._agreement, ends.receiver, ends.taps[1], live),
        )
        self._loop = VirtualFlight(ends.run, parts.lines[1], ends.receiver)
        self._loop.greet()
        if self._node.session.refusal is not None:
            raise RuntimeError(refusal_text(self._node.session.refusal))
        self._loop.begin(parts.flight_ticks)
        self.over = False

    def advance(self, until_s: float, budget_s: float) -> float:
        """Fly to a flight time, for at most `budget_s` of the wall's time; return the time reached."""
        tick_s = self._terms.tick_ns / 1e9
        stop_s = time.monotonic() + budget_s
        while not self.over and time.monotonic() < stop_s and self._run.tick * tick_s < until_s:
            for _ in range(TICKS_AT_ONCE):
                if self._run.tick * tick_s >= until_s:
                    break
                if not self._loop.step():
                    self._finish()
                    break
        return self._run.tick * tick_s

    def _finish(self) -> None:
        self.over = True
        self._loop.finish(lambda: End(Ending.OVER))

    def news(self, pace: float | None, paused: bool) -> str:
        """Return what is new since the last call, as the page's board messages, in JSON."""
        self._asked.pace, self._asked.paused = pace, paused
        self._node.flush_records()
        self._receiver.session.flush_records()
        up, down = (composer.compose() for composer in self._composers)
        events = [
            {"role": one["role"], **event, "text": event_text(event)}
            for one in (down, up)
            for event in one.pop("events")
        ]
        events.sort(key=lambda one: one["time_s"])
        down.pop("samples")
        return json.dumps(
            {
                "points": [
                    [one["time_s"], one["true"] or one["measured"], one["coded"], one["range"]]
                    for one in up.pop("points")
                ],
                "decisions": [[one["time_s"], one["reference"]] for one in down.pop("points")],
                "samples": [[one[name] for name in SAMPLE_FIELDS] for one in up.pop("samples")],
                "events": [one for one in events if is_shown(one)],
                "heads": {"transmitter": up, "receiver": down},
            }
        )

    def steer(self, value: float | None) -> None:
        """Take the set-point of the first output by hand; None: follow the reference again."""
        first = self._asked.steering[0]
        if first is None:
            return
        low, high = first.stops
        first.steer(None if value is None else max(low, min(high, value)))
        self._node.scores.forget_reference()
        cause = ByHand.FOLLOW if value is None else ByHand.SET_POINT
        unit = self._terms.signals.outputs[0].unit
        self._report(cause, self._receiver.session, value=value, detail=None if value is None else unit)

    def impair(self, text: str) -> None:
        """Change the impairments of the line."""
        faults = parse_impairments(text)
        for line, one in zip(self._lines, (faults.up, faults.down), strict=True):
            impair(line, one)
        self._asked.impairments = text
        self._report(ByHand.IMPAIR, self._node.session, detail=text)

    def corrupt(self, end: str) -> None:
        """Change one bit of the range in the codec of one end, after its next sample."""
        up, down = self._node.session, self._receiver.session
        session, sample = (up, up.next_sample) if end == "transmitter" else (down, down.state.sample)
        codec: Any = session.codec
        codec.arm(parse_sabotage(f"sample={sample},field=range"))
        self._report(ByHand.CORRUPT, session, detail="range")

    def symbols_file(self) -> bytes:
        """Return the flight so far as `tenbaud replay` reads it."""
        self._receiver.session.flush_records()
        kept = self._symbols
        return pack(self._agreement, kept.epochs, tuple(kept.steps), kept.last_digest).data

    def _report(
        self, cause: ByHand, session: Any, *, value: float | None = None, detail: str | None = None
    ) -> None:
        tick, sample = self._run.tick, self._receiver.session.state.sample
        time_ns = tick * self._terms.tick_ns
        event = Event(EventKind.CONTROL, sample, time_ns, tick, cause=cause, value=value, detail=detail)
        session.events.append(event)
        write_event(self._taps[session is self._receiver.session], event)
