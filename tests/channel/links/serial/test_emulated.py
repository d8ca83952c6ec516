"""The emulated line keeps to its rate, damages bytes as configured, and comes back after unplugging."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from channel.links.serial.emulated import EmulatedLine, Way
from tests.channel.links.serial.noisy_line import NoisyLine
from tests.contract.test_links import PATIENCE_S, until


@contextmanager
def opened(*ports: Path) -> Iterator[list[int]]:
    numbers = [os.open(port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK) for port in ports]
    try:
        yield numbers
    finally:
        for number in numbers:
            os.close(number)


def read(number: int, count: int) -> bytes:
    data = b""
    give_up = time.monotonic() + PATIENCE_S
    while len(data) < count and time.monotonic() < give_up:
        try:
            data += os.read(number, count - len(data))
        except BlockingIOError:
            time.sleep(0.001)
    return data


@pytest.mark.parametrize("way", ["up", "down"])
def test_when_bytes_are_sent_then_they_arrive_no_faster_than_the_rate(way: Way, tmp_path: Path) -> None:
    data = bytes(range(1, 101))
    with (
        EmulatedLine(tmp_path, 4800) as line,
        opened(line.transmitter_port, line.receiver_port) as (near, far),
    ):
        source, target = (near, far) if way == "up" else (far, near)
        started = time.monotonic()
        os.write(source, data)
        assert read(target, len(data)) == data
        took_s = time.monotonic() - started
        # A hundred bytes of ten bits at 4800 bit/s: a real line cannot be quicker. Slower is the
        # machine's task.
        assert took_s >= 100 * 10 / 4800
        assert line.carried(way) == 100
        assert line.carried("down" if way == "up" else "up") == 0


def test_when_a_share_is_damaged_then_the_same_bytes_are_with_the_same_seed(tmp_path: Path) -> None:
    arrived = []
    for _ in range(2):
        with (
            NoisyLine(tmp_path, None, seed=4) as line,
            opened(line.transmitter_port, line.receiver_port) as (near, far),
        ):
            line.corrupt("up", 0.1)
            os.write(near, bytes(1000))
            arrived.append(read(far, 1000))
            assert line.damaged["up"] == sum(byte != 0 for byte in arrived[-1])
    assert arrived[0] == arrived[1]
    assert 60 < sum(byte != 0 for byte in arrived[0]) < 140


def test_when_bytes_are_injected_then_they_arrive(tmp_path: Path) -> None:
    with (
        NoisyLine(tmp_path, None) as line,
        opened(line.transmitter_port, line.receiver_port) as (_, far),
    ):
        line.inject("up", b"noise")
        assert read(far, 5) == b"noise"


def test_when_it_is_unplugged_then_the_ports_fail_and_plugged_in_again_they_are_back(
    tmp_path: Path,
) -> None:
    with EmulatedLine(tmp_path, None) as line:
        with opened(line.transmitter_port, line.receiver_port) as (near, _):
            line.unplug()
            assert not line.transmitter_port.exists()

            def gone() -> bool:
                try:
                    return os.read(near, 1) == b""
                except BlockingIOError:
                    return False
                except OSError:
                    return True

            assert until(gone)
        line.plug()
        with opened(line.transmitter_port, line.receiver_port) as (near, far):
            os.write(far, b"back")
            assert read(near, 4) == b"back"
    assert not line.transmitter_port.is_symlink()


def test_when_nobody_reads_then_the_line_goes_on(tmp_path: Path) -> None:
    with (
        EmulatedLine(tmp_path, None) as line,
        opened(line.transmitter_port) as (near,),
    ):
        written = 0
        give_up = time.monotonic() + PATIENCE_S
        while written < 60_000 and time.monotonic() < give_up:
            try:
                written += os.write(near, bytes(1000))
            except BlockingIOError:
                time.sleep(0.005)
        assert written >= 60_000
