"""The base of every section of the configuration."""

from __future__ import annotations

import json
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, JsonValue, PrivateAttr

from channel.protocol.sabotage import parse_sabotage

Positive = Annotated[float, Field(ge=1e-9, le=1e9)]
AngleRange = Annotated[float, Field(ge=1e-9, le=1000.0)]
NotNegative = Annotated[float, Field(ge=0.0, le=1e9)]
Gain = Annotated[float, Field(ge=0.0, le=1e6)]
Factor = Annotated[float, Field(ge=-1e9, le=1e9)]
Mismatch = Annotated[float, Field(ge=-0.999, le=10.0)]
"""A fraction: -1 would leave nothing of the constant."""
Command = Factor | tuple[Factor, ...]
"""A number for all inputs, or a list with one for each."""
Counts = Annotated[int, Field(ge=-(2**31), lt=2**31)]

OfferedName = Annotated[str, Field(pattern=r"^[A-Za-z_][\w.-]*(:[A-Za-z_]\w*)?$")]
"""A class from outside, `module:Class`, or a name that an installed package offers."""
Options = dict[str, JsonValue]
"""Constructor arguments, beside the context of the flight."""


class Section(BaseModel):
    """Unknown fields are errors; values do not change after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    def as_text(self, **which: Any) -> str:
        """Return the section as JSON in ASCII: the name of a file may have bytes that are no UTF-8."""
        return json.dumps(self.model_dump(mode="json", **which))

    @classmethod
    def of_text(cls, text: str) -> Self:
        """Return the section that `as_text` has written."""
        return cls.model_validate(json.loads(text))


class NamedSections(Section):
    """A section that may hold, beside its fields, sections of single signals by name."""

    model_config = ConfigDict(extra="allow")

    @property
    def by_name(self) -> dict[str, Any]:
        return dict(self.__pydantic_extra__ or {})


class KindSection(Section):
    """A section that comes in kinds."""

    kind: str

    @property
    def stops(self) -> dict[str, tuple[float, float]]:
        """Return the range of each output that has one, beyond which no set-point may be."""
        return {}


class OutsideSection(KindSection):
    """An external class: named here, or offered by an installed package under its name."""

    kind: OfferedName
    """module:Class, or the name that a package offers"""
    options: Options = Field(default_factory=dict)
    """what the class is built with"""


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


def _checked_sabotage(text: str) -> str:
    if text:
        parse_sabotage(text)
    return text


SabotageText = Annotated[str, AfterValidator(_checked_sabotage)]
