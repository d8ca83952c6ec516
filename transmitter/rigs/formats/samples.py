"""One sample of a device: its counts and its status."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from enum import IntFlag
from typing import NamedTuple

RESTART_EXCESS_S = 60.0
"""A device clock that runs this far ahead of the host's between two samples was set anew."""


class DeviceFlag(IntFlag):
    """A device's report beside its counts."""

    ESTOP_OPEN = 1
    WATCHDOG_TRIPPED = 2
    ENCODER_ERROR = 4
    OUTPUT_ENABLED = 8
    EMULATED = 0xA0
    """the rig emulator; the upper half of the byte is the firmware's own otherwise"""


def flags_of(byte: int) -> DeviceFlag:
    """Return the flags in a byte; bits that a firmware uses for itself are left out."""
    emulated = byte & 0xF0 == DeviceFlag.EMULATED
    return DeviceFlag(byte & 0x0F) | (DeviceFlag.EMULATED if emulated else DeviceFlag(0))


class RawSample(NamedTuple):
    """A sample as it stood on the line."""

    counts: tuple[int, ...]
    """of every encoder channel"""
    sequence: int | None = None
    """wraps at the format's modulus"""
    device_us: int | None = None
    """device time; wraps at the format's modulus"""
    flags: DeviceFlag = DeviceFlag(0)


class DeviceSample(NamedTuple):
    """A sample with its place in time."""

    counts: tuple[int, ...]
    flags: DeviceFlag
    host_ns: int
    """when it was complete at this machine, monotonic"""
    device_us: int | None
    """device time since the first sample, unwrapped"""
    elapsed_s: float
    """since the sample before: by the device's clock if it has one, else by ours"""
    restarted: bool
    """the device began anew since the sample before"""


@dataclass(frozen=True, slots=True)
class Wraps:
    """The wrap-around of a format's sequence and device time."""

    sequence: int = 1 << 16
    device_us: int = 1 << 32


class Timeline:
    """Unwraps sequence and device time; counts gaps; notices a device that began anew."""

    def __init__(self, wraps: Wraps) -> None:
        self._wraps = wraps
        self._last: RawSample | None = None
        self._last_host_ns = 0
        self._device_us = 0
        self.counts: Counter[str] = Counter()
        """samples, lost (missing in the sequence), repeated, restarts"""

    def take(self, raw: RawSample, host_ns: int) -> DeviceSample:
        """Place one sample; samples are given in the order in which they came."""
        last, self._last = self._last, raw
        host_s = (host_ns - self._last_host_ns) / 1e9
        self._last_host_ns = host_ns
        self.counts["samples"] += 1
        if last is None:
            return self._placed(raw, host_ns, 0.0, False)
        step_us = _forward(last.device_us, raw.device_us, self._wraps.device_us)
        steps = _forward(last.sequence, raw.sequence, self._wraps.sequence)
        late = step_us is not None and step_us / 1e6 > host_s + RESTART_EXCESS_S
        if late or _is_back(step_us, self._wraps.device_us) or _is_back(steps, self._wraps.sequence):
            self.counts["restarts"] += 1
            return self._placed(raw, host_ns, host_s, True)
        if steps == 0:
            self.counts["repeated"] += 1
        elif steps is not None:
            self.counts["lost"] += steps - 1
        if step_us is None:
            return self._placed(raw, host_ns, host_s, False)
        self._device_us += step_us
        return self._placed(raw, host_ns, step_us / 1e6, False)

    def _placed(self, raw: RawSample, host_ns: int, elapsed_s: float, restarted: bool) -> DeviceSample:
        device_us = None if raw.device_us is None else self._device_us
        return DeviceSample(raw.counts, raw.flags, host_ns, device_us, elapsed_s, restarted)


def _forward(before: int | None, now: int | None, modulus: int) -> int | None:
    if before is None or now is None:
        return None
    return (now - before) % modulus


def _is_back(step: int | None, modulus: int) -> bool:
    """Return whether a step is shorter backwards: that is a new beginning, not a gap."""
    return step is not None and step > modulus // 2
