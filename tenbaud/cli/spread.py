"""Options that are the fields of a dataclass; the text below a field is its help."""

from __future__ import annotations

import ast
import inspect
import sys
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import MISSING, fields, is_dataclass
from functools import cache, cached_property
from itertools import pairwise
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import typer


class spread:  # noqa: N801  # a decorator
    """Lets typer see the fields of a command's dataclass arguments as options of the command.

    The command itself gets each dataclass whole. Options come in the order of its arguments. They are
    made when they are asked for: the commands that are not run take no time.
    """

    def __init__(self, command: Callable[..., None]) -> None:
        self._command = command
        self.__name__, self.__doc__ = command.__name__, command.__doc__

    def __call__(self, **values: Any) -> None:
        groups: dict[str, Any] = {name: one for name, one in self._hints.items() if is_dataclass(one)}
        whole = {
            name: kind(**{field: values.pop(field) for field in kind.__dataclass_fields__})
            for name, kind in groups.items()
        }
        self._command(**whole, **values)

    @cached_property
    def _hints(self) -> dict[str, Any]:
        return get_type_hints(self._command, include_extras=True)

    @cached_property
    def __signature__(self) -> inspect.Signature:
        parameters: list[inspect.Parameter] = []
        for name, parameter in inspect.signature(self._command).parameters.items():
            hint = self._hints[name]
            if is_dataclass(hint):
                parameters += _parameters(hint)
            else:
                parameters.append(_parameter(name, hint, parameter.default))
        return inspect.Signature(parameters)

    @property
    def __annotations__(self) -> dict[str, Any]:  # type: ignore[override]  # of this command
        return {one.name: one.annotation for one in self.__signature__.parameters.values()}


def _parameter(name: str, hint: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)


def _parameters(group: Any) -> Iterator[inspect.Parameter]:
    """Yield the option of each field; a plain switch that is off has no `--no-` form."""
    hints = get_type_hints(group, include_extras=True)
    texts = {name: text for kind in reversed(group.__mro__) for name, text in _texts(kind).items()}
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
    body = _bodies(kind.__module__).get(kind.__name__, [])
    return {
        field.target.id: " ".join(text.value.value.split())
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
        if isinstance(text.value.value, str)
    }


@cache
def _bodies(module: str) -> dict[str, list[ast.stmt]]:
    """Return the statements of each class of a module; none of one without its source."""
    try:
        source = inspect.getsource(sys.modules[module])
    except (OSError, TypeError):
        source = ""
    return {one.name: one.body for one in ast.parse(source).body if isinstance(one, ast.ClassDef)}
