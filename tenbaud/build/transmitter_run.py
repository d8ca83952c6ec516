"""The parts of one transmitter before, during and after its flight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from channel.line.line import Line, Uplink
from tenbaud.build.flight import Agreement
from transmitter.endpoint import TransmitterEndpoint, TransmitterNode

Stop = Callable[[], bool]


@dataclass(slots=True)
class TransmitterRun:
    """The parts of one transmitter, before, during and after its flight."""

    agreement: Agreement
    endpoint: TransmitterEndpoint
    downlink: Line
    """of the virtual clock; on a real one the receiver has its own"""
    ticks: int = 0
    """flown by this process"""
    rejoin_bytes: int = 0
    """what rejoins cost: control frames of both directions, without greeting and farewell"""
    flight_s: float = 0.0
    """wall-clock time of the flight itself"""
    wire_bytes_down: int = 0
    desyncs_asked: float = 0.0
    """lockstep failures that were asked for while the flight went on"""
    extra: dict[str, Any] = field(default_factory=dict)
    """figures of the clock that was flown on"""

    def expect_desyncs(self, more: float) -> None:
        """Add to the number of lockstep failures that were asked for."""
        self.desyncs_asked += more

    @property
    def node(self) -> TransmitterNode:
        return self.endpoint.node

    @property
    def uplink(self) -> Uplink:
        return self.endpoint.uplink
