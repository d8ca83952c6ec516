"""An emulated rig in a thread of the test, and a bridge at its other end."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from tenbaud.build.emulator import EmulatedFormat, build_emulator
from tenbaud.build.rig import build_device
from tenbaud.config.load import load_config
from tenbaud.config.schema import FlightConfig
from transmitter.rigs.device import DeviceRig
from transmitter.rigs.emulator.device import RigEmulator

PATIENCE_S = 0.5


def rig_config(**transmitter: Any) -> FlightConfig:
    return load_config(None, None, {"transmitter": transmitter})


@contextmanager
def emulated(
    form: EmulatedFormat, port: str = "pty", config: FlightConfig | None = None, **options: Any
) -> Iterator[RigEmulator]:
    """Run an emulator until the end of the `with`.

    Its watchdog is patient: it shares this machine with whatever else runs on it.
    """
    options.setdefault("watchdog_s", PATIENCE_S)
    emulator = build_emulator(config or load_config(), form, port, **options)
    stop = threading.Event()
    emulator.line.plug()
    thread = threading.Thread(target=emulator.run, args=(stop.is_set,), daemon=True)
    thread.start()
    try:
        yield emulator
    finally:
        stop.set()
        thread.join(5.0)
        emulator.line.unplug()
        assert not thread.is_alive()


def serial_rig(address: str, form: str = "cobs", output: bool = True, **serial: Any) -> DeviceRig:
    """Return a bridge, not yet open."""
    bridge = {"stale_s": PATIENCE_S} | serial.pop("bridge", {})
    section = {"port": address, "format": form, **serial}
    return build_device(rig_config(rig="serial", serial=section, bridge=bridge), output)


def wait_until(true: Callable[[], object], timeout_s: float = 5.0) -> bool:
    until = time.monotonic() + timeout_s
    while time.monotonic() < until:
        if true():
            return True
        time.sleep(0.005)
    return False


def fly(rig: DeviceRig, seconds: float, volts: tuple[float, float] = (1.0, 1.0)) -> str | None:
    """Read and write a hundred times a second; return the first fault."""
    until = time.monotonic() + seconds
    tick = 0
    while time.monotonic() < until:
        fault = rig.read(tick).fault
        if fault is not None:
            return fault
        rig.write(tick, volts)
        tick += 1
        time.sleep(0.01)
    return None
