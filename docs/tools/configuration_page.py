"""The reference page of the configuration, from the schema itself: what `reference.py` writes."""

from __future__ import annotations

import ast
import inspect
import itertools
import textwrap
from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from docs.tools.meanings import meaning_of
from tenbaud.config.kinds import PartName
from tenbaud.config.schema import KINDS, SHARED_SECTIONS, FlightConfig
from tenbaud.config.section import NamedSections, Section

UNITS = (
    ("command_slew_per_s", "of the input, per s"),
    ("_rad_per_v_s2", "rad/(V s²)"),
    ("_rad_per_s2", "rad/s²"),
    ("_rad_s", "rad/s"),
    ("_volts_per_s", "V/s"),
    ("_rad_per_s", "rad/s"),
    ("_per_s2", "1/s²"),
    ("_per_s", "1/s"),
    ("_per_turn", "counts/turn"),
    ("_counts", "counts"),
    ("_volts", "V"),
    ("device_volts_max", "V"),
    ("_baud", "baud"),
    ("_ticks", "ticks"),
    ("_signs", "signs"),
    ("_rad", "rad"),
    ("_hz", "Hz"),
    ("_s", "s"),
    ("bits", "bits"),
)
"""Ending of a field's name, and the unit that it stands for; the first that fits."""

KINDS_MODULE = "tenbaud.config.kinds"

INTRODUCTION = """# Configuration

<!-- Written by `make reference` from the schema. Change the schema, not this page. -->

One TOML file holds everything about a flight; both ends read the same one. Give it with `--config`, set
single fields with `--set SECTION.FIELD=VALUE`, or start from a preset (`tenbaud presets` lists them).
Later wins: preset, then file, then command line. Every run writes the complete result to its
`config.toml`.

The sections {shared} are *shared*: the two ends compare a digest of them in their handshake and do
not fly when it differs. An unknown field or a value out of its range is refused, by name.
"""


def configuration_page() -> str:
    """Return the whole page."""
    shared = ", ".join(f"`{name}`" for name in SHARED_SECTIONS)
    parts = [INTRODUCTION.format(shared=shared), *_section("", FlightConfig)]
    return "\n".join(parts).rstrip() + "\n"


def _section(name: str, model: type[BaseModel], kind: str = "") -> Iterator[str]:
    """Yield a section and, behind it, the sections within it."""
    title = f"`[{name}]`" if name else "Top level"
    if kind:
        title += f' with `kind = "{kind}"`'
    yield f"## {title}\n"
    yield f"{inspect.getdoc(model)}\n"
    meanings = _meanings(model)
    rows = []
    inner: list[tuple[str, type[BaseModel]]] = []
    for field, info in model.model_fields.items():
        path = f"{name}.{field}" if name else field
        sections = _models(info.annotation)
        if not sections and name == "" and field in KINDS:
            sections = list(KINDS[field].values())
        if sections:
            inner += [(path, section) for section in sections]
            continue
        if field == "kind" and kind:
            continue
        rows.append(_row(field, info, meanings.get(field) or meaning_of(name, kind, field)))
    if issubclass(model, NamedSections):
        named = get_type_hints(model)["__pydantic_extra__"]
        inner.append((f"{name}.NAME", get_args(named)[1]))
    if rows:
        yield "| field | unit | default | allowed | meaning |"
        yield "|---|---|---|---|---|"
        yield from rows
        yield ""
    elif not inner:
        yield "No fields but `kind`.\n"
    for path, section in inner:
        known = [tag for tag, model_ in KINDS.get(path, {}).items() if model_ is section]
        plain = path not in KINDS
        yield from _section(path, section, "" if plain else known[0] if known else "module:Class")


def _row(field: str, info: FieldInfo, meaning: str) -> str:
    unit = next((text for ending, text in UNITS if field.endswith(ending)), "")
    cells = [
        f"`{field}`",
        unit,
        _default(info.get_default(call_default_factory=True)),
        _allowed(info.annotation, info.metadata),
        meaning,
    ]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _default(value: object) -> str:
    if value is None:
        return "none"
    if value is PydanticUndefined:
        return "required"
    if isinstance(value, dict):
        return "`{}`" if not value else f"`{value}`"
    if isinstance(value, tuple):
        return "`[" + ", ".join(_plain(item) for item in value) + "]`"
    return f"`{_plain(value)}`"


def _plain(value: object) -> str:
    """Return a value as TOML writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else str(value)


def _allowed(annotation: Any, metadata: list[Any]) -> str:
    """Return in words what a field takes."""
    if get_origin(annotation) is Annotated:
        base, *extra = get_args(annotation)
        return _allowed(base, [*extra, *metadata])
    if get_origin(annotation) in (Union, UnionType):
        return " or ".join(_allowed(part, metadata) for part in get_args(annotation))
    if get_origin(annotation) is Literal:
        return ", ".join(f"`{_plain(value)}`" for value in get_args(annotation))
    if get_origin(annotation) is tuple:
        return _allowed_list(get_args(annotation))
    if get_origin(annotation) is dict or _models(annotation):
        return "table"
    for check in (getattr(item, "func", None) for item in metadata):
        if isinstance(check, PartName):
            known = ", ".join(f"`{_plain(name)}`" for name in check.registry.built_in)
            return f"{known}, one that a package offers" + (
                " or `module:Class`" if check.registry.classes else ""
            )
    names = {
        float: "number",
        int: "whole number",
        str: "text",
        bool: "`true`, `false`",
        NoneType: "none",
    }
    return (names.get(annotation, str(annotation)) + " " + _bounds(metadata)).strip()


def _allowed_list(parts: tuple[Any, ...]) -> str:
    if parts[-1] is Ellipsis:
        return f"list of: {_allowed(parts[0], [])}"
    kinds = {_allowed(part, []) for part in parts}
    if len(kinds) == 1:
        return f"list of {len(parts)}: {kinds.pop()}"
    return "list: " + "; ".join(_allowed(part, []) for part in parts)


def _bounds(metadata: list[Any]) -> str:
    flat = [part for item in metadata for part in getattr(item, "metadata", [item])]
    found = []
    for attribute, sign in (("gt", ">"), ("ge", "≥"), ("lt", "<"), ("le", "≤")):
        for item in flat:
            bound = getattr(item, attribute, None)
            if bound is not None:
                found.append(f"{sign} {_number(bound)}")
            pattern = getattr(item, "pattern", None)
            if pattern is not None and attribute == "gt":
                found.append(f"matching `{pattern}`")
    return ", ".join(found)


def _number(bound: float) -> str:
    return "2^63" if bound == 2**63 else f"{bound:.10g}"


def _models(annotation: Any) -> list[type[BaseModel]]:
    """Return the sections that a field may be; none for a plain value."""
    if inspect.isclass(annotation) and issubclass(annotation, BaseModel):
        return [annotation]
    parts = get_args(annotation) if get_origin(annotation) is not tuple else ()
    return [model for part in parts for model in _models(part)]


def _meanings(model: type[BaseModel]) -> dict[str, str]:
    """Return the texts below the fields of a section, those of its parents included."""
    found: dict[str, str] = {}
    for owner in reversed(model.__mro__):
        if not issubclass(owner, Section) or owner.__module__ == KINDS_MODULE:
            continue  # the latter is made of a constructor, whose parameters have no texts
        tree = ast.parse(textwrap.dedent(inspect.getsource(owner)))
        body = tree.body[0].body  # type: ignore[attr-defined]
        for field, text in itertools.pairwise(body):
            named = isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
            if named and isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant):
                found[field.target.id] = " ".join(str(text.value.value).split())
    return found
