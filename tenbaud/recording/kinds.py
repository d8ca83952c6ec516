"""Every topic of each end: the channel that the node writes it through, and what may be null in it."""

from __future__ import annotations

from collections import namedtuple
from typing import Any, NamedTuple

from channel.protocol.events import EVENT_CHANNEL
from channel.protocol.lockstep import LOCKSTEP_CHANNEL
from channel.protocol.recording import (
    ARRIVED_CHANNEL,
    DOWN_SENT_CHANNEL,
    DOWN_SYMBOLS_CHANNEL,
    EPOCH_CHANNEL,
    SENT_CHANNEL,
    TWO_WAY_CHANNEL,
    RecordChannel,
)
from receiver.session import records as receiver
from transmitter.metrics.gap import GAP_CHANNEL
from transmitter.session import records as transmitter


class Kind(NamedTuple):
    """A topic of an end: the channel that the node writes it through, and what may be null in it."""

    channel: RecordChannel
    nullable: frozenset[str]
    record: type[Any]
    """a named tuple with the channel's fields"""


def _kind(channel: RecordChannel, *nullable: str) -> Kind:
    names = [one.name for one in channel.fields]
    return Kind(channel, frozenset(nullable), namedtuple("Record", names))


_EPOCH = _kind(EPOCH_CHANNEL)
_TWO_WAY = _kind(TWO_WAY_CHANNEL)
_EVENT = _kind(EVENT_CHANNEL, *(one.name for one in EVENT_CHANNEL.fields[2:]))
_LOCKSTEP = _kind(LOCKSTEP_CHANNEL, "state", "coder", "peer_state", "peer_coder")

KINDS: dict[str, dict[str, Kind]] = {
    "transmitter": {
        "symbol": _kind(SENT_CHANNEL, "left_ns"),
        "epoch": _EPOCH,
        "two_way": _TWO_WAY,
        "event": _EVENT,
        "lockstep_failure": _LOCKSTEP,
        "tick": _kind(transmitter.TICK_CHANNEL, "true", "commanded"),
        "sample": _kind(transmitter.SAMPLE_CHANNEL, "word_sent", "word", "about"),
        "estimate": _kind(transmitter.ESTIMATE_CHANNEL, "live_state"),
        "down_symbols": _kind(DOWN_SYMBOLS_CHANNEL),
        "confirmed": _kind(transmitter.CONFIRMED_CHANNEL, "word"),
        "hypotheses": _kind(transmitter.HYPOTHESES_CHANNEL),
        "assumed": _kind(transmitter.ASSUMED_CHANNEL, "word", "symbols"),
        "gap": _kind(GAP_CHANNEL, *(one.name for one in GAP_CHANNEL.fields[1:])),
        "device": _kind(transmitter.DEVICE_CHANNEL, "device_s"),
    },
    "receiver": {
        "symbol": _kind(ARRIVED_CHANNEL),
        "epoch": _EPOCH,
        "two_way": _TWO_WAY,
        "event": _EVENT,
        "lockstep_failure": _LOCKSTEP,
        "tick": _kind(receiver.TICK_CHANNEL),
        "sample": _kind(receiver.SAMPLE_CHANNEL, "word"),
        "down_symbols": _kind(DOWN_SYMBOLS_CHANNEL),
        "down_symbol": _kind(DOWN_SENT_CHANNEL, "left_ns"),
    },
}
"""Every topic of each end. What is written elsewhere in a recording is no part of an audit."""
