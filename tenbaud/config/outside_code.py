"""Decides whether the external classes that a configuration names may be imported.

A configuration is data, and often somebody else's: there is one in every run folder and in every file
of symbols. Opening a recording must not run what it names. So a configuration may name what it likes,
and nothing is imported before somebody asks for it: by flying a flight, or with `--allow-code`.
"""

from __future__ import annotations

import os
import sys
from importlib.machinery import PathFinder
from pathlib import Path
from typing import NamedTuple

from channel.links.registry import LINKS
from channel.registry import Registry
from tenbaud.config.kinds import CODERS, CONTROLLERS, FMU, MODELS, PLANTS
from tenbaud.config.load import ConfigError
from tenbaud.config.schema import FlightConfig

ALLOW_OPTION = "--allow-code"

OBJECT = "object"


class CodeNotAllowed(ConfigError):
    """A configuration names code that nobody has allowed; the text says which, and from where."""


def is_object(kind: str) -> bool:
    """Return whether a kind stands for an object that a program gave to its flight: no code."""
    return kind.startswith(f"{OBJECT}:")


def object_kind(part: object) -> str:
    """Return the kind that stands for an object in the configuration of its flight."""
    return f"{OBJECT}:{(part if isinstance(part, type) else type(part)).__name__}"


class OutsidePart(NamedTuple):
    """A class from outside, as a configuration names it; or a file of machine code."""

    registry: Registry
    name: str
    file: str = ""


def outside_parts(config: FlightConfig) -> list[OutsidePart]:
    """Return the classes from outside that a configuration names."""
    named = (
        OutsidePart(MODELS, config.model.kind),
        OutsidePart(CODERS, config.coder.kind),
        OutsidePart(CONTROLLERS, config.receiver.controller),
        OutsidePart(PLANTS, config.plant_kind),
        OutsidePart(LINKS, config.link.kind),
    )
    parts = [
        part for part in named if part.name not in part.registry.built_in and not is_object(part.name)
    ]
    plant = config.transmitter.plant
    if plant.kind == FMU:
        parts.append(OutsidePart(PLANTS, FMU, str(plant.options.get("file", "no file"))))
    return parts


def require_allowed(config: FlightConfig) -> None:
    """Raise CodeNotAllowed if a configuration names classes from outside and may not run them."""
    parts = outside_parts(config)
    if not parts or config.code_allowed:
        return
    named = [f"{part.registry.field} = {part.name!r}: {_what_would_run(part)}" for part in parts]
    raise CodeNotAllowed(
        "\n  ".join(["the configuration names external code:", *named])
        + "\nNone of it was imported. Imported code can do whatever you can do on this machine. "
        f"If you trust it, add {ALLOW_OPTION} (in Python: config.allowing_code())."
    )


def require_regular_files(config: FlightConfig) -> None:
    """Raise ConfigError if somebody else's configuration has something read that is not a regular file.

    Reading a device or a pipe may never end.
    """
    named = {}
    if config.receiver.controller == "recorded":
        named["flight_log.file"] = config.flight_log.file
    else:
        reference = config.receiver.reference
        for name, one in {"receiver.reference": reference, **reference.by_name}.items():
            if one.kind == "csv":
                named[f"{name}.file"] = one.file
    for field, name in named.items():
        if name and Path(name).exists() and not Path(name).is_file():
            raise ConfigError(f"{field} = {name!r} is not a regular file, so it is not opened")


def _what_would_run(part: OutsidePart) -> str:
    name = part.name
    if part.file:
        return f"would run the machine code in {part.file}"
    if ":" not in name:
        return f"would import what {part.registry.offered_by(name)}"
    module, _, called = name.partition(":")
    origin = find_origin(module)
    if origin is None:
        return f"would import {module}, which is neither in this folder nor where Python looks"
    return f"would import {module} from {origin} and call {called}"


def find_origin(module: str) -> str | None:
    """Return the file that importing a module would run, without running anything; None: not found.

    The import system's own search imports the packages around a module; this one only looks.
    """
    places: list[str] | None = [os.getcwd(), *sys.path]
    origin: str | None = None
    full = ""
    for part in module.split("."):
        full = f"{full}.{part}" if full else part
        if full in sys.builtin_module_names:
            return "Python itself"
        spec = PathFinder.find_spec(full, places)
        if spec is None:
            return None
        origin = spec.origin or ", ".join(spec.submodule_search_locations or ())
        places = list(spec.submodule_search_locations or ())
    return origin
