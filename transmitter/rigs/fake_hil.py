"""A double of the vendor's `HIL` class with exactly the methods that we use, a body inside it.

For tests, and for a user who wants to see the set-up before the board is there (`--rig hil:fake`).
"""

from __future__ import annotations

import time
from typing import Any, ClassVar

from plant_sim.encoder import QUANSER_PITCH
from plant_sim.pitch import PitchParameters, PitchPlant

STEP_S = 0.001
ANALOG_OUTPUTS = 8


class FakeHILError(Exception):
    """The error of the vendor's package."""

    def get_error_message(self) -> str:
        return str(self)


class FakeHIL:
    """A board with a pitching body on encoder 1 and motors on analogue outputs 0 and 1.

    `opened` holds the board that was opened last, for a test to look at.
    """

    INFINITE = -1
    opened: ClassVar[FakeHIL | None] = None
    parameters: ClassVar[PitchParameters] = PitchParameters()

    def __init__(self, card_type: str, card_identifier: str) -> None:
        if card_identifier == "absent":
            raise FakeHILError("no such card")
        type(self).opened = self
        self.analog = [0.0] * ANALOG_OUTPUTS
        self.digital: dict[int, int] = {}
        self.calls: list[str] = []
        self.closed = False
        self.stuck = False
        self.silent = False
        self.writes = 0
        self._plant = PitchPlant(self.parameters, STEP_S)
        self._started = time.monotonic()
        self._moving_since: float | None = None
        self._steps = 0
        self._period_s = 0.01
        self._due = 0.0
        self._watchdog_s: float | None = None
        self._fed = 0.0
        self.expired = False

    def set_card_specific_options(self, options: str, length_max: int) -> None:
        self.calls.append(f"options {options}")

    def write_analog(self, channels: Any, count: int, volts: Any) -> None:
        """Put voltages on outputs; refused after the watchdog has expired."""
        self._look()
        if self.expired:
            raise FakeHILError("the watchdog has expired")
        self._move()
        for channel, value in zip(channels, volts, strict=True):
            self.analog[channel] = float(value)
        self.writes += 1
        if self._moving_since is None and any(self.analog):
            self._moving_since = time.monotonic()

    def write_digital(self, channels: Any, count: int, states: Any) -> None:
        self.calls.append(f"digital {[int(state) for state in states]} at {self.analog[:2]}")
        self.digital.update(zip((int(one) for one in channels), map(int, states), strict=True))

    def task_create_encoder_reader(self, samples_in_buffer: int, channels: Any, count: int) -> int:
        self.calls.append("create")
        return 1

    def task_set_buffer_overflow_mode(self, task: int, mode: Any) -> None:
        """Take the mode."""

    def task_start(self, task: int, clock: Any, frequency: float, samples: int) -> None:
        self.calls.append("start")
        self._period_s = 1.0 / frequency
        self._due = time.monotonic()

    def task_read_encoder(self, task: int, count: int, buffer: Any) -> int:
        """Wait for the next timed sample and return how many there are."""
        self._due += self._period_s
        while self.silent:
            time.sleep(0.01)
            self._look()
        time.sleep(max(0.0, self._due - time.monotonic()))
        self._look()
        self._move()
        if not self.stuck:
            buffer[1] = QUANSER_PITCH.counts(self._plant.measured[0])
        return 1

    def task_stop(self, task: int) -> None:
        self.calls.append("stop")

    def task_delete(self, task: int) -> None:
        self.calls.append("delete")

    def watchdog_set_analog_expiration_state(self, channels: Any, count: int, volts: Any) -> None:
        """Refuse, as most boards do."""
        raise FakeHILError("not supported by this card")

    def watchdog_start(self, timeout_s: float) -> None:
        self._watchdog_s, self._fed = timeout_s, time.monotonic()

    def watchdog_reload(self) -> bool:
        """Feed it; False when it has expired already."""
        self._look()
        self._fed = time.monotonic()
        return not self.expired

    def watchdog_clear(self) -> None:
        self.expired, self._watchdog_s = False, None

    def watchdog_stop(self) -> None:
        self._watchdog_s = None

    def close(self) -> None:
        self._look()
        self.calls.append("close")
        self.closed = True

    def _look(self) -> None:
        if self._watchdog_s is not None and time.monotonic() - self._fed > self._watchdog_s:
            self._move()
            self.expired = True
            self.analog = [0.0] * ANALOG_OUTPUTS

    def _move(self) -> None:
        """Carry the body on; it rests until a motor first turns."""
        if self._moving_since is None:
            return
        due = int((time.monotonic() - self._moving_since) / STEP_S)
        while self._steps < due:
            self._plant.advance((self.analog[0], self.analog[1]))
            self._steps += 1
