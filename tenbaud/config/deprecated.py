"""Old names in configurations: they are still read, with a warning that gives the new name."""

from __future__ import annotations

import copy
import warnings
from typing import Any

FIELDS = {
    "limits.volts_max": "limits.command_max",
    "limits.slew_volts_per_s": "limits.command_slew_per_s",
    "limits.initial_volts": "limits.initial_command",
    "transmitter.safe_volts": "transmitter.safe_command",
    "transmitter.soft_limit_rad": "transmitter.soft_limits",
    "transmitter.encoder_counts_per_turn": "transmitter.encoders.counts_per_turn",
    "transmitter.encoder_sign": "transmitter.encoders.sign",
    "transmitter.encoder_zero_counts": "transmitter.encoders.zero_counts",
    "receiver.reference.amplitude_rad": "receiver.reference.amplitude",
}
"""Old full name of a field to the new one."""


def with_current_names(values: dict[str, Any], source: str, *, warn: bool = True) -> dict[str, Any]:
    """Return the values of a configuration under their present names."""
    values = copy.deepcopy(values)
    for old, new in FIELDS.items():
        *sections, field = old.split(".")
        here: Any = values
        for section in sections:
            here = here.get(section) if isinstance(here, dict) else None
        if not isinstance(here, dict) or field not in here:
            continue
        if warn:
            text = f"{source}: {old} is deprecated; use {new}"
            warnings.warn(text, FutureWarning, stacklevel=3)
        value = here.pop(field)
        *sections, field = new.split(".")
        here = values
        for section in sections:
            here = here.setdefault(section, {})
        here.setdefault(field, value)
    return values
