"""Reading a configuration: a preset, then a file over it, then the command line over both."""

from __future__ import annotations

import difflib
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from channel.errors import TenbaudError
from channel.protocol.terms import Rung
from tenbaud.config.deprecated import current_name, with_current_names
from tenbaud.config.kinds import CODERS, MODELS
from tenbaud.config.schema import KINDS, FlightConfig
from tenbaud.config.section import OutsideSection, Section

DEFAULT_PRESET = "paper-10baud"
OWN = "own"
"""In place of a preset: the user's own plant, over the defaults of the fields."""
FOLDERS = {
    "preset": files("tenbaud") / "presets",
    "mission": files("tenbaud") / "presets" / "missions",
}
_SPLIT = re.compile(r",\n\s+")


class ConfigError(TenbaudError):
    """A configuration that cannot be used; the text names file, field, value and allowed range."""


@contextmanager
def config_errors(where: str = "") -> Iterator[None]:
    """Within the `with`, a ValueError becomes a ConfigError that begins with `where`."""
    try:
        yield
    except ValueError as error:
        raise ConfigError(f"{where}: {error}" if where else str(error)) from error


def preset_names(what: str = "preset") -> list[str]:
    """Return the presets, or the missions, shipped with the package."""
    folder = FOLDERS[what]
    return sorted(item.name[:-5] for item in folder.iterdir() if item.name.endswith(".toml"))


def load_config(
    preset: str | None = None,
    path: Path | None = None,
    overrides: dict[str, Any] | None = None,
    *,
    allow_code: bool = False,
    recorded: bool = False,
) -> FlightConfig:
    """Return the checked configuration.

    A file may name the preset that it builds on (`preset = "..."`); an explicit `preset` wins.
    `allow_code`: external classes that it names may be imported, as for the user's own flight.
    `recorded`: the file was written by a flight; old names in it cause no warning. Raises ConfigError.
    """
    values = merged_values(preset, path, overrides, recorded=recorded)
    return checked(values, path, allow_code=allow_code)


def checked(
    values: dict[str, Any], path: Path | None = None, *, allow_code: bool = False
) -> FlightConfig:
    """Return the configuration of nested settings, some of them from the file `path`; ConfigError."""
    try:
        config = FlightConfig.model_validate(values)
    except ValidationError as error:
        source = str(path) if path is not None else f"preset {values['preset']}"
        raise ConfigError(_describe_all(source, error)) from error
    return config.allowing_code() if allow_code else config


def given_names(path: Path | None, overrides: Mapping[str, Any] | None) -> set[str]:
    """Return the full names of the settings that are given over a preset, in a file or beside it."""
    return {name for name, _ in flattened(given_values(path, overrides))}


def given_values(path: Path | None, overrides: Mapping[str, Any] | None) -> dict[str, Any]:
    """Return the nested settings that are given over a preset, in a file or beside it."""
    in_file = read_toml(path) if path is not None else {}
    both = [with_current_names(one, "", warn=False) for one in (in_file, dict(overrides or {}))]
    return merged(*both)


def merged_values(
    preset: str | None = None,
    path: Path | None = None,
    overrides: dict[str, Any] | None = None,
    *,
    recorded: bool = False,
) -> dict[str, Any]:
    """Return what `load_config` checks: nested settings, as they were read."""
    source = str(path) if path is not None else f"preset {preset or DEFAULT_PRESET}"
    from_file = (
        with_current_names(read_toml(path), source, warn=not recorded) if path is not None else {}
    )
    base = preset or from_file.get("preset") or DEFAULT_PRESET
    if not isinstance(base, str):
        raise ConfigError(f"{path}: preset must be a name in quotes, got {base!r}")
    base = current_name("preset", base, source, warn=not recorded)
    given = with_current_names(overrides or {}, "the settings")
    values = _read_preset(base)
    if mission := given.get("mission", from_file.get("mission", "")):
        values = merged(values, _read_preset(str(mission), "mission"))
    found = merged(merged(values, from_file), given) | {"preset": base}
    if not recorded:
        _refuse_misplaced(found, source)
    return found


def _refuse_misplaced(values: Mapping[str, Any], source: str) -> None:
    """Raise ConfigError for a kind of downlink where its link belongs: that would change nothing."""
    link = values.get("link")
    name = link.get("downlink") if isinstance(link, Mapping) else None
    if name in get_args(Rung):
        raise ConfigError(
            f"{source}, with the command line over it:\n  link.downlink = {name!r}: it names the link "
            f"that carries the commands; for this kind of downlink set channel.downlink = {name!r}"
        )


def nested(settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings by their full names, `coder.decay`, as the sections of a configuration.

    Raises ConfigError for a section that is set as a whole and in parts.
    """
    sections: dict[str, Any] = {}
    for name, value in settings.items():
        *path, field = name.split(".")
        place = sections
        for depth, part in enumerate(path, 1):
            place = place.setdefault(part, {})
            if not isinstance(place, dict):
                raise _set_twice(".".join(path[:depth]))
        if field in place:
            raise _set_twice(name)
        place[field] = value
    return sections


def flattened(sections: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the full name and the value of each setting in nested sections, as `nested` takes them."""
    for name, value in sections.items():
        if isinstance(value, dict):
            yield from flattened(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _set_twice(section: str) -> ConfigError:
    return ConfigError(f"{section} is set as a whole, and fields within it too; set one or the other")


def dump_config(config: FlightConfig) -> str:
    """Return a configuration as TOML that `load_config` reads back to the same values."""
    return toml_text(config.model_dump(mode="json", exclude_none=True))


def toml_text(values: Mapping[str, Any]) -> str:
    """Return settings as TOML, a row of a matrix in a line."""
    import tomli_w

    text = tomli_w.dumps(values)
    return re.sub(r"\[\n\s+([^\[\]{}]*?),\n\s*\]", lambda row: f"[{_SPLIT.sub(', ', row[1])}]", text)


def _read_preset(name: str, what: str = "preset") -> dict[str, Any]:
    if name == OWN:
        return {}
    resource = FOLDERS[what] / f"{name}.toml"
    if not resource.is_file():
        known = preset_names(what)
        near = difflib.get_close_matches(name, known, 1)
        hint = f" Did you mean {near[0]}?" if near else ""
        raise ConfigError(f"there is no {what} {name!r}.{hint} Known: {', '.join(known)}")
    values = tomllib.loads(resource.read_text(encoding="utf-8"))
    base = values.pop("preset", None)
    return values if base is None else merged(_read_preset(base, what), values)


def read_toml(path: Path) -> dict[str, Any]:
    """Return a TOML file's settings; ConfigError where it cannot be read."""
    try:
        # Names of files that are no UTF-8 have their bytes here, as `write_whole` writes them.
        return tomllib.loads(path.read_text(encoding="utf-8", errors="surrogateescape"))
    except OSError as error:
        raise ConfigError(f"cannot read the configuration {path}: {error.strerror}") from error
    except tomllib.TOMLDecodeError as error:
        raise ConfigError(f"{path} is not TOML: {error}") from error


def merged(base: dict[str, Any], over: dict[str, Any]) -> dict[str, Any]:
    """Return nested settings overridden by others; a section of another kind replaces one."""
    both = dict(base)
    for key, value in over.items():
        below = both.get(key)
        if not isinstance(value, dict) or not isinstance(below, dict) or _other_kind(key, below, value):
            both[key] = value
        else:
            both[key] = merged(below, value)
    return both


def _other_kind(key: str, below: Any, over: Any) -> bool:
    """Return whether a section changes its kind, so that fields of the old one mean nothing."""
    if key not in KINDS or not isinstance(below, dict) or not isinstance(over, dict):
        return False
    default = next(iter(KINDS[key]))
    return "kind" in over and over["kind"] != below.get("kind", default)


def _describe_all(source: str, error: ValidationError) -> str:
    """Return one line per field; one that may be of several types has an error for each."""
    problems: dict[str, list[str]] = {}
    for detail in error.errors():
        what, why = _describe(detail)
        problems.setdefault(what, []).append(why)
    lines = [f"{what}: {' or '.join(whys)}" for what, whys in problems.items()]
    return "\n  ".join([f"{source}, with the command line over it:", *lines])


def _describe(detail: ErrorDetails) -> tuple[str, str]:
    # The names of a union's branches ("int", "literal['auto']") are no part of the field's name.
    branches = ("literal[", "int", "float", "constrained", "tuple[", "function-", "str")
    place = [str(part) for part in detail["loc"] if not str(part).startswith(branches)]
    kind = place.pop(1) if len(place) > 1 and place[1] in _kinds(place[0]) else None
    name = ".".join(place) or "(whole file)"
    if detail["type"] in ("extra_forbidden", "model_type"):
        return name, _nearest(place, kind)
    if detail["type"] == "union_tag_invalid":
        tag = detail["ctx"]["tag"]
        hint = (MODELS if name == "model" else CODERS).hint(str(tag))
        return f"{name}.kind = {tag!r}", hint
    if detail["type"] == "string_pattern_mismatch" and place[-1] in ("controller", "kind"):
        return f"{name} = {detail['input']!r}", "a class from outside is written module:Class"
    message = detail["msg"].removeprefix("Value error, ")
    if isinstance(detail["input"], dict | FlightConfig):
        return name, message
    return f"{name} = {detail['input']!r}", message


def _kinds(section: str) -> dict[str, type[Section]]:
    """Return the kinds of a section, by the tag in its errors."""
    kinds: dict[str, type[Section]] = dict(KINDS.get(section, {}))
    return kinds | {"plugin": OutsideSection} if kinds else kinds


def _nearest(place: list[str], kind: str | None) -> str:
    fields: Any = FlightConfig.model_fields
    sections = place[:-1]
    if kind is not None:
        fields = _kinds(place[0])[kind].model_fields
        sections = place[1:-1]
    for part in sections:
        section = fields[part].annotation if part in fields else None
        fields = getattr(section, "model_fields", {})
    if place[-1] in fields:
        within = getattr(fields[place[-1]].annotation, "model_fields", {})
        same = [
            f"{name}.{place[-1]}"
            for name, one in FlightConfig.model_fields.items()
            if place[-1] in getattr(one.annotation, "model_fields", {})
        ]
        other = f"; or do you mean {' or '.join(same)}?" if same else ""
        return f"a section with the fields {', '.join(within)}; set one of them{other}"
    near = difflib.get_close_matches(place[-1], list(fields), 1)
    if near:
        return f"unknown field; did you mean {near[0]}?"
    return f"unknown field; known here: {', '.join(fields)}" if fields else "unknown field"
