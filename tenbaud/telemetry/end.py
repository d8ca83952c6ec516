"""One end's telemetry, put together: tap, port, commands and publisher."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

from channel.errors import LinkError
from channel.links.base import Role
from channel.links.kind import NodePlace
from channel.links.security import Security
from channel.protocol.recording import Recorder
from receiver.controllers.references import SteeredReference
from receiver.endpoint import ReceiverEndpoint
from tenbaud.build.downlink import said_by_words
from tenbaud.build.flight import Agreement
from tenbaud.build.references import build_references
from tenbaud.build.transmitter_run import Stop, TransmitterRun
from tenbaud.telemetry.command_queue import CommandQueue
from tenbaud.telemetry.compose import Composer
from tenbaud.telemetry.live import LiveReceiver, LiveTransmitter
from tenbaud.telemetry.place import SOCKET, endpoint_for
from tenbaud.telemetry.publisher import Publisher
from tenbaud.telemetry.tap import Tap


@dataclass(frozen=True, slots=True)
class TelemetryOptions:
    """The telemetry options of the command line."""

    endpoint: str = ""
    """"" as usual, "on", "off" or a Zenoh endpoint to listen on"""
    control: bool = False
    """whether the flight may be steered from outside"""
    pace: float | None = None
    """virtual seconds per second at most"""

    def check(self, role: Role, insecure: bool, secured: bool) -> None:
        """Raise LinkError for an endpoint that cannot be used, before anything starts."""
        if self.endpoint:
            endpoint_for(self.endpoint, role, (), insecure, secured)


DEFAULT_OPTIONS = TelemetryOptions()
STEERABLE = ("pid", "state_feedback")
"""Controllers whose set-points may be taken over in flight."""
FREE = (-math.inf, math.inf)


class TelemetryEnd:
    """The telemetry of one end, from before its parts are built until after its flight.

    `node` is that of the flight's link; the viewers invited there may see the telemetry, and steer
    where the flight allows it. An error only disables the telemetry, unless it was asked for: LinkError
    for an endpoint that cannot be used.
    """

    def __init__(
        self,
        agreement: Agreement,
        role: Role,
        recorder: Recorder,
        options: TelemetryOptions,
        node: NodePlace,
    ) -> None:
        self.agreement = agreement
        self.role: Role = role
        self.endpoint: str | None = None
        self.publisher: Publisher | None = None
        self.requested = bool(options.endpoint)
        """whether this telemetry was asked for, so that a flight without it is refused"""
        security, insecure = node.get("security"), node.get("insecure", False)
        addresses = node.get("listen", ()) + node.get("connect", ()) + node.get("router", ())
        with self._optional():
            secured = security is not None
            self.endpoint = endpoint_for(options.endpoint, role, addresses, insecure, secured)
        steerable = agreement.live and self.endpoint is not None
        if steerable and self.endpoint and not self.endpoint.startswith((SOCKET, "tls/")):
            sys.stderr.write(
                f"tenbaud: anyone who reaches {self.endpoint} can steer this flight, every user of "
                "this machine included; leave --telemetry out, or use tls/, to decide who may\n"
            )
        self.tap = None if self.endpoint is None else Tap(recorder)
        self.recorder: Recorder = self.tap or recorder
        """the recorder of the end: the tap, if there is one"""
        self.queue = CommandQueue() if steerable else None
        self.steering = steered(agreement)
        self.pace = options.pace if agreement.clock == "virtual" else None
        self.security = None if security is None else _for_viewers(security, agreement.live)

    def fly_transmitter(
        self, run: TransmitterRun, stop: Stop, keep_alive: Callable[[], object] | None = None
    ) -> LiveTransmitter:
        """Return what obeys commands for this transmitter, hung into its loop where it has work."""
        live = LiveTransmitter(run, self.queue, stop, self.pace, keep_alive or (lambda: None))
        if self.queue is not None or self.pace is not None:
            run.node.before_every_tick(live.at_tick)
        return live

    def fly_receiver(self, endpoint: ReceiverEndpoint, stop: Stop) -> LiveReceiver:
        """Return what obeys commands for this receiver: its loop asks it whether to stop."""
        text = self.agreement.config.link.impairments
        return LiveReceiver(endpoint, self.queue, stop, self.recorder, self.steering, text)

    @contextmanager
    def publishing(self, composer: Callable[[Tap], Composer]) -> Iterator[None]:
        """Within the `with`, telemetry goes out, if this flight has any."""
        port = self._port()
        if port is None or self.tap is None:
            yield
            return
        rate_hz = self.agreement.config.telemetry.rate_hz
        self.publisher = Publisher(composer(self.tap), port, rate_hz)
        with self.publisher:
            yield

    def summary(self) -> dict[str, Any]:
        if self.publisher is None or self.tap is None:
            return {"telemetry": "off"}
        counted = {
            "telemetry": self.publisher.error or "on",
            "telemetry_sent": self.publisher.sent,
            "telemetry_dropped": self.publisher.composer.skipped,
            "telemetry_rows_dropped": self.tap.dropped,
        }
        if self.queue is not None:
            counted["commands_refused"] = self.queue.refused
        return counted

    def _port(self) -> Any:
        if self.endpoint is None:
            return None
        from channel.links.zenoh.telemetry import TelemetryPort

        on_command = None if self.queue is None else self.queue.offer
        name = self.agreement.config.link.session
        security = self.security if self.endpoint.startswith("tls/") else None
        with self._optional():
            return TelemetryPort(self.role, name, self.endpoint, on_command, security)
        return None

    @contextmanager
    def _optional(self) -> Iterator[None]:
        """Within the `with`, a LinkError is only reported, unless the telemetry was asked for."""
        try:
            yield
        except LinkError as error:
            if self.requested:
                raise
            sys.stderr.write(f"tenbaud: no telemetry: {error}\n")


def steered(agreement: Agreement) -> tuple[SteeredReference | None, ...] | None:
    """Return the set-points of a flight so that they can be steered; None where they cannot."""
    if not (agreement.live and agreement.config.receiver.controller in STEERABLE):
        return None
    references = build_references(agreement.config, agreement.signals, agreement.codec.model)
    stops = agreement.config.model.stops
    words = said_by_words(agreement.two_way)
    found: list[SteeredReference | None] = []
    for place, (output, one) in enumerate(zip(agreement.signals.outputs, references, strict=True)):
        ends = stops.get(output.name, FREE), words.get(place, FREE)
        within = max(low for low, _ in ends), min(high for _, high in ends)
        found.append(None if one is None else SteeredReference(one, within))
    return tuple(found)


def _for_viewers(security: Security, steerable: bool) -> Security:
    viewers = [one for one in security.invited if one.part == "viewer"]
    if steerable:
        viewers = [replace(one, part="operator") for one in viewers]
    return replace(security, invited=tuple(viewers))
