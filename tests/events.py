"""An event as recordings and telemetry hold it."""

from __future__ import annotations

from typing import Any

from channel.protocol.events import EVENT_CHANNEL, Event, event_row


def event_fields(event: Event) -> dict[str, Any]:
    names = [field.name for field in EVENT_CHANNEL.fields]
    return dict(zip(names, event_row(event), strict=True))
