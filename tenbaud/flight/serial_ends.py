"""The link of one end over a configured serial line."""

from __future__ import annotations

from collections.abc import Callable

from channel.links.base import Link, Role
from channel.links.serial.wire import SerialWire
from tenbaud.build.flight import Agreement
from tenbaud.build.serial_terms import ZENOH


def open_serial(
    agreement: Agreement, role: Role, insecure: bool, open_zenoh: Callable[[], Link]
) -> Link:
    """Return the open link of one end, the downlink on a line of its own if so configured."""
    from channel.links.serial.link import SerialLink
    from channel.links.serial.split import SplitLink

    section, terms = agreement.config.link, agreement.terms
    wire = SerialWire(len(agreement.codec.coder.alphabet.symbols))
    slot_s = terms.sample_ns / terms.symbols_per_word / 1e9
    age_s = slot_s * wire.slot_modulus / 2

    def on_port(port: str, rate_baud: int) -> SerialLink:
        return SerialLink(
            role, port, wire, line_rate_baud=rate_baud, symbol_age_max_s=age_s, insecure=insecure
        )

    up = on_port(section.port, section.line_rate_baud)
    if not section.downlink:
        return up
    try:
        if section.downlink == ZENOH:
            down = open_zenoh()
        else:
            down = on_port(section.downlink, section.downlink_rate_baud)
    except BaseException:
        up.close()
        raise
    return SplitLink(role, up, down)
