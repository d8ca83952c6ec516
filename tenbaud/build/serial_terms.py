"""What a configured serial line means for a flight: refusals, times on the line, the links."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from channel.codec.codec import Codec
from channel.links.base import Link, Role
from channel.links.serial.budget import check_slot_counter, serial_budget
from channel.links.serial.wire import SerialWire
from channel.protocol.terms import Terms
from tenbaud.config.schema import LinkSection

if TYPE_CHECKING:
    from tenbaud.build.flight import Agreement

ZENOH = "zenoh"


def on_serial_line(link: LinkSection, codec: Codec, terms: Terms) -> Terms:
    """Return the terms with the times that bytes take on the line.

    Raises ValueError, with the arithmetic, for a line that cannot carry both directions and for a
    coder whose symbols do not fit a byte.
    """
    wire = SerialWire(len(codec.coder.alphabet.symbols))
    check_slot_counter(terms, wire)
    budget = serial_budget(terms, codec.model.input_size)
    budget.check_up(link.line_rate_baud)
    if link.downlink == ZENOH:
        down_ns = 0
    else:
        rate = link.downlink_rate_baud if link.downlink else link.line_rate_baud
        budget.check_down(rate)
        down_ns = budget.command_ns(rate)
    return replace(
        terms, uplink_line_ns=budget.symbol_ns(link.line_rate_baud), downlink_line_ns=down_ns
    )


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
