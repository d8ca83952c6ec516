"""The status of a running flight: a flat record of its newest values, and one line of text for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from channel.codec.signals import Signals
from tenbaud.sentences import endings
from tenbaud.sentences.quantities import in_degrees

StatusMode = Literal["auto", "lines", "none"]
Status = dict[str, Any]


def outputs_status(
    plant: Signals,
    values: Sequence[float | None],
    ranges: Sequence[float],
    errors: Sequence[float | None] = (),
) -> list[Status]:
    """Return the values of each output in a status; None if unknown."""
    names = ("value", "range", "error")
    outputs = []
    for place, one in enumerate(plant.outputs):
        known = [each[place] if place < len(each) else None for each in (values, ranges, errors)]
        outputs.append({"name": one.words, "unit": one.unit, **dict(zip(names, known, strict=True))})
    return outputs


def status_line(status: Status) -> str:
    """Return a status as one line for a terminal."""
    words = [f"{status['role']}: {endings.phase_text(status['phase'])}"]
    if status.get("time_s") is not None:
        words.append(f"{status['time_s']:7.1f} s")
    for output in status.get("outputs", ()):
        for name, label, form, of_angle in (
            ("value", output["name"], "{:+.3f} {}", "{:+.1f} {}"),
            ("error", "error", "{:+.4f} {}", "{:+.2f} {}"),
            ("range", "M", "{:.3f}", "{:.2f}"),
        ):
            if output[name] is not None:
                value, unit = in_degrees(output[name], output["unit"])
                shown = (of_angle if unit == "deg" else form).format(value, unit)
                words.append(f"{label} {shown}".rstrip())
    for name, label, form in (
        ("rms_over_floor", "floor x", "{:.1f}"),
        ("erasures", "erased", "{}"),
        ("guard", "guard", "{}"),
        ("kept_symbols_per_s", "TOO SLOW: symbols/s in time", "{:.0f}"),
    ):
        if status.get(name) is not None:
            words.append(f"{label} {form.format(status[name])}")
    if narrow := status.get("narrow"):
        words += [f"{name} {narrow[name]}" for name in ("unconfirmed", "hypotheses")]
        words.append(f"rest {narrow['rest']:.0e}")
        if narrow["baud"] is not None:
            words.append(f"down {narrow['baud']:.1f}/s")
        if narrow["scheme"] == "mirrored":
            words.append("law beside the plant")
    return "  ".join(words)
