"""The emulated device in real time: samples on a separate grid, commands as they come."""

from __future__ import annotations

import time
from collections.abc import Callable

from transmitter.rigs.emulator.device import EmulatedDevice
from transmitter.rigs.emulator.line import DeviceLine
from transmitter.rigs.emulator.speech import Speech

NS = 1_000_000_000


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
        """Return what the device saw, for a test or a person."""
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
