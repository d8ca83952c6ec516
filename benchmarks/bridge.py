"""How long a sensor frame takes to become a command frame, through every real part.

A device on a pseudo-terminal sends a SAMPLE; the bridge reads it, the transmitter's session makes a
symbol, Zenoh carries it to a receiver in a separate process, whose commands come back, and the
bridge writes a COMMAND. A flight waits for ticks in between; here each step follows the one before at
once, so what is measured is the machinery and not the schedule.

Run it alone: python -m benchmarks.bridge
"""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty
from pathlib import Path

from channel.links.endpoints import free_endpoint
from channel.links.zenoh.link import ZenohLink
from tenbaud.build.flight import agree
from tenbaud.build.rig import build_device
from tenbaud.config.load import dump_config, load_config
from transmitter.rigs.device import DeviceRig
from transmitter.rigs.emulator.speech import CobsSpeech
from transmitter.rigs.formats.samples import RawSample
from transmitter.session.session import Phase, TransmitterSession

PERIOD_S = 0.01
SAMPLES = 500
SETTLE_S = 20.0


class Device:
    """The far end of the pseudo-terminal: one sample out, then the wait for a command."""

    def __init__(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._speech = CobsSpeech()
        self._number = 0

    def send(self) -> None:
        self._number += 1
        counts = (0, self._number % 7, 0)
        os.write(
            self._master, self._speech.encode(RawSample(counts, self._number, self._number * 10_000))
        )

    def await_command(self, timeout_s: float) -> bool:
        until = time.monotonic() + timeout_s
        while (left_s := until - time.monotonic()) > 0:
            ready, _, _ = select.select([self._master], [], [], left_s)
            commands, _ = self._speech.feed(os.read(self._master, 4096)) if ready else ([], 0)
            if any(command.enable for command in commands):
                return True
        return False


def bridge_latency(samples: int = SAMPLES) -> dict[str, float]:
    """Return percentiles of the time from SAMPLE to COMMAND, in milliseconds."""
    device = Device()
    config = load_config(
        None,
        None,
        {
            # One tick per sample and per symbol: every sensor frame makes a symbol of its own.
            "timing": {"tick_s": PERIOD_S, "symbol_period_s": PERIOD_S, "lead_ticks": 5},
            "channel": {"rate_baud": 1 / PERIOD_S, "deadline_allowance_s": 0.04},
            "transmitter": {
                "rig": "serial",
                "serial": {"port": device.path, "format": "cobs"},
                "bridge": {"stale_s": 5.0},
            },
        },
    )
    agreement = agree(config, "real")
    session = TransmitterSession(agreement.codec, agreement.terms, agreement.identity, 1)
    rig = build_device(config, output=True)
    threading.Timer(0.2, device.send).start()
    threading.Timer(0.3, device.send).start()
    endpoint = free_endpoint()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "config.toml"
        path.write_text(dump_config(config))
        command = [sys.executable, "-m", "tenbaud", "receive", "--config", str(path)]
        command += ["--listen", endpoint, "--json", "--out", str(Path(folder) / "run")]
        receiver = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            with rig, ZenohLink("transmitter", config.link.session, connect=(endpoint,)) as link:
                _greet(session, link)
                times_ms = [_trip(device, rig, session, link, tick) for tick in range(samples)]
        finally:
            receiver.send_signal(signal.SIGINT)
            receiver.wait(10)
    times_ms.sort()
    return {
        f"bridge_latency_ms_{name}": times_ms[round(share * (samples - 1))]
        for name, share in (("p50", 0.5), ("p99", 0.99), ("max", 1.0))
    }


def _greet(session: TransmitterSession, link: ZenohLink) -> None:
    until = time.monotonic() + SETTLE_S
    while session.phase is not Phase.FLYING:
        if time.monotonic() > until:
            raise TimeoutError(f"no receiver: {session.refusal}")
        link.send(link.wire.encode(session.hello()))
        data = link.receive(0.2)
        if data is not None:
            session.on_frame(link.wire.decode(data))


def _trip(
    device: Device, rig: DeviceRig, session: TransmitterSession, link: ZenohLink, tick: int
) -> float:
    """Carry one sample all the way round; return how long it took, in milliseconds."""
    rig.wait_for_sample(0.0)
    arrived: list[float] = []
    waiter = threading.Thread(
        target=lambda: arrived.append(time.perf_counter() if device.await_command(2.0) else -1.0)
    )
    waiter.start()
    begun = time.perf_counter()
    device.send()
    if rig.wait_for_sample(2.0) is None:
        raise TimeoutError("the bridge saw no sample")
    measured = rig.read(tick).measured
    for symbol in session.on_measurement(tick, measured):
        link.send(link.wire.encode(symbol))
    while session.confirmed_state.sample <= tick:
        data = link.receive(2.0)
        if data is None:
            raise TimeoutError(f"no command for sample {tick}")
        session.on_frame(link.wire.decode(data))
    volts = session.following.take_confirmed()[-1].flown.commands[-1]
    rig.write(tick, volts)
    waiter.join()
    if not arrived or arrived[0] < 0.0:
        raise TimeoutError("the device saw no command")
    # The next slot may not begin before its time.
    time.sleep(max(0.0, PERIOD_S - (time.perf_counter() - begun)))
    return (arrived[0] - begun) * 1e3


if __name__ == "__main__":
    print(json.dumps(bridge_latency(), indent=2))
