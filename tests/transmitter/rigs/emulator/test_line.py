from __future__ import annotations

import os
import socket
import tty
from pathlib import Path

import pytest

from transmitter.rigs.base import RigError
from transmitter.rigs.emulator.line import DeviceLine, parse_line


def read_all(line: DeviceLine, count: int) -> bytes:
    data = b""
    for _ in range(100):
        line.wait(0.05)
        data += line.read()
        if len(data) >= count:
            break
    return data


def test_a_pseudo_terminal_keeps_its_name_over_a_plug_and_unplug(tmp_path: Path) -> None:
    link = tmp_path / "rig"
    line = parse_line(f"pty:{link}", 115_200)
    for _ in range(2):
        line.plug()
        handle = os.open(link, os.O_RDWR | os.O_NOCTTY)
        os.write(handle, b"\x00\x11\x13\x03up")
        assert read_all(line, 6) == b"\x00\x11\x13\x03up", "no byte means anything to the line"
        assert line.write(b"\x00down")
        assert os.read(handle, 10) == b"\x00down"
        os.close(handle)
        line.unplug()
        assert not link.exists()
        assert not line.write(b"x")
        assert line.read() == b""


def test_a_line_that_nobody_reads_loses_bytes_and_never_waits() -> None:
    line = parse_line("pty", 115_200)
    line.plug()
    assert not all(line.write(bytes(range(256))) for _ in range(1000))
    line.unplug()


def test_a_real_port_is_opened_as_one() -> None:
    master, slave = os.openpty()
    tty.setraw(slave)
    line = parse_line(os.ttyname(slave), 115_200)
    line.plug()
    os.write(master, b"up")
    assert read_all(line, 2) == b"up"
    assert line.write(b"down")
    assert os.read(master, 10) == b"down"
    line.unplug()
    os.close(master)
    os.close(slave)


def test_tcp_takes_one_peer_after_the_other() -> None:
    line = parse_line("tcp:127.0.0.1:0", 0)
    line.plug()
    host, _, port = line.address.rpartition(":")
    for word in (b"one", b"two"):
        with socket.create_connection((host, int(port)), 5.0) as peer:
            peer.sendall(word)
            assert read_all(line, 3) == word
            assert line.write(b"down")
            assert peer.recv(10) == b"down"
        line.wait(1.0)
        assert line.read() == b"", "the peer has gone"
    line.unplug()


def test_a_port_that_is_taken_is_a_clear_error() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        line = parse_line(f"tcp:127.0.0.1:{taken.getsockname()[1]}", 0)
        with pytest.raises(RigError, match="listened on"):
            line.plug()


@pytest.mark.parametrize("text", ["", "tcp:18000", "tcp:host:http"])
def test_an_unknown_port_names_the_known_ones(text: str) -> None:
    with pytest.raises(ValueError, match="tcp:HOST:PORT"):
        parse_line(text, 0)
