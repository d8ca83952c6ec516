"""The settings that a study may sweep: any field of a flight's configuration, and a few short names.

A field is named by its place in the configuration, such as `coder.decay` or `coder.gains.0`. The short
names stand for what usually moves together, or for a text that would have to be put together by hand.
"""

from __future__ import annotations

import copy
import difflib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from channel.errors import TenbaudError
from tenbaud.build_codec import build_codec
from tenbaud.config.load import load_config
from tenbaud.config.schema import KINDS, FlightConfig


class StudyError(TenbaudError):
    """A study that cannot be run; the text names what is wrong and where."""


SHORT_NAMES = {
    "rate": "R in bit/s: channel.rate_baud, and timing.symbol_period_s for one word in that time",
    "loss": "probability that a message is lost, either way",
    "flip": "probability that a symbol arrives as another one",
    "delay": "delay of every message in s, either way",
    "mismatch": "transmitter.plant.mismatch",
    "density": "q of the white torque on the plant, rad^2/s^3",
}


def put(values: dict[str, Any], name: str, value: object) -> None:
    """Set one field, by its dotted name, in nested sections."""
    *sections, last = name.split(".")
    here: Any = values
    for section in sections:
        here = here.setdefault(section, {})
        if not isinstance(here, dict):
            raise StudyError(f"{name}: {section} is set as a whole, so nothing within it can be swept")
    here[last] = value


def overrides_of(fixed: dict[str, Any], swept: dict[str, Any]) -> dict[str, Any]:
    """Return configuration overrides from fixed sections and swept settings."""
    values = copy.deepcopy(fixed)
    texts: list[str] = []
    for name, value in swept.items():
        match name:
            case "rate":
                put(values, "channel.rate_baud", value)
            case "loss" | "flip":
                texts += [f"{'up:' if name == 'flip' else ''}{name}={value!r}"] if value else []
            case "delay":
                texts += [f"delay={float(value) * 1000.0:.6f}ms"] if value else []
            case "mismatch":
                put(values, "transmitter.plant.mismatch", value)
            case "density":
                _add_text(values, "transmitter", "plant", "disturbance", f"q={value!r}")
            case _:
                put(values, name, value)
    if texts:
        _add_text(values, "link", "impairments", ",".join(texts))
    return values


def _add_text(values: dict[str, Any], *place: str) -> None:
    *sections, last, text = place
    for section in sections:
        values = values.setdefault(section, {})
    values[last] = ",".join(filter(None, (values.get(last, ""), text)))


def configured(
    preset: str | None, file: Path | None, fixed: dict[str, Any], swept: dict[str, Any]
) -> FlightConfig:
    """Return the configuration of one point; ConfigError or StudyError where there is none."""
    entries = {name: value for name, value in swept.items() if name.rpartition(".")[2].isdigit()}
    whole = {name: value for name, value in swept.items() if name not in entries}
    values = overrides_of(fixed, whole)
    config = load_config(preset, file, values)
    if not entries and "rate" not in swept:
        return config
    if "rate" in swept:
        words = build_codec(config).coder.alphabet.symbols_per_word
        put(values, "timing.symbol_period_s", words / float(swept["rate"]))
    for name, value in entries.items():
        field, _, index = name.rpartition(".")
        put(values, field, _with_entry(config, values, field, int(index), value))
    return load_config(preset, file, values)


def _with_entry(
    config: FlightConfig, values: dict[str, Any], field: str, index: int, value: object
) -> list[Any]:
    """Return a list of the configuration with one entry changed."""
    here: Any = values
    for part in field.split("."):
        here = here.get(part) if isinstance(here, dict) else None
    if not isinstance(here, list):
        here = config.model_dump(mode="json")
        for part in field.split("."):
            here = here.get(part) if isinstance(here, dict) else None
    if not isinstance(here, list) or index >= len(here):
        size = f"has {len(here)} entries" if isinstance(here, list) else "is no list"
        raise StudyError(f"{field}.{index} cannot be swept: {field} {size}")
    return [value if place == index else old for place, old in enumerate(here)]


def check_name(name: str) -> None:
    """Raise StudyError, with the nearest name, unless a setting of this name exists."""
    if name in SHORT_NAMES:
        return
    known = {*SHORT_NAMES, *field_names()}
    if name in known or (name.rpartition(".")[0] in known and name.rpartition(".")[2].isdigit()):
        return
    near = difflib.get_close_matches(name, sorted(known), 1)
    hint = f"did you mean {near[0]}?" if near else f"short names are {', '.join(SHORT_NAMES)}"
    raise StudyError(f"there is no setting {name!r} to sweep; {hint}")


@cache
def field_names() -> tuple[str, ...]:
    """Return the dotted names of all fields of a configuration, those of every kind included."""
    names = list(_fields_of(FlightConfig, ""))
    for section, kinds in KINDS.items():
        for kind in kinds.values():
            names += _fields_of(kind, f"{section}.")
    return tuple(dict.fromkeys(names))


def _fields_of(section: type[BaseModel], prefix: str) -> Iterator[str]:
    for name, field in section.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, BaseModel):
            yield from _fields_of(inner, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}"
