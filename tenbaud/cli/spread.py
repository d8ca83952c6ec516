"""Options that several commands share, written once as the fields of a dataclass."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, get_type_hints


def spread(command: Callable[..., None]) -> Callable[..., None]:
    """Let typer see the fields of a command's dataclass arguments as options of the command.

    The command itself gets each dataclass whole. Its own options come after those of the dataclass.
    """
    hints = get_type_hints(command, include_extras=True)
    groups = {name: kind for name, kind in hints.items() if hasattr(kind, "__dataclass_fields__")}
    parameters: list[inspect.Parameter] = []
    for name, parameter in inspect.signature(command).parameters.items():
        if name not in groups:
            parameters.append(_option(name, hints[name], parameter.default))
            continue
        fields = get_type_hints(groups[name], include_extras=True)
        for field_name, field in groups[name].__dataclass_fields__.items():
            parameters.append(_option(field_name, fields[field_name], field.default))

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


def _option(name: str, hint: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=hint)
