"""The interface of a serial format: bytes to samples, commands to bytes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter

from transmitter.rigs.formats.framing import Cutter
from transmitter.rigs.formats.samples import RawSample, Wraps


class SerialFormat(ABC):
    """One way in which a device talks. It keeps half-read bytes, so every port has its own."""

    name: str
    wraps = Wraps()
    greeting = b""
    """to send when the port has been opened"""
    poll = b""
    """to send for every sample; empty where the device streams by itself"""
    has_output = True
    """whether commands can be sent at all"""

    def __init__(self, delimiter: bytes, bytes_max: int) -> None:
        self.counts: Counter[str] = Counter()
        """bad_frames, log_lines, foreign"""
        self._cutter = Cutter(delimiter, bytes_max)

    def reset(self) -> None:
        """Forget what is half read: the port has been opened anew."""
        self._cutter.reset()

    def feed(self, data: bytes) -> list[RawSample]:
        """Return the samples that these bytes complete; what is damaged is counted and dropped."""
        samples = []
        for piece in self._cutter.feed(data):
            try:
                sample = self._sample(piece)
            except ValueError:
                self.counts["bad_frames"] += 1
                continue
            if sample is not None:
                samples.append(sample)
        return samples

    @abstractmethod
    def command(self, sequence: int, volts: tuple[float, ...], enable: bool) -> bytes:
        """Return the message that puts voltages on the outputs, or turns them off."""

    @abstractmethod
    def _sample(self, piece: bytes) -> RawSample | None:
        """Return the sample in a piece of the stream, if any; ValueError for what is damaged."""
