"""The settings that a study may sweep: any field of a flight's configuration, and a few short names.

A field is named by its place in the configuration, such as `coder.decay` or `coder.gains.0`. The short
names stand for what usually moves together, or for a text that would have to be put together by hand.
"""

from __future__ import annotations

import copy
import difflib
import math
from collections.abc import Iterator
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel

from channel.errors import TenbaudError
from tenbaud.build.codec import unchecked_codec
from tenbaud.build.recorded import flight_config
from tenbaud.config.outside_code import require_allowed
from tenbaud.config.schema import KINDS, FlightConfig


class StudyError(TenbaudError):
    """A study that cannot be run; the text names the error and its place."""


class Short(NamedTuple):
    """A short name: its fields, its unit, and its allowed values."""

    what: str
    unit: str
    low: float
    high: float = math.inf


SHORT_NAMES = {
    # Beside a rate timing.symbol_period_s becomes that of one word.
    "rate": Short("number of symbols per second (channel.rate_baud)", " baud", 1e-6),
    "loss": Short("share of messages lost either way", "", 0.0, 1.0),
    "flip": Short("share of symbols that arrive as another one", "", 0.0, 1.0),
    "delay": Short("delay of every message either way in seconds", " s", 0.0),
    "mismatch": Short("fraction by which the plant is off the model", "", -1.0, 10.0),
    "density": Short("q of the white torque on the plant in rad^2/s^3", " rad^2/s^3", 0.0),
}


FIELDS = {"rate": "channel.rate_baud", "mismatch": "transmitter.plant.mismatch"}
"""Short names of a field."""

TEXTS = {
    "density": "transmitter.plant.disturbance",
    **dict.fromkeys(("loss", "flip", "delay"), "link.impairments"),
}
"""Short names of what is added to a text, which may say something else already."""


def check_value(name: str, value: object) -> None:
    """Raise StudyError unless a value is one that a short name can have."""
    short = SHORT_NAMES.get(name)
    if short is None:
        return
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not short.low <= value <= short.high:  # type: ignore[operator]
        most = "" if short.high == math.inf else f" and at most {short.high:g}"
        raise StudyError(
            f"{name} = {value!r}: give the {short.what}: a number, at least {short.low:g}{most}"
        )


def in_words(point: dict[str, Any]) -> str:
    """Return the settings of a point with their units."""
    units = {name: short.unit for name, short in SHORT_NAMES.items()}
    return ", ".join(f"{name} = {value!r}{units.get(name, '')}" for name, value in point.items())


def put(values: dict[str, Any], name: str, value: object) -> None:
    """Set one field, by its dotted name, in nested sections."""
    *sections, last = name.split(".")
    here: Any = values
    for section in sections:
        here = here.setdefault(section, {})
        if not isinstance(here, dict):
            raise StudyError(f"{name}: {section} is set as a whole, so nothing within it can be swept")
    here[last] = value


def configured(
    preset: str | None,
    file: Path | None,
    fixed: dict[str, Any],
    swept: dict[str, Any],
    *,
    allow_code: bool = False,
) -> FlightConfig:
    """Return the configuration of one point; ConfigError or StudyError where there is none.

    `allow_code`: classes from outside that it names may be imported.
    """
    entries = {name: value for name, value in swept.items() if name.rpartition(".")[2].isdigit()}
    texts = {name: value for name, value in swept.items() if name in TEXTS}
    values = copy.deepcopy(fixed)
    for name, value in swept.items():
        if name not in entries and name not in texts:
            put(values, FIELDS.get(name, name), value)
    config = flight_config(preset, file, values, allow_code=allow_code)
    require_allowed(config)
    if not (entries or texts or "rate" in swept):
        return config
    _put_texts(config, values, texts)
    if "rate" in swept:
        words = unchecked_codec(config).coder.alphabet.symbols_per_word
        put(values, "timing.symbol_period_s", words / float(swept["rate"]))
    for name, value in entries.items():
        field, _, index = name.rpartition(".")
        put(values, field, _with_entry(config, values, field, int(index), value))
    config = flight_config(preset, file, values, allow_code=allow_code)
    require_allowed(config)
    return config


def _put_texts(config: FlightConfig, values: dict[str, Any], texts: dict[str, Any]) -> None:
    """Add the swept settings to the texts of a configuration; StudyError if they are set already."""
    for name, value in texts.items():
        text = attrgetter(TEXTS[name])(config)
        item = "q" if name == "density" else name
        for said in text.split(","):
            if said.partition("=")[0].rpartition(":")[2].strip() == item:
                raise StudyError(f"{name} is swept, and the configuration has {said.strip()} already")
        match name:
            case "density":
                more = f"q={value!r}"
            case "delay":
                more = f"delay={float(value) * 1000.0:.6f}ms" if value else ""
            case _:
                more = f"{'up:' if name == 'flip' else ''}{name}={value!r}" if value else ""
        place = TEXTS[name]
        put(values, place, ",".join(filter(None, (at(values, place) or text, more))))


def at(values: Any, name: str) -> Any:
    """Return what a dotted name stands for in nested sections and lists, None where there is none."""
    for part in name.split("."):
        try:
            values = values[int(part) if isinstance(values, list) else part]
        except (LookupError, TypeError, ValueError):
            return None
    return values


def _with_entry(
    config: FlightConfig, values: dict[str, Any], field: str, index: int, value: object
) -> list[Any]:
    """Return a list of the configuration with one entry changed."""
    here = at(values, field)
    if not isinstance(here, list):
        here = at(config.model_dump(mode="json"), field)
    if not isinstance(here, list) or index >= len(here):
        size = f"has {len(here)} entries" if isinstance(here, list) else "is no list"
        raise StudyError(f"{field}.{index} cannot be swept: {field} {size}")
    return [value if place == index else old for place, old in enumerate(here)]


def check_name(name: str) -> None:
    """Raise StudyError, with the nearest name, unless a setting of this name exists."""
    if name in SHORT_NAMES:
        return
    known = {*SHORT_NAMES, *field_names()}
    field = name
    while field.rpartition(".")[2].isdigit():  # an entry of a list, or of a list within it
        field = field.rpartition(".")[0]
    if field in known:
        return
    near = difflib.get_close_matches(name, sorted(known), 1)
    hint = f"did you mean {near[0]}?" if near else f"short names are {', '.join(SHORT_NAMES)}"
    raise StudyError(f"there is no setting {name!r} to sweep; {hint}")


@cache
def field_names() -> tuple[str, ...]:
    """Return the dotted names of all fields of a configuration, those of every kind included."""
    names = list(_fields_of(FlightConfig, ""))
    for section, kinds in KINDS.items():
        names.remove(section)
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
