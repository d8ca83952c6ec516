"""Parts from outside: a class named `module:Class` in the configuration, loaded and looked at.

A module is looked for in the folder that the command was started in, then where Python always looks.
A class is called with one context object and the options of its section; what it builds must have
what the part's protocol asks for. Every way in which that can go wrong is told in words here, so that
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
from tenbaud.config.load import ConfigError
from tenbaud.config.outside_code import require_allowed
from tenbaud.config.schema import FlightConfig

Interface = Mapping[str, int | None]
"""What an object must have: methods with their number of arguments, attributes with None."""

CONTROLLER: Interface = {"command": 2, "reference_rad": 1}
PLANT: Interface = {"measured_rad": None, "advance": 1}
MODEL: Interface = {
    "state_size": None,
    "correction_size": None,
    "input_size": None,
    "initial": 0,
    "measured": 1,
    "tick": 3,
}
CODER: Interface = {
    "alphabet": None,
    "impulse": None,
    "initial": 0,
    "encode": 3,
    "decode": 3,
    "ranges": 1,
}


class PluginError(ConfigError):
    """A part from outside that cannot be used; the text names field, module, class and fault."""


def build_plugin(
    config: FlightConfig,
    registry: Registry,
    name: str,
    context: object,
    options: Mapping[str, Any],
    interface: Interface,
) -> Any:
    """Return the object that a class from outside builds; PluginError if it is not what is needed.

    `name` is `module:Class` or what an installed package offers. CodeNotAllowed if nobody allowed the
    configuration's code to run.
    """
    require_allowed(config)
    field = registry.field
    found = _load_class(field, name) if ":" in name else _offered(registry, name)
    try:
        part = found(context, **options)
    except Exception as error:  # it is the user's code, and anything may be wrong in it
        raise PluginError(
            f"{field} = {name!r}: {found.__name__}({_call(options)}) failed: "
            f"{type(error).__name__}: {error}. It is called with one context object "
            f"({type(context).__name__}: {', '.join(_names(context))}) and its options."
        ) from error
    faults = [fault for fault in _faults(part, interface) if fault]
    if faults:
        raise PluginError(
            f"{field} = {name!r} is not what is needed here: {'; '.join(faults)}. "
            "docs/extend.md has an example of each part."
        )
    return part


def _load_class(field: str, name: str) -> Any:
    """Return what `module:Class` names; PluginError, with a hint, if there is no such thing."""
    module_name, _, class_name = name.partition(":")
    here = os.getcwd()
    if here not in sys.path:
        sys.path.insert(0, here)
    try:
        module = import_module(module_name)
    except ModuleNotFoundError as error:
        if error.name is not None and not f"{module_name}.".startswith(f"{error.name}."):
            raise PluginError(
                f"{field} = {name!r}: the module {module_name} needs {error.name}, which is not "
                "installed."
            ) from error
        raise PluginError(
            f"{field} = {name!r}: there is no module {module_name}. It is looked for in the folder "
            f"that this command was started in ({here}), in PYTHONPATH and among what is installed."
        ) from error
    except Exception as error:  # the module is the user's code
        raise PluginError(
            f"{field} = {name!r}: the module {module_name} cannot be imported: "
            f"{type(error).__name__}: {error}"
        ) from error
    found = getattr(module, class_name, None)
    if not callable(found):
        classes = [one for one, value in vars(module).items() if inspect.isclass(value)]
        near = difflib.get_close_matches(class_name, classes, 1)
        hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(classes) or 'no class'}."
        raise PluginError(f"{field} = {name!r}: {module_name} has no class {class_name!r}; {hint}")
    return found


def build_part(
    config: FlightConfig,
    registry: Registry,
    name: str,
    context: object,
    options: Mapping[str, Any],
    interface: Interface,
) -> Any:
    """Return a plant or controller: built in as a function of the configuration, or as a class."""
    if name in registry.built_in and not inspect.isclass(part := registry.load(name)):
        return part(config, context)
    return build_plugin(config, registry, name, context, options, interface)


def _offered(registry: Registry, name: str) -> Any:
    try:
        return registry.load(name)
    except RegistryError as error:
        raise PluginError(str(error)) from error


def _faults(part: object, interface: Interface) -> list[str]:
    return [_fault(part, name, count) for name, count in interface.items()]


def _fault(part: object, name: str, arguments: int | None) -> str:
    """Return what is wrong with one member; empty: nothing."""
    if not hasattr(part, name):
        return f"it has no {name}" + ("" if arguments is None else "()")
    if arguments is None:
        return ""
    method = getattr(part, name)
    if not callable(method):
        return f"its {name} is no method"
    try:
        inspect.signature(method).bind(*[None] * arguments)
    except TypeError:
        return f"its {name} must take {arguments} argument(s), not {inspect.signature(method)}"
    except ValueError:  # a builtin whose signature nobody knows
        return ""
    return ""


def _call(options: Mapping[str, Any]) -> str:
    return ", ".join(["context", *(f"{name}={value!r}" for name, value in options.items())])


def _names(context: object) -> list[str]:
    return list(getattr(type(context), "__dataclass_fields__", {}))
