"""The interface of a serial format: bytes to samples, commands to bytes."""

from __future__ import annotations

from collections import Counter
from typing import Protocol

from transmitter.rigs.formats.samples import RawSample, Wraps


class SerialFormat(Protocol):
    """One way in which a device talks. It keeps half-read bytes, so every port has its own."""

    name: str
    wraps: Wraps
    greeting: bytes
    """to send when the port has been opened"""
    poll: bytes
    """to send for every sample; empty where the device streams by itself"""
    has_output: bool
    """whether commands can be sent at all"""
    counts: Counter[str]
    """bad_frames, log_lines, foreign"""

    def reset(self) -> None:
        """Forget what is half read: the port has been opened anew."""

    def feed(self, data: bytes) -> list[RawSample]:
        """Return the samples that these bytes complete; what is damaged is counted and dropped."""

    def command(self, sequence: int, volts: tuple[float, ...], enable: bool) -> bytes:
        """Return the message that puts voltages on the outputs, or turns them off."""
