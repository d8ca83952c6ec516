"""Ports that cannot be opened; names and errors of Windows as far as they can be tested elsewhere."""

from __future__ import annotations

import errno
import os
import socket
from types import SimpleNamespace

import pytest
import serial

from channel.errors import LinkError
from channel.links.serial import port
from tenbaud.cli.rigs import settings_of

NAMES = ("COM3", "COM12", r"\\.\COM12")


@pytest.mark.parametrize("name", NAMES)
def test_a_com_port_is_a_name_for_the_link_and_for_a_rig(name: str) -> None:
    port.check_port(name, insecure=False)
    assert settings_of(f"cobs:{name}")["transmitter.serial.port"] == name


@pytest.mark.parametrize(
    ("error", "text"),
    [
        ("PermissionError(13, 'Access is denied.', None, 5)", "another program may have it open"),
        ("FileNotFoundError(2, 'The system cannot find the file', None, 2)", "`tenbaud doctor` lists"),
    ],
)
def test_an_error_of_windows_says_what_to_do(
    error: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise serial.SerialException(f"could not open port 'COM3': {error}")

    monkeypatch.setattr(port, "os", SimpleNamespace(name="nt", strerror=os.strerror))
    monkeypatch.setattr(serial, "serial_for_url", refuse)
    with pytest.raises(LinkError, match=text):
        port.open_port("COM3", 9600)


def test_a_com_port_that_is_not_there_is_refused_here_too() -> None:
    with pytest.raises(LinkError, match=f"COM99 cannot be opened: {os.strerror(errno.ENOENT)}"):
        port.open_port("COM99", 9600)


def test_a_socket_without_a_listener_says_what_to_start() -> None:
    with socket.socket() as bound:
        bound.bind(("127.0.0.1", 0))  # bound and not listening, so that the port stays refused
        with pytest.raises(LinkError, match="; start the device or program"):
            port.open_port(f"socket://127.0.0.1:{bound.getsockname()[1]}", 9600)
