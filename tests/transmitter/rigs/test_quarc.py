"""The QUARC bridge against plain sockets and against the emulator."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from tenbaud.build.rig import build_device
from tests.transmitter.rigs.emulated import PATIENCE_S, emulated, fly, rig_config, wait_until
from transmitter.rigs.base import RigError
from transmitter.rigs.device import DeviceRig

FIELDS = ["seq", "travel", "pitch", "elevation"]


def quarc_rig(port: int, output: bool = True, **quarc: Any) -> DeviceRig:
    bridge = {"stale_s": PATIENCE_S, "first_sample_timeout_s": 2.0}
    section = {"port": port, **quarc}
    return build_device(rig_config(rig="quarc", quarc=section, bridge=bridge), output)


def unit(number: float, pitch: float) -> bytes:
    return struct.pack("<4d", number, 0.0, pitch, 0.0)


class Model:
    """A model's server block, moved by hand."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self.listener.getsockname()[1]
        self.peer: socket.socket | None = None

    def accept(self) -> None:
        self.listener.settimeout(5.0)
        self.peer, _ = self.listener.accept()
        self.peer.settimeout(5.0)

    def send(self, data: bytes) -> None:
        assert self.peer is not None
        self.peer.sendall(data)

    def commands(self) -> list[tuple[float, ...]]:
        assert self.peer is not None
        time.sleep(0.1)
        data = self.peer.recv(4096)
        assert len(data) % 16 == 0
        return list(struct.iter_unpack("<2d", data))

    def close(self) -> None:
        self.listener.close()
        if self.peer is not None:
            self.peer.close()


@pytest.fixture
def model() -> Iterator[Model]:
    model = Model()
    yield model
    model.close()


def opened(model: Model, **quarc: Any) -> DeviceRig:
    """Return a bridge that has taken its first unit."""
    rig = quarc_rig(model.port, fields=FIELDS, **quarc)

    def serve() -> None:
        model.accept()
        model.send(unit(1, 0))

    thread = threading.Thread(target=serve)
    thread.start()
    rig.open()
    thread.join()
    return rig


def test_units_are_put_together_from_any_pieces(model: Model) -> None:
    rig = opened(model)
    stream = b"".join(unit(number, 10 * number) for number in range(2, 7))
    for start in range(0, len(stream), 13):
        model.send(stream[start : start + 13])
        time.sleep(0.005)
    assert wait_until(lambda: rig.timeline.counts["samples"] == 6)
    assert rig.read(0).counts == (60,)
    assert rig.figures()["lost"] == 0
    rig.close()


def test_of_many_units_at_once_the_newest_counts(model: Model) -> None:
    rig = opened(model)
    rig.read(0)
    model.send(b"".join(unit(number, number) for number in range(2, 52)))
    assert wait_until(lambda: rig.timeline.counts["samples"] == 51)
    assert rig.read(0).counts == (51,)
    assert rig.figures()["samples_skipped"] == 49
    rig.close()


def test_a_gap_in_the_sequence_is_counted(model: Model) -> None:
    rig = opened(model)
    model.send(unit(2, 0) + unit(6, 0))
    assert wait_until(lambda: rig.figures().get("lost") == 3)
    rig.close()


def test_lost_alignment_makes_a_new_connection(model: Model) -> None:
    rig = opened(model)
    model.send(unit(2, 1234.0)[3:] + unit(3, 99.0) * 3)
    model.accept()
    assert rig.figures()["misaligned"] == 1
    model.send(unit(4, 77))
    assert wait_until(lambda: rig.read(0).counts == (77,)), "aligned again"
    rig.close()


def test_a_connection_that_ends_within_a_unit_is_made_anew(model: Model) -> None:
    rig = opened(model)
    model.send(unit(2, 5)[:20])
    assert model.peer is not None
    model.peer.close()
    model.accept()
    model.send(unit(3, 6))
    assert wait_until(lambda: rig.read(0).counts == (6,))
    assert rig.figures()["connections"] == 2
    rig.close()


def test_volts_go_out_as_raw_doubles_and_zeros_at_the_end(model: Model) -> None:
    rig = opened(model)
    assert model.commands() == [(0.0, 0.0)], "off, before anything else"
    rig.write(0, (1.5, -0.25))
    assert model.commands() == [(1.5, -0.25)]
    rig.close()
    assert set(model.commands()) == {(0.0, 0.0)}


def test_dac_volts_and_an_enable_element(model: Model) -> None:
    rig = build_device(
        rig_config(
            rig="quarc",
            quarc={
                "port": model.port,
                "fields": ["pitch"],
                "command_fields": ["rear", "front", "enable", "seq"],
                "byte_order": "big",
            },
            bridge={"axes": ["pitch"], "motors": {"unit": "dac_volts", "amplifier_gain": 3.0}},
        ),
        output=True,
    )

    def serve() -> None:
        model.accept()
        model.send(struct.pack(">d", 0.0))

    thread = threading.Thread(target=serve)
    thread.start()
    rig.open()
    thread.join()
    assert model.peer is not None
    rig.write(0, (3.0, -1.5))
    time.sleep(0.1)
    sent = list(struct.iter_unpack(">4d", model.peer.recv(4096)))
    assert sent[0][:3] == (0.0, 0.0, 0.0)
    assert sent[-1] == (-0.5, 1.0, 1.0, float(len(sent)))
    rig.close()


def test_the_wrong_byte_order_is_named(model: Model) -> None:
    rig = quarc_rig(model.port, fields=FIELDS)

    def serve() -> None:
        model.accept()
        model.send(struct.pack(">4d", 1.0, 2.0, 3.0, 4.0))

    thread = threading.Thread(target=serve)
    thread.start()
    with pytest.raises(RigError, match="byte order 'little'"):
        rig.open()
    thread.join()


def test_nobody_there_says_what_to_start() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        taken.close()
        with pytest.raises(RigError, match="Stream server block"):
            quarc_rig(port).open()


def test_no_delay_is_set(model: Model) -> None:
    rig = opened(model)
    assert rig._peer.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)  # type: ignore[attr-defined]
    rig.close()


@pytest.mark.parametrize("role", ["client", "server"])
def test_both_roles_fly_with_the_emulator(role: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    line = f"tcp:127.0.0.1:{port}" if role == "client" else f"tcp-connect:127.0.0.1:{port}"
    with emulated("quarc", line) as emulator:
        with quarc_rig(port, role=role) as rig:
            assert fly(rig, 0.5, (3.0, -3.0)) is None
            assert emulator.device.volts == (3.0, -3.0)
            assert rig.read(0).counts[0] > 30
        assert wait_until(lambda: emulator.device.volts == (0.0, 0.0))


def test_a_latched_watchdog_in_the_flags_ends_the_flight() -> None:
    vectors = {"fields": ["flags", "pitch"], "command_fields": ["front", "rear", "enable"]}
    config = rig_config(rig="quarc", quarc=vectors)
    with emulated("quarc", "tcp:127.0.0.1:0", config) as emulator:
        port = int(emulator.line.address.rpartition(":")[2])
        with quarc_rig(port, **vectors) as rig:
            assert fly(rig, 0.3, (3.0, -3.0)) is None
            assert wait_until(lambda: emulator.device.counts["watchdog_trips"])
            assert "watchdog" in str(fly(rig, 1.0))
            assert wait_until(lambda: emulator.device.volts == (0.0, 0.0))


def test_unplugging_and_plugging_in_again() -> None:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    line = f"tcp:127.0.0.1:{port}"
    with emulated("quarc", line, faults=("unplug@0.3..1.0",)) as emulator, quarc_rig(port) as rig:
        assert fly(rig, 3.0) is not None
        rig.safe_stop()
        assert wait_until(lambda: rig.read(0).fault is None)
        assert emulator.device.volts == (0.0, 0.0)
