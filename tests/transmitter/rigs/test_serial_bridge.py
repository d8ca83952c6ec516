"""The serial bridge against an emulated device on a pseudo-terminal: the real line, the real bytes."""

from __future__ import annotations

import contextlib
import socket
import threading
from pathlib import Path
from typing import Any

import pytest
import serial
import serial.rfc2217

from tests.transmitter.rigs.emulated import emulated, fly, serial_rig, wait_until
from transmitter.rigs.base import RigError
from transmitter.rigs.emulator.device import RigEmulator

OFF = [0.0, 0.0]


def is_off(emulator: RigEmulator) -> bool:
    figures = emulator.figures()
    return figures["volts"] == OFF and not figures["enabled"]


@pytest.mark.parametrize(
    ("emulator_options", "serial"),
    [
        ({"form": "cobs"}, {}),
        ({"form": "ascii"}, {}),
        ({"form": "ascii", "line_form": "plain"}, {}),
        (
            {"form": "ascii", "line_form": "counts", "polled": True},
            {"poll": "e\r", "columns": ["travel", "pitch", "elevation"]},
        ),
    ],
)
def test_every_format_carries_counts_up_and_volts_down(
    emulator_options: dict[str, Any], serial: dict[str, Any]
) -> None:
    form = emulator_options["form"]
    with (
        emulated(**emulator_options) as emulator,
        serial_rig(emulator.line.address, form, **serial) as rig,
    ):
        assert is_off(emulator), "nothing is enabled before the first write"
        assert fly(rig, 0.5, (4.0, -4.0)) is None
        assert emulator.device.enabled
        assert emulator.device.volts == (4.0, -4.0)
        assert rig.read(0).counts[0] > 50
        rig.safe_stop()
        assert wait_until(lambda: is_off(emulator))


def test_closing_leaves_the_outputs_off() -> None:
    with emulated("cobs") as emulator:
        rig = serial_rig(emulator.line.address)
        with contextlib.suppress(ZeroDivisionError), rig:
            fly(rig, 0.1)
            raise ZeroDivisionError
        assert wait_until(lambda: is_off(emulator), 0.5)
        assert emulator.device.counts["watchdog_trips"] == 0, "it was told, it need not notice"


def test_480_samples_a_second_arrive_without_a_loss() -> None:
    with emulated("cobs") as emulator, serial_rig(emulator.line.address) as rig:
        before = emulator.device.counts["samples"], rig.timeline.counts["samples"]
        assert fly(rig, 3.0) is None
        sent = emulator.device.counts["samples"] - before[0]
        got = rig.timeline.counts["samples"] - before[1]
        assert sent > 1000
        assert abs(sent - got) < 20, "but for those that are on their way"
        figures = rig.figures()
        assert figures.get("lost", 0) == 0
        assert figures.get("bad_frames", 0) == 0
        assert figures["samples_skipped"] > 500, "the newest wins, the others are counted"


def test_without_output_not_one_byte_is_sent() -> None:
    with emulated("cobs") as emulator:
        with serial_rig(emulator.line.address, output=False) as rig:
            assert fly(rig, 0.3) is None
        assert emulator.device.counts["commands"] == 0


def test_bytes_that_are_lost_cost_samples_and_nothing_else() -> None:
    with (
        emulated("cobs", faults=("drop=0.005",), watchdog_s=3.0) as emulator,
        serial_rig(emulator.line.address) as rig,
    ):
        assert fly(rig, 2.0) is None
        figures = rig.figures()
        assert figures["lost"] > 10
        assert figures["bad_frames"] > 10
        assert emulator.device.counts["watchdog_trips"] == 0


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        ("jump=400@0.3", "pitch encoder jumped by 400"),
        ("reset@0.3", "began anew"),
        ("estop@0.3", "emergency stop"),
    ],
)
def test_a_hard_fault_turns_the_outputs_off_at_once_for_good(fault: str, text: str) -> None:
    with emulated("cobs", faults=(fault,)) as emulator, serial_rig(emulator.line.address) as rig:
        assert text in str(fly(rig, 3.0))
        rig.write(0, (3.0, 3.0))
        assert wait_until(lambda: is_off(emulator), 0.5)
        assert emulator.device.counts["watchdog_trips"] == 0


def test_silence_is_reported_and_is_no_hard_fault() -> None:
    with (
        emulated("cobs", faults=("mute@0.3",)) as emulator,
        serial_rig(emulator.line.address) as rig,
    ):
        assert "no sample from the rig" in str(fly(rig, 3.0))
        assert rig.hard_fault is None, "the guard may take the volts down along its ramp"
        rig.write(0, (0.5, 0.5))
        assert wait_until(lambda: emulator.device.volts == (0.5, 0.5))


def test_a_device_that_hears_nothing_trips_its_watchdog_and_says_so() -> None:
    with emulated("cobs") as emulator, serial_rig(emulator.line.address) as rig:
        assert fly(rig, 0.2) is None
        assert wait_until(lambda: emulator.device.counts["watchdog_trips"])
        assert "watchdog" in str(fly(rig, 1.0))
    with emulated("cobs") as emulator:
        rig = serial_rig(emulator.line.address)
        with rig:
            fly(rig, 0.1)
            assert wait_until(lambda: emulator.device.counts["watchdog_trips"])
        with serial_rig(emulator.line.address) as again:
            assert fly(again, 0.2) is None, "opening it anew clears the latch"


def test_unplugging_is_reported_and_plugging_in_again_is_noticed(tmp_path: Path) -> None:
    link = str(tmp_path / "rig")
    with (
        emulated("cobs", f"pty:{link}", faults=("unplug@0.3..1.0",)) as emulator,
        serial_rig(link) as rig,
    ):
        assert "is gone" in str(fly(rig, 3.0)), "while it flies"
        rig.safe_stop()
        assert wait_until(lambda: rig.read(0).fault is None, 5.0), "back again"
        assert rig.figures()["reconnects"] == 1
        assert is_off(emulator)


def test_serial_over_tcp_is_a_port_like_any_other() -> None:
    with (
        emulated("cobs", "tcp:127.0.0.1:0") as emulator,
        serial_rig("socket://" + emulator.line.address) as rig,
    ):
        assert fly(rig, 0.3, (1.0, 2.0)) is None
        assert emulator.device.volts == (1.0, 2.0)


class PtyPort(serial.Serial):  # type: ignore[misc]
    """A pseudo-terminal has no modem lines, and the server half asks for them."""

    cts = dsr = ri = cd = property(lambda self: False)

    def _update_dtr_state(self) -> None: ...

    def _update_rts_state(self) -> None: ...


class SerialServer:
    """A port offered over RFC 2217, with pyserial's own server half."""

    def __init__(self, device: str) -> None:
        self._device = device
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)

    def __enter__(self) -> SerialServer:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join(5.0)
        self._listener.close()

    def write(self, data: bytes) -> None:
        self._peer.sendall(data)

    def _serve(self) -> None:
        self._peer, _ = self._listener.accept()
        with (
            PtyPort(self._device, timeout=0.01) as port,
            self._peer as peer,
            contextlib.suppress(OSError),
        ):
            manager = serial.rfc2217.PortManager(port, self)
            peer.settimeout(0.002)
            while not self._stop.is_set():
                with contextlib.suppress(TimeoutError):
                    data = peer.recv(4096)
                    if not data:
                        return
                    port.write(b"".join(manager.filter(data)))
                data = port.read(port.in_waiting)
                peer.sendall(b"".join(manager.escape(data)))


def test_a_serial_server_is_a_port_like_any_other() -> None:
    with (
        emulated("cobs") as emulator,
        SerialServer(emulator.line.address) as server,
        serial_rig("rfc2217://" + server.address) as rig,
    ):
        assert fly(rig, 0.3, (1.0, 2.0)) is None
        assert emulator.device.volts == (1.0, 2.0)


def test_a_port_is_open_for_one_program_only() -> None:
    with emulated("cobs") as emulator:
        first, second = (serial_rig(emulator.line.address) for _ in range(2))
        with first, pytest.raises(RigError, match="another program"):
            second.open()


def test_a_port_that_is_not_there_says_what_to_do() -> None:
    with pytest.raises(RigError, match="tenbaud doctor"):
        serial_rig("/dev/ttyNOTHING").open()


def test_the_wrong_format_is_reported_with_what_came() -> None:
    with emulated("ascii") as emulator:
        rig = serial_rig(emulator.line.address, "cobs", bridge={"first_sample_timeout_s": 0.5})
        with pytest.raises(RigError, match="no valid sample"):
            rig.open()
        assert emulator.device.counts["commands"] == 0


def test_fewer_channels_than_axes_are_reported() -> None:
    bridge = {"first_sample_timeout_s": 2.0, "elevation": {"channel": 3}}
    with emulated("cobs") as emulator:
        with pytest.raises(RigError, match=r"bridge\.axes"):
            serial_rig(emulator.line.address, bridge=bridge).open()
        assert emulator.device.counts["commands"] == 0 or is_off(emulator)


def test_an_open_emergency_stop_refuses_to_open(tmp_path: Path) -> None:
    with emulated("cobs", faults=("estop@0.1",)) as emulator:
        with serial_rig(emulator.line.address) as rig:
            assert fly(rig, 1.0) is not None
        with pytest.raises(RigError, match="emergency stop"):
            serial_rig(emulator.line.address).open()


def test_an_adapter_without_outputs_needs_a_second_port_for_the_motors() -> None:
    with emulated("qsb") as encoder, emulated("ascii") as motors:
        with pytest.raises(RigError, match="motor_port"):
            serial_rig(encoder.line.address, "qsb")
        with serial_rig(encoder.line.address, "qsb", output=False) as looked_at:
            assert looked_at.read(0).counts == (0,)
            assert looked_at.figures()["samples"]
        with serial_rig(encoder.line.address, "qsb", motor_port=motors.line.address) as rig:
            assert fly(rig, 0.3, (2.0, 1.0)) is None
            assert motors.device.volts == (2.0, 1.0)
        assert wait_until(lambda: is_off(motors))


def test_a_reading_notes_all_channels_and_its_age() -> None:
    with emulated("cobs") as emulator, serial_rig(emulator.line.address) as rig:
        assert wait_until(lambda: (note := rig.read(0).device) is not None and note.device_s)
        note = rig.read(0).device
        assert note is not None
        assert len(note.counts) == 3
        assert note.age_ms >= 0.0
