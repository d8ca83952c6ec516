"""An emulated device without its line: body, encoders, outputs, watchdog.

It behaves like a board beside a real body. The body rests until the motors are first enabled, then
moves in real time, with or without a listener. The outputs are cut when no command comes for the
watchdog's time, and stay cut until a command says that the motors are off: arming again is on purpose.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from channel.flight_log import FlightLog
from plant_sim.encoder import Encoder
from plant_sim.plant import Plant
from transmitter.rigs.emulator.faults import Faults
from transmitter.rigs.emulator.line import DeviceLine
from transmitter.rigs.emulator.speech import Speech
from transmitter.rigs.formats.samples import DeviceFlag, RawSample

NS = 1_000_000_000
DEFAULT_WATCHDOG_S = 0.1
OFF = (0.0, 0.0)
PITCH_CHANNEL = 1
CHANNELS = 3


Encoders = Mapping[int, Encoder]
"""Channel to encoder, in the order of the plant's outputs."""


class Body(Protocol):
    """Whatever turns the encoders."""

    def counts_at(self, time_ns: int, volts: tuple[float, float]) -> list[int]:
        """Return the counts of every channel at a time since the motors were first enabled.

        The volts are held until then.
        """


class SimulatedBody:
    """A plant that is stepped up to the time asked for."""

    def __init__(self, plant: Plant, step_ns: int, encoders: Encoders) -> None:
        self._plant = plant
        self._step_ns = step_ns
        self._encoders = encoders
        self._steps = 0

    def counts_at(self, time_ns: int, volts: tuple[float, float]) -> list[int]:
        """Advance to this time and read the encoders."""
        while (self._steps + 1) * self._step_ns <= time_ns:
            self._plant.advance(volts)
            self._steps += 1
        return _read(self._encoders, self._plant.measured)


class RecordedBody:
    """A recorded flight: its outputs come again, one row per tick; past the last, the last stays."""

    def __init__(self, log: FlightLog, tick_ns: int, encoders: Encoders) -> None:
        self._log = log
        self._tick_ns = tick_ns
        self._encoders = encoders

    def counts_at(self, time_ns: int, volts: tuple[float, float]) -> list[int]:
        """Return the row of this time."""
        row = min(max(0, time_ns) // self._tick_ns, len(self._log) - 1)
        return _read(self._encoders, self._log.measured[row].tolist())


def _read(encoders: Encoders, outputs: Sequence[float]) -> list[int]:
    """Return the counts of every channel; one without an encoder stays at 0."""
    counts = [0] * CHANNELS
    for (channel, encoder), value in zip(encoders.items(), outputs, strict=True):
        counts[channel] = encoder.counts(value)
    return counts


class EmulatedDevice:
    """The board. Time comes in as nanoseconds of any monotonic clock; it must not go back."""

    def __init__(
        self,
        body: Body,
        now_ns: int,
        watchdog_s: float = DEFAULT_WATCHDOG_S,
        faults: Faults | None = None,
        faulty: int = PITCH_CHANNEL,
    ) -> None:
        """`faulty` is the channel of the encoder that jumps or is stuck where a fault is due."""
        self.faults = faults or Faults()
        self._faulty_channel = faulty
        self.volts: tuple[float, float] = OFF
        self.enabled = False
        self.tripped = False
        self.counts: Counter[str] = Counter()
        """samples, commands, watchdog_trips, resets"""
        self.flags = DeviceFlag(0)
        self._body = body
        self._watchdog_ns = round(watchdog_s * NS)
        self._boot_ns = now_ns
        self._first_enabled_ns: int | None = None
        self._heard_ns = now_ns
        self._sequence = 0
        self._zero = [0] * CHANNELS
        self._turned = body.counts_at(0, OFF)
        self._stuck_at: int | None = None

    def flight_s(self, now_ns: int) -> float | None:
        """Return the time since the motors were first enabled, None before."""
        if self._first_enabled_ns is None:
            return None
        return (now_ns - self._first_enabled_ns) / NS

    def advance(self, now_ns: int) -> None:
        """Let time pass: the body moves, the watchdog looks."""
        if self.enabled and now_ns - self._heard_ns > self._watchdog_ns:
            # The outputs went off when the time was over, not when somebody looked.
            self._move(self._heard_ns + self._watchdog_ns)
            self.enabled, self.tripped, self.volts = False, True, OFF
            self.counts["watchdog_trips"] += 1
        self._move(now_ns)
        flight_s = self.flight_s(now_ns)
        if self.faults.active("estop", flight_s) is not None:
            self.enabled, self.volts = False, OFF
            self.flags |= DeviceFlag.ESTOP_OPEN
        else:
            self.flags &= ~DeviceFlag.ESTOP_OPEN
        if self.faults.take_due("reset", flight_s) is not None:
            self._reset(now_ns)

    def command(
        self, now_ns: int, volts: tuple[float, float], enable: bool, zero_encoders: bool = False
    ) -> None:
        """Take a command that came whole."""
        self.advance(now_ns)
        self.counts["commands"] += 1
        self._heard_ns = now_ns
        if zero_encoders:
            self._zero = list(self._turned)
        if not enable:
            self.enabled, self.tripped, self.volts = False, False, OFF
            return
        if self.tripped or self.flags & DeviceFlag.ESTOP_OPEN:
            return
        if self._first_enabled_ns is None:
            self._first_enabled_ns = now_ns
        self.enabled, self.volts = True, volts

    def sample(self, now_ns: int) -> RawSample:
        """Return the sample of this moment."""
        self.advance(now_ns)
        self.counts["samples"] += 1
        self._sequence += 1
        flags = self.flags | DeviceFlag.EMULATED
        flags |= DeviceFlag.WATCHDOG_TRIPPED if self.tripped else DeviceFlag(0)
        flags |= DeviceFlag.OUTPUT_ENABLED if self.enabled else DeviceFlag(0)
        time_us = (now_ns - self._boot_ns) // 1000
        counts = [turned - zero for turned, zero in zip(self._turned, self._zero, strict=True)]
        counts[self._faulty_channel] = self._faulty(now_ns, counts[self._faulty_channel])
        return RawSample(tuple(counts), self._sequence, time_us, flags)

    def _faulty(self, now_ns: int, counts: int) -> int:
        """Return the counts of the faulty encoder."""
        flight_s = self.flight_s(now_ns)
        jump = self.faults.take_due("jump", flight_s)
        if jump is not None:
            self._zero[self._faulty_channel] -= round(jump.amount)
        if self.faults.active("stuck", flight_s) is None:
            self._stuck_at = None
            return counts
        if self._stuck_at is None:
            self._stuck_at = counts
        return self._stuck_at

    def _move(self, now_ns: int) -> None:
        if self._first_enabled_ns is not None:
            self._turned = self._body.counts_at(now_ns - self._first_enabled_ns, self.volts)

    def _reset(self, now_ns: int) -> None:
        """Begin anew, as a board does after a dip of its supply: counts and clock start at zero."""
        self.counts["resets"] += 1
        self.enabled, self.tripped, self.volts = False, False, OFF
        self._zero = list(self._turned)
        self._sequence = 0
        self._boot_ns = now_ns


class RigEmulator:
    """One device on one line; see `run`."""

    def __init__(
        self, device: EmulatedDevice, speech: Speech, line: DeviceLine, samples_per_s: float
    ) -> None:
        self.device = device
        self.speech = speech
        self.line = line
        self._period_ns = round(NS / samples_per_s)
        self._plugged = True

    def run(self, should_stop: Callable[[], bool]) -> None:
        """Behave like the device until stopped; the line is plugged in by the caller."""
        due_ns = time.monotonic_ns()
        while not should_stop():
            now_ns = time.monotonic_ns()
            self.line.wait(min((due_ns - now_ns) / NS, 0.1))
            now_ns = time.monotonic_ns()
            self.device.advance(now_ns)
            flight_s = self.device.flight_s(now_ns)
            self._plug(self.device.faults.active("unplug", flight_s) is None)
            silent = self.device.faults.active("silent", flight_s) is not None
            asked = self._listen(now_ns, silent)
            if now_ns >= due_ns:
                due_ns += self._period_ns
                if now_ns - due_ns > NS // 10:
                    due_ns = now_ns
                asked += self.speech.streams
            muted = silent or self.device.faults.active("mute", flight_s) is not None
            for _ in range(asked):
                self._say(muted)

    def figures(self) -> dict[str, object]:
        """Return the counts of the device, for a test or a person."""
        device = self.device
        return {
            **device.counts,
            **self.speech.counts,
            "volts": list(device.volts),
            "enabled": device.enabled,
            "tripped": device.tripped,
        }

    def _listen(self, now_ns: int, silent: bool) -> int:
        data = self.device.faults.thin(self.line.read())
        if silent or not data:
            return 0
        commands, asked = self.speech.feed(data)
        for command in commands:
            self.device.command(now_ns, *command)
        return asked

    def _say(self, muted: bool) -> None:
        sample = self.device.sample(time.monotonic_ns())
        if muted:
            return
        data = self.device.faults.thin(self.speech.encode(sample))
        if not self.line.write(data):
            self.device.counts["samples_untaken"] += 1

    def _plug(self, wanted: bool) -> None:
        if wanted == self._plugged:
            return
        self._plugged = wanted
        if wanted:
            self.line.plug()
        else:
            self.line.unplug()
