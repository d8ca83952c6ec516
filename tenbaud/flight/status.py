"""The status of a running flight: a flat record of its newest values, and one line of text for it."""

from __future__ import annotations

from typing import Any, Literal

from tenbaud.sentences import endings

StatusMode = Literal["auto", "lines", "none"]
Status = dict[str, Any]


def status_line(status: Status) -> str:
    """Return a status as one line for a terminal."""
    words = [f"{status['role']}: {endings.phase_text(status['phase'])}"]
    if status.get("time_s") is not None:
        words.append(f"{status['time_s']:7.1f} s")
    for name, label, form in (
        ("pitch_rad", "pitch", "{:+.3f} rad"),
        ("error_rad", "error", "{:+.4f} rad"),
        ("range_rad", "M", "{:.3f}"),
        ("rms_over_floor", "floor x", "{:.1f}"),
        ("erasures", "erased", "{}"),
        ("guard", "guard", "{}"),
        ("kept_symbols_per_s", "TOO SLOW: symbols/s in time", "{:.0f}"),
    ):
        if status.get(name) is not None:
            words.append(f"{label} {form.format(status[name])}")
    return "  ".join(words)
