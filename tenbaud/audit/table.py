"""Every claim of an audit.

A field of a channel that a node writes is owned by a claim, or carries none for a reason:
`tests/tenbaud/audit/unclaimed.py` lists those, and a test holds that the list is complete.
"""

from __future__ import annotations

from tenbaud.audit import arrived, ends, events, files, flights, keys, plant, sent, states
from tenbaud.audit.base import Claim

CLAIMS: tuple[Claim, ...] = (
    files.HEADS,
    files.ROWS,
    files.FIGURES,
    keys.SHAPE,
    keys.ORDER,
    keys.FILED_TIME,
    sent.RECORDED,
    sent.SLOTS,
    sent.BYTES,
    sent.WORDS_SENT,
    sent.CODER_BITS,
    arrived.TAKEN,
    arrived.WORDS,
    arrived.TIMES,
    arrived.ORIGIN,
    arrived.RATE,
    ends.EPOCHS,
    ends.BEGUN,
    ends.CONFIRMED,
    ends.ACCOUNTS,
    states.SAMPLES,
    states.ESTIMATES,
    states.COMMANDS,
    states.GAUGE,
    states.STEERING,
    flights.LENGTH,
    flights.STARTS,
    flights.JITTER,
    plant.TICKS,
    plant.COMMANDED,
    plant.GUARD,
    plant.ANGLES,
    events.EVENTS,
    events.COUNTS,
    files.LOCKSTEP,
)
