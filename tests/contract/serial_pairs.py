"""Pairs of links whose line, or one direction of it, is serial."""

from __future__ import annotations

import tempfile
from contextlib import ExitStack
from pathlib import Path

from channel.links.base import Link, Role
from channel.links.serial.emulated import EmulatedLine
from channel.links.serial.link import SerialLink
from channel.links.serial.split import SplitLink
from channel.links.serial.wire import SerialWire
from tests.channel.links.memory_pair import memory_pair

FAST_BAUD = 4_000_000
"""The links believe in such a line; the emulated one passes bytes on as fast as it goes."""


def make_serial(stack: ExitStack) -> tuple[Link, Link]:
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
    line = stack.enter_context(EmulatedLine(folder, None))
    wire = SerialWire(2)
    ports: tuple[tuple[Role, Path], ...] = (
        ("transmitter", line.transmitter_port),
        ("receiver", line.receiver_port),
    )
    transmitter, receiver = (
        stack.enter_context(SerialLink(role, str(port), wire, line_rate_baud=FAST_BAUD, is_narrow=True))
        for role, port in ports
    )
    return transmitter, receiver


def make_split(stack: ExitStack) -> tuple[Link, Link]:
    """Serial up, memory down."""
    up = make_serial(stack)
    down = memory_pair()
    return (
        stack.enter_context(SplitLink("transmitter", up[0], down[0])),
        stack.enter_context(SplitLink("receiver", up[1], down[1])),
    )
