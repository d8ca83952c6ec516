"""Every claim of an audit, in the order in which they are checked.

A field of a channel that a node writes is owned by a claim, or carries none for a reason:
`tests/tenbaud/audit/unclaimed.py` lists those, and a test holds that the list is complete.
"""

from __future__ import annotations

from tenbaud.audit import (
    arrived,
    downlink,
    ends,
    events,
    files,
    flights,
    keys,
    late,
    plant,
    sent,
    states,
)
from tenbaud.audit.base import Claim

CLAIMS: tuple[Claim, ...] = tuple(
    found
    for module in (files, keys, sent, arrived, ends, states, flights, downlink, plant, late, events)
    for found in vars(module).values()
    if isinstance(found, Claim)
)
