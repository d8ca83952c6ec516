"""Common parts of every real rig: the newest sample, its faults, and motors that end up off.

A reader thread hands samples in (`_take`); the flight's thread asks for the newest one (`read`) and
sends voltages (`write`). The motors are enabled by the first `write`, which only a flight makes, and
it distinguishes two kinds of faults:

* A *hard* fault (emergency stop, encoder error, a jump, a device that began anew or whose own watchdog
  fired, a voltage that is no number) turns the outputs off at once, and they stay off.
* A *stale* sample is reported in the reading; the guard then takes the voltages down along its ramp,
  because a body that loses its lift at once falls.
"""

from __future__ import annotations

import atexit
import math
import threading
import time
from abc import abstractmethod
from collections import Counter
from dataclasses import dataclass

from channel.codec.codec import Vector
from transmitter.rigs.axes import Axis, Motors
from transmitter.rigs.base import DeviceNote, Reading, Rig, RigError
from transmitter.rigs.formats.samples import DeviceFlag, DeviceSample, RawSample, Timeline, Wraps

REARM_TIMEOUT_S = 1.0
"""A device has this long to clear its watchdog's flag after the message that the motors are off."""

DECLARED_LEAST = 10
"""Fewer samples do not show that a device is the rig emulator."""

HOST_SLACK_S = 0.05
"""Arrival times tell the time between two samples only this well."""


@dataclass(frozen=True, slots=True)
class DeviceSettings:
    """Limits for the age and speed of samples, and for waiting."""

    stale_s: float = 0.1
    """age of the newest sample beyond which the sensor counts as lost"""
    first_sample_timeout_s: float = 5.0
    """many boards start anew when their port is opened, and take two seconds for it"""
    rate_max_rad_per_s: float = 20.0
    """faster than any axis turns; a step beyond it is a jump"""
    output: bool = True
    """False: never send a command, not even a zero"""


@dataclass(frozen=True, slots=True)
class Wiring:
    """The axes and motors of a device, and the limits of their use."""

    axes: tuple[Axis, ...]
    """all encoders"""
    measured: tuple[str, ...]
    """names of those that the codec measures, in its order"""
    motors: Motors
    settings: DeviceSettings


class DeviceRig(Rig):
    """Base of the rigs that talk to a device."""

    is_real = True
    ramps_down = True

    def __init__(self, wiring: Wiring, wraps: Wraps) -> None:
        axes = self.axes = wiring.axes
        self.motors = wiring.motors
        self.settings = wiring.settings
        self.timeline = Timeline(wraps)
        self.counts: Counter[str] = Counter()
        """reads, samples_skipped, writes, writes_lost, sign_reversals"""
        self.hard_fault: str | None = None
        self._measured = [axis for name in wiring.measured for axis in axes if axis.name == name]
        self._first: DeviceSample | None = None
        self.latest: DeviceSample | None = None
        self._arrived = threading.Condition()
        self._unread = 0
        self._declared = self._undeclared = 0
        """samples in a row that declare the rig emulator, and all that do not"""
        self._enabled = False
        self._last_volts: Vector = ()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._thread_error: RigError | None = None
        self._problem = ""
        """why the reader has no device at present"""

    # The methods of a kind of device

    @abstractmethod
    def _connect(self) -> None:
        """Open the device; RigError when it cannot be."""

    @abstractmethod
    def _run(self) -> None:
        """Read until `_closing` is set, handing samples to `_take`; reconnect as needed."""

    @abstractmethod
    def _send(self, outputs: tuple[float, ...], enable: bool) -> None:
        """Put one value on each output, or turn the outputs off. Must not raise for a lost device."""

    @abstractmethod
    def _disconnect(self) -> None:
        """Give the device back; may be called more than once."""

    # Rig

    def open(self) -> None:
        """Connect, tell the device that its motors are off, and wait for its first sample."""
        self._connect()
        atexit.register(self.safe_stop)
        try:
            self._thread = threading.Thread(target=self._guarded_run, name=self.name, daemon=True)
            self._thread.start()
            self._await_sample()
            self._await_rearm()
        except BaseException:
            self.close()
            raise

    def read(self, tick: int) -> Reading:
        """Return the newest sample, with its faults."""
        with self._arrived:
            sample, unread, self._unread = self.latest, self._unread, 0
        if sample is None:
            raise RigError(f"{self.name}: read before it was opened")
        self.counts["reads"] += 1
        self.counts["samples_skipped"] += max(0, unread - 1)
        age_s = (time.monotonic_ns() - sample.host_ns) / 1e9
        fault = self.hard_fault or _flag_fault(sample.flags & ~DeviceFlag.WATCHDOG_TRIPPED)
        if fault is None and age_s > self.settings.stale_s:
            fault = f"no sample from the rig for {age_s:.3f} s {self._problem}".rstrip()
        counts = tuple(sample.counts[axis.channel] for axis in self._measured)
        return Reading(
            counts,
            self.angles_rad(sample, self._measured),
            fault=fault,
            device=DeviceNote(
                sample.counts,
                None if sample.device_us is None else sample.device_us / 1e6,
                age_s * 1e3,
                self.timeline.counts["lost"],
            ),
        )

    def write(self, tick: int, volts: Vector) -> None:
        """Send these voltages at once; the first call enables the motors."""
        if not self.settings.output:
            return
        if not all(math.isfinite(value) for value in volts):
            self._fail(f"the voltages of tick {tick} are not numbers: {volts}")
        if self.hard_fault is not None:
            self._send(self.motors.off(), False)
            return
        for before, value in zip(self._last_volts, volts, strict=False):
            self.counts["sign_reversals"] += before * value < 0.0
        self._enabled = True
        self._last_volts = volts
        self.counts["writes"] += 1
        self._send(self.motors.to_device(volts), True)

    def safe_stop(self) -> None:
        """Turn the outputs off at once, three times over: a command may be lost on the line."""
        self._enabled = False
        if not self.settings.output:
            return
        for _ in range(3):
            self._send(self.motors.off(), False)

    def close(self) -> None:
        """Turn the outputs off and give the device back."""
        atexit.unregister(self.safe_stop)
        self.safe_stop()
        self._closing.set()
        thread, self._thread = self._thread, None
        if thread is not None and thread is not threading.current_thread():
            thread.join(2.0)
        self.safe_stop()
        self._disconnect()

    def figures(self) -> dict[str, object]:
        """Return every count of the device, its samples and its commands."""
        return {"kind": self.name, **self.timeline.counts, **self.counts, "fault": self.hard_fault}

    # For those that look on

    def angles_rad(self, sample: DeviceSample, axes: list[Axis] | None = None) -> tuple[float, ...]:
        first = self._first or sample
        chosen = self.axes if axes is None else axes
        return tuple(
            axis.encoder(first.counts).angle_rad(sample.counts[axis.channel]) for axis in chosen
        )

    def wait_for_sample(self, timeout_s: float) -> DeviceSample | None:
        """Return the next sample that has not been read, None when none comes in this time."""
        with self._arrived:
            if not self._arrived.wait_for(lambda: self._unread > 0, timeout_s):
                return None
            self._unread = 0
            return self.latest

    def declares_emulation(self, timeout_s: float, late: bool = False) -> bool:
        """Return whether every sample of this time says that the device is the rig emulator.

        `late`: samples before the first that says so may be silent about it.
        """
        until = time.monotonic() + timeout_s
        while (left_s := until - time.monotonic()) > 0.0:
            if self._undeclared if not late else self._declared >= DECLARED_LEAST:
                break
            self.wait_for_sample(left_s)
        return self._declared >= DECLARED_LEAST and (late or not self._undeclared)

    # The reader's side

    def _take(self, raw: RawSample, host_ns: int) -> None:
        needed = max(axis.channel for axis in self.axes) + 1
        if len(raw.counts) < needed:
            self.counts["short_samples"] += 1
            return
        sample = self.timeline.take(raw, host_ns)
        before = self.latest
        if before is None or (sample.restarted and not self._enabled):
            self._first = sample
        elif self._enabled:
            problem = self._judge(before, sample)
            if problem is not None:
                self._fail(problem)
        declared = DeviceFlag.EMULATED in sample.flags
        with self._arrived:
            self._declared = self._declared + 1 if declared else 0
            self._undeclared += not declared
            self.latest = sample
            self._unread += 1
            self._arrived.notify_all()

    def _judge(self, before: DeviceSample, sample: DeviceSample) -> str | None:
        """Return the hard fault that a sample shows in flight, None for none."""
        if sample.restarted:
            return "the device began anew in flight: its encoders have lost their zero"
        if (problem := _flag_fault(sample.flags)) is not None:
            return problem
        known = sample.device_us is not None
        elapsed_s = sample.elapsed_s if known else sample.elapsed_s + HOST_SLACK_S
        for axis in self.axes:
            step = abs(sample.counts[axis.channel] - before.counts[axis.channel])
            if step > axis.jump_counts(self.settings.rate_max_rad_per_s, elapsed_s):
                return (
                    f"the {axis.name} encoder jumped by {step} counts in {elapsed_s * 1e3:.1f} ms, "
                    f"faster than {self.settings.rate_max_rad_per_s:g} rad/s"
                )
        return None

    def _fail(self, problem: str) -> None:
        if self.hard_fault is None:
            self.hard_fault = problem
        if self.settings.output:
            self._send(self.motors.off(), False)

    def _guarded_run(self) -> None:
        try:
            self._run()
        except RigError as error:
            self._thread_error = error
            self._problem = f"({error})"
            with self._arrived:
                self._arrived.notify_all()

    # Opening

    def _await_sample(self) -> None:
        timeout_s = self.settings.first_sample_timeout_s
        with self._arrived:
            self._arrived.wait_for(
                lambda: self.latest is not None or self._thread_error is not None, timeout_s
            )
        if self._thread_error is not None:
            raise self._thread_error
        if self.latest is None and self.counts["short_samples"]:
            raise RigError(
                f"{self.name}: its samples have fewer channels than transmitter.bridge.axes names; "
                "list there what is wired; the motors were not enabled"
            )
        if self.latest is None:
            raise RigError(
                f"{self.name}: no valid sample for {timeout_s:g} s{self._no_sample_hint()}; the "
                "motors were not enabled"
            )
        problem = _flag_fault(self.latest.flags & ~DeviceFlag.WATCHDOG_TRIPPED)
        if problem is not None:
            raise RigError(f"{self.name}: {problem}; the motors were not enabled")

    def _no_sample_hint(self) -> str:
        return f" {self._problem}".rstrip()

    def _await_rearm(self) -> None:
        """Clear the device's watchdog, which is latched until it hears that the motors are off."""
        if not self.settings.output:
            return
        until = time.monotonic() + REARM_TIMEOUT_S
        self._send(self.motors.off(), False)
        while self.latest is not None and self.latest.flags & DeviceFlag.WATCHDOG_TRIPPED:
            if time.monotonic() > until:
                raise RigError(
                    f"{self.name}: the device's watchdog has tripped and a command to turn the "
                    "motors off does not clear it; does the device hear us?"
                )
            self._send(self.motors.off(), False)
            self.wait_for_sample(0.05)


def _flag_fault(flags: DeviceFlag) -> str | None:
    """Return the fault that a device's flags report, None without."""
    if flags & DeviceFlag.ESTOP_OPEN:
        return "the emergency stop is open"
    if flags & DeviceFlag.ENCODER_ERROR:
        return "the device reports an encoder error"
    if flags & DeviceFlag.WATCHDOG_TRIPPED:
        return "the device's own watchdog tripped: no command reached it in its time"
    return None
