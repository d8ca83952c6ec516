"""A serial line as a kind of link: its capacity, its transmission times, and how an end opens it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from channel.codec.codec import Codec
from channel.links.base import Link
from channel.links.kind import LinkEnd, LinkKind, LinkSettings, Meeting
from channel.links.serial.budget import byte_ns, check_down, check_slot_counter, check_up, command_bytes
from channel.links.serial.wire import SerialWire
from channel.links.zenoh.kind import ZenohKind
from channel.protocol.terms import Terms

ZENOH = "zenoh"
"""`link.downlink` that sends the commands back over Zenoh."""


class SerialKind(LinkKind):
    """A line with a port at either end; the downlink may go another way."""

    changes_terms = True
    carries_slots = False

    def uses_addresses(self, settings: LinkSettings) -> bool:
        """Return whether the downlink goes over Zenoh."""
        return settings.downlink == ZENOH

    def where(self, settings: LinkSettings) -> tuple[str, ...]:
        return tuple(filter(None, (settings.port, settings.downlink)))

    def check(self, settings: LinkSettings, insecure: bool) -> None:
        """Refuse a port that is not there, or on another machine without `insecure`."""
        from channel.links.serial.port import check_port

        check_port(settings.port, insecure)
        if settings.downlink not in ("", ZENOH):
            check_port(settings.downlink, insecure)

    def terms(self, settings: LinkSettings, codec: Codec, terms: Terms) -> Terms:
        """Return the terms with the times that bytes take on the line.

        Raises ValueError, with the arithmetic, for a line that cannot carry both directions and for a
        coder whose symbols do not fit a byte.
        """
        check_slot_counter(terms, _wire(codec))
        check_up(terms, settings.line_rate_baud)
        terms = replace(terms, uplink_line_ns=byte_ns(1, settings.line_rate_baud))
        if settings.downlink == ZENOH:
            return terms
        rate = settings.downlink_rate_baud if settings.downlink else settings.line_rate_baud
        check_down(terms, codec, rate)
        down_ns = byte_ns(command_bytes(terms, codec), rate)
        return replace(terms, downlink_line_ns=down_ns, downlink_byte_ns=byte_ns(1, rate))

    def open(self, end: LinkEnd) -> Link:
        """Return the open link of one end, the downlink on a separate line if so configured."""
        from channel.links.serial.link import SerialLink
        from channel.links.serial.split import SplitLink

        settings = end.settings
        wire = _wire(end.codec)
        terms = end.terms
        grids = (terms.up_grid, terms.down_grid) if terms.is_narrow else (terms.up_grid,)
        slot_s = min(grid.length_ns for grid in grids) / 1e9

        def on_port(port: str, rate_baud: int) -> SerialLink:
            return SerialLink(
                end.role,
                port,
                wire,
                line_rate_baud=rate_baud,
                symbol_age_max_s=slot_s * wire.slot_modulus / 2,
                insecure=end.place.get("insecure", False),
                is_narrow=terms.is_narrow,
            )

        up = on_port(settings.port, settings.line_rate_baud)
        if not settings.downlink:
            return up
        try:
            if settings.downlink == ZENOH:
                down = ZenohKind().open(end)
            else:
                down = on_port(settings.downlink, settings.downlink_rate_baud)
        except BaseException:
            up.close()
            raise
        return SplitLink(end.role, up, down)

    @contextmanager
    def meeting(self, settings: LinkSettings) -> Iterator[tuple[Meeting, Meeting]]:
        """Join two processes by emulated lines of the configured rates."""
        with ExitStack() as stack:
            near, far = _emulated(stack, "port", settings.line_rate_baud)
            if settings.downlink == ZENOH:
                up, down = stack.enter_context(ZenohKind().meeting(settings))
                yield replace(up, settings=near), replace(down, settings=far)
                return
            if settings.downlink:
                second = _emulated(stack, "downlink", settings.downlink_rate_baud)
                near, far = near | second[0], far | second[1]
            yield Meeting(near), Meeting(far)


def _wire(codec: Codec) -> SerialWire:
    return SerialWire(len(codec.coder.alphabet.symbols))


def _emulated(stack: ExitStack, field: str, rate_baud: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the settings of either end for a new emulated line, which lasts as long as the stack."""
    from channel.links.serial.emulated import EmulatedLine

    folder = Path(stack.enter_context(TemporaryDirectory(prefix="tenbaud-line-")))
    line = stack.enter_context(EmulatedLine(folder, rate_baud))
    return {field: str(line.transmitter_port)}, {field: str(line.receiver_port)}
