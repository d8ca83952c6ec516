"""Old names in configurations: they are still read, with a warning that gives the new name."""

from __future__ import annotations

import warnings
from functools import partial
from typing import Any

RENAMED: dict[str, dict[str, str]] = {
    "preset": {"timed-10baud": "open-loop-zoom-10baud"},
    "coder.kind": {"timed": "open-loop-zoom", "words": "pcm"},
    "transmitter": {"sight_bandwidth_rad_s": "rate_observer_bandwidth_rad_s"},
}
"""Old name to new, of the values of a setting or of the fields of a section."""
DIGEST_KINDS = {new: old for old, new in RENAMED["coder.kind"].items()}
"""Names in the shared configuration, whose digest both ends compare and recordings hold."""


def current_name(place: str, name: str, source: str, *, warn: bool = True) -> str:
    """Return the present name of a value or field; warn, if asked to, where `name` is an old one."""
    new = RENAMED[place].get(name, name)
    if warn and new != name:
        text = f"{source}: {place}: {name!r} is deprecated; use {new!r}"
        warnings.warn(text, FutureWarning, stacklevel=3)
    return new


def with_current_names(values: dict[str, Any], source: str, *, warn: bool = True) -> dict[str, Any]:
    """Return the values of a configuration under their present names."""
    values = dict(values)
    current = partial(current_name, source=source, warn=warn)
    coder, transmitter = values.get("coder"), values.get("transmitter")
    if isinstance(coder, dict) and isinstance(coder.get("kind"), str):
        values["coder"] = coder | {"kind": current("coder.kind", coder["kind"])}
    if isinstance(transmitter, dict):
        values["transmitter"] = {
            current("transmitter", name): value for name, value in transmitter.items()
        }
    return values
