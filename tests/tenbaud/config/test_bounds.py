"""Every number in a configuration and on the command line has a floor and a ceiling."""

from __future__ import annotations

import contextlib
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer
from annotated_types import Ge, Le, Lt
from pydantic import BaseModel

from channel.errors import TenbaudError
from tenbaud.build.flight import agree
from tenbaud.cli.app import run
from tenbaud.cli.commands import app
from tenbaud.config.load import load_config, nested
from tenbaud.config.schema import KINDS, FlightConfig

IN_THE_CONFIGURATION = ("lead", "line_rate", "mismatch")
"""Options whose bounds are those of their fields."""


class Number(typing.NamedTuple):
    """A number somewhere in a field."""

    name: str
    default: Any
    floor: float | None
    ceiling: float | None
    kind: str = ""
    """what the section has to be for it"""


def _bounds(annotation: Any, metadata: tuple[Any, ...]) -> Iterator[tuple[Any, Any]]:
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        inner, *more = typing.get_args(annotation)
        yield from _bounds(inner, (*metadata, *more))
    elif annotation in (int, float):
        floor = ceiling = None
        for one in (part for each in metadata for part in getattr(each, "metadata", [each])):
            if isinstance(one, Ge):
                floor = one.ge
            elif isinstance(one, Le):
                ceiling = one.le
            elif isinstance(one, Lt) and annotation is int:
                ceiling = typing.cast(int, one.lt) - 1
        yield floor, ceiling
    elif origin in (typing.Union, types.UnionType):
        for part in typing.get_args(annotation):
            yield from _bounds(part, metadata)
    elif origin is tuple:
        for part in dict.fromkeys(typing.get_args(annotation)):
            yield from _bounds(part, ())


def _numbers(section: type[BaseModel], prefix: str = "", kind: str = "") -> Iterator[Number]:
    for name, field in section.model_fields.items():
        annotation = field.annotation
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            yield from _numbers(annotation, f"{prefix}{name}.", kind)
            continue
        for floor, ceiling in _bounds(annotation, tuple(field.metadata)):
            yield Number(prefix + name, field.default, floor, ceiling, kind)


NUMBERS = [
    *_numbers(FlightConfig),
    *(
        number
        for section, kinds in KINDS.items()
        for kind, model in kinds.items()
        for number in _numbers(model, f"{section}.", f"{section}.kind={kind}")
    ),
]
ENDS = [
    pytest.param(number, end, id=f"{number.name}={end}{number.kind and f', {number.kind}'}")
    for number in NUMBERS
    for end in (number.floor, number.ceiling)
]


def test_every_number_of_the_configuration_has_both() -> None:
    assert len(NUMBERS) > 80
    for number in NUMBERS:
        assert number.floor is not None, number.name
        assert number.ceiling is not None, number.name
        assert number.ceiling - number.floor < 5e9 or number.name == "seed", number.name


def test_every_number_on_the_command_line_has_both() -> None:
    def options(group: Any, path: str) -> Iterator[tuple[str, Any]]:
        for name, command in group.commands.items():
            if hasattr(command, "commands"):
                yield from options(command, f"{path} {name}")
            else:
                yield from ((f"{path} {name} --{one.name}", one) for one in command.params)

    found = 0
    for name, option in options(typer.main.get_command(app), "tenbaud"):
        kind = getattr(getattr(option, "type_descriptor", None), "annotation", None)
        if not {kind, *typing.get_args(kind)} & {int, float} or option.name in IN_THE_CONFIGURATION:
            continue
        found += 1
        assert option.min is not None, name
        assert option.max is not None, name
    assert found > 20


def _spread(number: Number, value: Any) -> Any:
    """Return the value in the shape of the field."""
    shape = number.default
    if not isinstance(shape, tuple):
        return value
    if not shape:
        return [value]
    return (
        [[value] * len(shape[0])] * len(shape) if isinstance(shape[0], tuple) else [value] * len(shape)
    )


@pytest.mark.parametrize(("number", "value"), ENDS)
def test_each_end_can_be_agreed_on_or_is_refused_in_words(number: Number, value: Any) -> None:
    settings: dict[str, Any] = {number.name: _spread(number, value)}
    settings |= dict([number.kind.split("=")]) if number.kind else {}
    with contextlib.suppress(TenbaudError, ValueError):
        agree(load_config(None, None, nested(settings)), "virtual")


@pytest.mark.soak
@pytest.mark.parametrize(("number", "value"), ENDS)
def test_each_end_flies_or_is_refused_in_words(
    number: Number, value: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if (number.name, value) == ("duration_s", number.ceiling):
        return
    arguments = ["demo", "--link", "memory", "--json", "--out", str(tmp_path / "run")]
    arguments += ["--set", f"{number.name}={_spread(number, value)!r}"]
    arguments += [] if number.name == "duration_s" else ["--duration", "0.3"]
    arguments += ["--set", number.kind] if number.kind else []
    code = run(arguments)
    assert code == 0 or capsys.readouterr().err


@pytest.mark.parametrize("hover_rad", [0.0, 0.6])
def test_a_helicopter_hovers_between_level_and_its_stop(hover_rad: float) -> None:
    with pytest.raises(TenbaudError, match="hover_rad"):
        load_config("helicopter-10baud", None, {"model": {"hover_rad": hover_rad}})
