"""Permission to import the classes of a configuration: a mark beside it, which no file can set."""

from __future__ import annotations

from typing import Self

from pydantic import PrivateAttr

from tenbaud.config.section import Section


class CodePermission(Section):
    """A configuration that remembers whether its classes from outside may run.

    As it is read, they may not. A copy remembers; what goes through text forgets.
    """

    _code_allowed: bool = PrivateAttr(default=False)

    @property
    def code_allowed(self) -> bool:
        """Return whether the classes from outside that it names may be imported."""
        return self._code_allowed

    def allowing_code(self) -> Self:
        """Return the same configuration, its classes from outside allowed to run."""
        allowed = self.model_copy()
        allowed._code_allowed = True
        return allowed

    def __eq__(self, other: object) -> bool:
        """Return whether two configurations say the same; what is allowed is no part of that."""
        return isinstance(other, CodePermission) and self.model_dump() == other.model_dump()
