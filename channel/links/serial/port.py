"""Opening a serial port, through pyserial's `serial_for_url`, with errors for a person."""

from __future__ import annotations

import contextlib
import errno
import os
from urllib.parse import urlsplit

import serial

from channel.errors import LinkError
from channel.links.endpoints import is_loopback

READ_TIMEOUT_S = 0.1
WRITE_TIMEOUT_S = 1.0


def check_port(url: str, insecure: bool) -> None:
    """Refuse a port that is not there, or on another machine unless that is allowed."""
    if not url:
        raise LinkError("a serial link needs a port, such as --port /dev/ttyUSB0 or --port COM3")
    if url.startswith("/") and not os.path.exists(url):
        raise LinkError(_cannot_open(url, FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT))))
    parts = urlsplit(url)
    if parts.scheme not in ("socket", "rfc2217") or insecure:
        return
    if not is_loopback(f"tcp/{parts.netloc}"):
        raise LinkError(
            f"{url} is on another machine, and the line would be open to anyone who reaches it: no "
            "encryption, no check of who commands the motors. On a network that you trust with that, "
            "add --insecure"
        )


def open_port(
    url: str,
    line_rate_baud: int,
    read_timeout_s: float = READ_TIMEOUT_S,
    write_timeout_s: float = WRITE_TIMEOUT_S,
) -> serial.SerialBase:
    """Return the open port, 8N1 and for us alone where the system can do that; LinkError if not."""
    port: serial.SerialBase | None = None
    try:
        port = serial.serial_for_url(url, do_not_open=True)
        port.baudrate = line_rate_baud
        port.timeout = read_timeout_s
        if not url.startswith("rfc2217://"):  # which supports neither
            port.write_timeout = write_timeout_s
            port.exclusive = True
        port.open()
    except (serial.SerialException, OSError, ValueError) as error:
        raise LinkError(_cannot_open(url, error)) from error
    # Many USB adapters collect bytes for 16 ms by default. Not every port has this setting.
    with contextlib.suppress(Exception):
        port.set_low_latency_mode(True)
    return port


def reason_of(error: Exception) -> str:
    """Return why a port went, in the system's words where there are any."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error) or "it is gone"


def _cannot_open(url: str, error: Exception) -> str:
    # pyserial puts the port's name and the system's error in twice; the error beneath has it once.
    beneath = error.__context__
    plain = beneath.strerror if isinstance(beneath, OSError) and beneath.strerror else reason_of(error)
    text = f"{url} cannot be opened: {plain}"
    if isinstance(beneath, ConnectionRefusedError):
        return f"{text}; start the device or program that listens there first"
    number = getattr(error, "errno", None)
    if os.name != "posix" and "Permission" in str(error):
        return f"{text}; another program may have it open"
    if number == 13 or "Permission" in str(error):
        return f"{text}; on Linux your user must be in the group that owns it (often dialout)"
    # pyserial gives the error of Windows as a text.
    if number == 2 or "No such file" in str(error) or "FileNotFoundError" in str(error):
        return f"{text}; `tenbaud doctor` lists the ports that are there"
    if number in (11, 16) or "lock" in str(error):
        return f"{text}; another program has it open"
    return text
