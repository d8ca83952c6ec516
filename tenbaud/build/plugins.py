"""External parts: a class named `module:Class` in the configuration, loaded and checked.

A module is looked for in the folder that the command was started in, then where Python always looks.
A class is called with one context object and the options of its section; what it builds must have
what the part's protocol asks for. Every error of that kind gets a message here, so that
nobody has to read a traceback from the middle of a flight.
"""

from __future__ import annotations

import difflib
import inspect
import os
import sys
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from channel.registry import Registry, RegistryError
from tenbaud.build.parts import PartError, check_part
from tenbaud.config.outside_code import is_object, require_allowed
from tenbaud.config.schema import FlightConfig


def build_part(
    config: FlightConfig,
    registry: Registry,
    name: str,
    context: object,
    options: Mapping[str, Any],
    protocol: type,
) -> Any:
    """Return the object built by the function or class of this name; PartError if it is unsuitable.

    `name` is built in, `module:Class` or what an installed package offers. CodeNotAllowed unless
    the user allowed the configuration's code to run.
    """
    ours = name in registry.built_in
    if ours and not inspect.isclass(part := registry.load(name)):
        return part(config, context)
    require_allowed(config)
    field = registry.field
    if is_object(name):
        raise PartError(
            f"{field} = {name!r} was an object in a program, and a recording does not keep objects: "
            "run that program again, or name its class as module:Class"
        )
    found = _load_class(field, name) if ":" in name else _offered(registry, name)
    return build_class(f"{field} = {name!r}", found, context, options, protocol, ours=ours)


def build_class(
    where: str,
    found: Any,
    context: object,
    options: Mapping[str, Any],
    protocol: type,
    *,
    ours: bool = False,
) -> Any:
    """Return the object of a class, called with its context; PartError if it is not what is needed.

    `ours`: a class of the package, whose ValueErrors are about its settings.
    """
    try:
        part = found(context, **options)
    except Exception as error:  # it is the user's code, and anything may be wrong in it
        if ours and isinstance(error, ValueError):
            raise PartError(f"{where}: {error}") from error
        call = ", ".join(["context", *(f"{name}={value!r}" for name, value in options.items())])
        names = ", ".join(getattr(type(context), "__dataclass_fields__", ()))
        raise PartError(
            f"{where}: {found.__name__}({call}) failed: {type(error).__name__}: {error}. "
            f"It is called with one context object ({type(context).__name__}: {names}) and its options."
        ) from error
    check_part(where, part, protocol)
    return part


def _load_class(field: str, name: str) -> Any:
    """Return the object that `module:Class` names; PartError, with a hint, if there is none."""
    module_name, _, class_name = name.partition(":")
    here = os.getcwd()
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is not None and not f"{module_name}.".startswith(f"{error.name}."):
            raise PartError(
                f"{field} = {name!r}: the module {module_name} needs {error.name}, which is not "
                "installed."
            ) from error
        raise PartError(
            f"{field} = {name!r}: there is no module {module_name}. It is searched in the folder in "
            f"which this command was started ({here}), in PYTHONPATH and among the installed packages."
        ) from error
    except Exception as error:  # the module is the user's code
        raise PartError(
            f"{field} = {name!r}: the module {module_name} cannot be imported: "
            f"{type(error).__name__}: {error}"
        ) from error
    found = getattr(module, class_name, None)
    if not callable(found):
        classes = [one for one, value in vars(module).items() if inspect.isclass(value)]
        near = difflib.get_close_matches(class_name, classes, 1)
        hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(classes) or 'no class'}."
        raise PartError(f"{field} = {name!r}: {module_name} has no class {class_name!r}; {hint}")
    return found


def _offered(registry: Registry, name: str) -> Any:
    try:
        return registry.load(name)
    except RegistryError as error:
        raise PartError(str(error)) from error
