"""Opening a serial port, through pyserial's `serial_for_url`, with errors for a person."""

from __future__ import annotations

import contextlib
import os
from urllib.parse import urlsplit

import serial

from channel.errors import LinkError
from channel.links.endpoints import is_loopback

READ_TIMEOUT_S = 0.1
WRITE_TIMEOUT_S = 1.0


def check_port(url: str, insecure: bool) -> None:
    """Refuse a port that is on another machine, unless it is allowed."""
    if not url:
        raise LinkError("a serial link needs a port, such as --port /dev/ttyUSB0 or --port COM3")
    parts = urlsplit(url)
    if parts.scheme not in ("socket", "rfc2217") or insecure:
        return
    if not is_loopback(f"tcp/{parts.netloc}"):
        raise LinkError(
            f"{url} is on another machine, and the line would be open to anyone who reaches it: no "
            "encryption, no check of who commands the motors. On a network that you trust with that, "
            "add --insecure"
        )


def open_port(url: str, line_rate_baud: int) -> serial.SerialBase:
    """Return the open port, 8N1 and for us alone where the system can do that; LinkError if not."""
    port: serial.SerialBase | None = None
    try:
        port = serial.serial_for_url(url, do_not_open=True)
        port.baudrate = line_rate_baud
        port.timeout = READ_TIMEOUT_S
        port.write_timeout = WRITE_TIMEOUT_S
        port.exclusive = True
        port.open()
    except (serial.SerialException, OSError, ValueError) as error:
        raise LinkError(f"cannot open the serial port {url}: {_explained(error)}") from error
    # Many USB adapters collect bytes for 16 ms by default. Not every port has this setting.
    with contextlib.suppress(Exception):
        port.set_low_latency_mode(True)
    return port


def reason_of(error: Exception) -> str:
    """Return why a port went, in the system's words where there are any."""
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error) or "it is gone"


def _explained(error: Exception) -> str:
    text = str(error)
    if "ermission" in text:
        return f"{text}; on Linux the group is often dialout: sudo usermod -aG dialout $USER"
    if "exclusively lock" in text:
        return "another program is using it"
    return text
