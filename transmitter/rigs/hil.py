"""A Quanser data acquisition board, through the vendor's own Python package.

The board's hardware clock paces a thread: it blocks for the next timed encoder sample, hands it over,
writes the newest voltages and reloads the board's watchdog. A flight's tick takes the newest sample and
leaves its voltages for the next one. The watchdog is reloaded only while those voltages are fresh: a
flight that hangs is noticed even though this thread goes on, and the outputs then go to 0 V.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from transmitter.rigs.base import RigError
from transmitter.rigs.device import DeviceRig, Wiring
from transmitter.rigs.formats.samples import RawSample, Wraps

FAKE_CARD = "fake"
OPTIONS_LENGTH_MAX = 255


@dataclass(frozen=True, slots=True)
class HilLibrary:
    """The names that we use of the vendor's package, or of its double."""

    hil: Callable[[str, str], Any]
    error: type[Exception]
    hardware_clock: Any
    overwrite_on_overflow: Any


@dataclass(frozen=True, slots=True)
class HilSettings:
    """The board, and its settings."""

    card_type: str = "q8_usb"
    card_identifier: str = "0"
    """the number of the board, or `0@tcpip://host:port` for a remote or virtual one"""
    sample_rate_hz: float = 500.0
    encoder_channels: tuple[int, ...] = (0, 1, 2)
    analog_channels: tuple[int, ...] = (0, 1)
    enable_channels: tuple[int, ...] = ()
    """digital outputs that switch the amplifiers on"""
    watchdog_s: float = 0.1
    card_options: str = ""


def load_library(card_type: str) -> HilLibrary:
    """Return the vendor's package, or the double for `card_type` "fake"; RigError without either."""
    if card_type == FAKE_CARD:
        from transmitter.rigs.fake_hil import FakeHIL, FakeHILError

        return HilLibrary(FakeHIL, FakeHILError, 0, 2)
    try:
        from quanser.hardware import HIL, BufferOverflowMode, Clock, HILError  # type: ignore[import-not-found]
    except ImportError as error:
        raise RigError(
            "the package quanser.hardware is not installed. It is Quanser's own and comes with its "
            "SDK, not from PyPI: on Linux `sudo apt-get install quanser-sdk` after adding Quanser's "
            "package source (github.com/quanser/quanser_sdk_linux); on Windows install the wheel in "
            "%QSDK_DIR%python. Without a board, `--rig hil:fake` shows how it goes"
        ) from error
    return HilLibrary(HIL, HILError, Clock.HARDWARE_CLOCK_0, BufferOverflowMode.OVERWRITE_ON_OVERFLOW)


class HilRig(DeviceRig):
    """Encoders and analogue outputs of one board; every call to it comes from one thread."""

    def __init__(self, hil: HilSettings, wiring: Wiring, library: HilLibrary | None = None) -> None:
        super().__init__(wiring, Wraps(1 << 62, 1 << 62))
        self.name = f"Quanser {hil.card_type} {hil.card_identifier}"
        self._hil = hil
        self._library = library
        self._card: Any = None
        self._task: Any = None
        self._watchdog = False
        self._switched_on = False
        self._wanted: tuple[float, ...] = wiring.motors.off()
        self._wanted_enable = False
        self._wanted_ns = 0
        self._encoders = np.array(hil.encoder_channels, dtype=np.uint32)
        self._analogs = np.array(hil.analog_channels, dtype=np.uint32)
        self._digitals = np.array(hil.enable_channels, dtype=np.uint32)

    def _connect(self) -> None:
        self._library = self._library or load_library(self._hil.card_type)
        with self._explained("cannot be opened"):
            self._card = self._library.hil(self._hil.card_type, self._hil.card_identifier)
            if self._hil.card_options:
                self._card.set_card_specific_options(self._hil.card_options, OPTIONS_LENGTH_MAX)
            if self.settings.output:
                self._write_outputs(self.motors.off(), False)

    def _run(self) -> None:
        channels = len(self._encoders)
        counts = np.zeros(channels, dtype=np.int32)
        index = 0
        try:
            with self._explained("stopped"):
                self._start_task(channels)
                while not self._closing.is_set():
                    taken = self._card.task_read_encoder(self._task, 1, counts)
                    if taken <= 0:
                        raise RigError(f"{self.name}: the timed reader returned no sample")
                    index += 1
                    self._take(
                        RawSample(tuple(int(value) for value in counts), index), time.monotonic_ns()
                    )
                    if self.settings.output:
                        self._output()
        finally:
            self._shut_down()

    def _start_task(self, channels: int) -> None:
        assert self._library is not None
        rate = self._hil.sample_rate_hz
        self._task = self._card.task_create_encoder_reader(
            max(1, round(rate)), self._encoders, channels
        )
        with contextlib.suppress(self._library.error):
            # Otherwise a reader that is held up once gets an error instead of the newest sample.
            self._card.task_set_buffer_overflow_mode(self._task, self._library.overwrite_on_overflow)
        if self.settings.output:
            self._start_watchdog()
        self._card.task_start(self._task, self._library.hardware_clock, rate, type(self._card).INFINITE)

    def _start_watchdog(self) -> None:
        """Start the board's watchdog; many boards do not take the state, and some have none."""
        assert self._library is not None
        with contextlib.suppress(self._library.error):
            zeros = np.zeros(len(self._analogs), dtype=np.float64)
            self._card.watchdog_set_analog_expiration_state(self._analogs, len(self._analogs), zeros)
        try:
            self._card.watchdog_start(self._hil.watchdog_s)
            self._watchdog = True
        except self._library.error as error:
            self.counts["without_watchdog"] = 1
            self._problem = f"(the board has no watchdog: {error})"

    def _output(self) -> None:
        """Write the flight's command while it is fresh; called once per timed sample."""
        outputs, enable = self._wanted, self._wanted_enable
        age_s = (time.monotonic_ns() - self._wanted_ns) / 1e9
        if enable and age_s > self._hil.watchdog_s:
            self._wanted_enable = False
            self._fail(f"the flight gave no voltage for {age_s:.3f} s")
            outputs, enable = self.motors.off(), False
        self._write_outputs(outputs, enable)
        if self._watchdog and not self._card.watchdog_reload():
            self._fail("the board's watchdog expired: its outputs are at their safe state")
            self._card.watchdog_clear()
            self._watchdog = False
            self._write_outputs(self.motors.off(), False)

    def _write_outputs(self, outputs: tuple[float, ...], enable: bool) -> None:
        """Zero before the amplifiers are switched on, and before they are switched off."""
        volts = np.array(outputs if enable else self.motors.off(), dtype=np.float64)
        if len(self._digitals) and enable != self._switched_on:
            self._card.write_analog(self._analogs, len(self._analogs), np.zeros_like(volts))
            states = np.full(len(self._digitals), int(enable), dtype=np.int8)
            self._card.write_digital(self._digitals, len(self._digitals), states)
        self._switched_on = enable
        self._card.write_analog(self._analogs, len(self._analogs), volts)

    def _send(self, outputs: tuple[float, ...], enable: bool) -> None:
        self._wanted, self._wanted_enable = outputs, enable
        self._wanted_ns = time.monotonic_ns()

    def _shut_down(self) -> None:
        """Zero first, then everything else; each step even if the one before failed."""
        steps: list[Callable[[], object]] = []
        if self.settings.output:
            steps.append(lambda: self._write_outputs(self.motors.off(), False))
        if self._watchdog:
            steps.append(lambda: self._card.watchdog_stop())
        if self._task is not None:
            steps += [
                lambda: self._card.task_stop(self._task),
                lambda: self._card.task_delete(self._task),
            ]
        assert self._library is not None
        for step in steps:
            with contextlib.suppress(self._library.error):
                step()

    def _disconnect(self) -> None:
        card, library = self._card, self._library
        if card is None or library is None:
            return
        with contextlib.suppress(library.error):
            # The thread has done this already, unless it still waits for a sample that never comes.
            if self.settings.output:
                self._write_outputs(self.motors.off(), False)
        with contextlib.suppress(library.error):
            card.close()
        self._card = None

    @contextlib.contextmanager
    def _explained(self, what: str) -> Iterator[None]:
        assert self._library is not None
        try:
            yield
        except self._library.error as error:
            message_of = getattr(error, "get_error_message", None)
            raise RigError(f"{self.name} {what}: {message_of() if message_of else error}") from error
