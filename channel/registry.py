"""Names to objects: the built-in ones, and those that installed packages offer by entry points.

A registry is a table of `name: "module:object"`; nothing is imported before it is asked for. A package
adds to it without a change here, in its own `pyproject.toml`:

    [project.entry-points."tenbaud.links"]
    carrier = "my_package.carrier:CarrierKind"
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from channel.errors import TenbaudError


class RegistryError(TenbaudError, ValueError):
    """A name that nobody offers, or an offer that cannot be loaded; the text says whose it is."""


class Registry:
    """The kinds of one sort of part.

    `field` is the setting that names a kind, for error messages; `group` the group of entry points. A
    name that is built in cannot be replaced from outside. `classes`: the setting takes
    `module:Class` too.
    """

    def __init__(
        self, field: str, group: str, built_in: Mapping[str, str], *, classes: bool = True
    ) -> None:
        self.field = field
        self.classes = classes
        self.group = group
        self.built_in = built_in

    def names(self) -> list[str]:
        """Return every name, those built in first. Imports nothing."""
        return list(dict.fromkeys([*self.built_in, *sorted(self._offered())]))

    def knows(self, name: str) -> bool:
        """Return whether somebody offers this name. Imports nothing."""
        return name in self.built_in or name in self._offered()

    def check(self, name: str) -> str:
        """Return the name; RegistryError, with the nearest one, where nobody offers it."""
        if not self.knows(name):
            raise RegistryError(self.hint(name))
        return name

    def hint(self, name: str) -> str:
        """Return similar names for an unknown one."""
        names = self.names()
        near = difflib.get_close_matches(name, names, 1)
        known = f"known are {', '.join(names)}" + (" and module:Class" if self.classes else "")
        return f"{known}; did you mean {near[0]}?" if near else known

    def load(self, name: str) -> Any:
        """Return the object behind a name; RegistryError where there is none or it cannot be loaded."""
        if name in self.built_in:
            module, _, attribute = self.built_in[name].partition(":")
            return getattr(import_module(module), attribute)
        offers = self._offered().get(name)
        if not offers:
            raise RegistryError(f"{self.field} = {name!r}: {self.hint(name)}")
        if len({offer.value for offer in offers}) > 1:
            owners = " and ".join(_owner(offer) for offer in offers)
            raise RegistryError(
                f"{self.field} = {name!r}: {owners} both offer it; uninstall one of them"
            )
        try:
            return offers[0].load()
        except Exception as error:  # it is another package's code, and anything may be wrong in it
            raise RegistryError(
                f"{self.field} = {name!r}: {_owner(offers[0])} offers it as {offers[0].value}, which "
                f"cannot be loaded: {type(error).__name__}: {error}. Repair or uninstall that package."
            ) from error

    def offered_by(self, name: str) -> str:
        """Return the packages that offer a name, and as what. Imports nothing."""
        offers = self._offered().get(name, [])
        return " and ".join(f"{_owner(offer)} offers as {offer.value}" for offer in offers)

    def _offered(self) -> dict[str, list[EntryPoint]]:
        offered: dict[str, list[EntryPoint]] = {}
        for offer in entry_points(group=self.group):
            if offer.name not in self.built_in:
                offered.setdefault(offer.name, []).append(offer)
        return offered


def _owner(offer: EntryPoint) -> str:
    return "an unnamed package" if offer.dist is None else f"the package {offer.dist.name}"
