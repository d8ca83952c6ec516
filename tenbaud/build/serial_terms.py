"""What a configured serial line means for the terms of a flight: refusals, and times on the line."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from channel.codec.codec import Codec
from channel.links.serial.budget import check_slot_counter, serial_budget
from channel.links.serial.wire import SerialWire
from channel.protocol.terms import Terms
from tenbaud.config.schema import LinkSection

if TYPE_CHECKING:
    pass

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
