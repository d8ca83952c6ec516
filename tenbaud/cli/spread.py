"""Options that are the fields of a dataclass; the text below a field is its help."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """Let typer see the fields of a command's dataclass arguments as options of the command.

    The command itself gets each dataclass whole. Its own options come after those of the dataclass.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, Any] = {name: kind for name, kind in hints.items() if is_dataclass(kind)}
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name in groups:
            parameters += _parameters(groups[name])
        else:
            parameters.append(_parameter(name, hints[name], parameter.default))

    def run(**values: Any) -> None:
        whole = {
            name: kind(**{field: values.pop(field) for field in kind.__dataclass_fields__})
            for name, kind in groups.items()
        }
        command(**whole, **values)

    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in parameters}
    return run


def _parameter(name: str, hint: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _parameters(group: Any) -> Iterator[inspect.Parameter]:
    """Yield the option of each field; a plain switch that is off has no `--no-` form."""
    hints = get_type_hints(group, include_extras=True)
    texts = {name: text for kind in group.__mro__ for name, text in _texts(kind).items()}
    for one in fields(group):
        default = inspect.Parameter.empty if one.default is MISSING else one.default
        yield _parameter(one.name, _hint(one.name, hints[one.name], default, texts), default)


def _hint(name: str, hint: Any, default: Any, texts: dict[str, str]) -> Any:
    """Return the annotation of an option, with its text as help."""
    if name not in texts:
        return hint
    if get_origin(hint) is Annotated:
        kind, info = get_args(hint)
        info = copy(info)
    else:
        switch = hint is bool and not default
        kind, info = hint, typer.Option(*[f"--{name.replace('_', '-')}"] * switch)
    info.help = texts[name]
    return Annotated[kind, info]


def _texts(kind: type) -> dict[str, str]:
    """Return the text below each field of a class."""
    body = _bodies(getattr(sys.modules[kind.__module__], "__file__", None)).get(kind.__name__, [])
    return {
        field.target.id: " ".join(text.value.value.split())
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
        if isinstance(text.value.value, str)
    }


@cache
def _bodies(file: str | None) -> dict[str, list[ast.stmt]]:
    """Return the statements of each class of a module."""
    tree = ast.parse(Path(file).read_text(encoding="utf-8")) if file else ast.Module([], [])
    return {one.name: one.body for one in tree.body if isinstance(one, ast.ClassDef)}
