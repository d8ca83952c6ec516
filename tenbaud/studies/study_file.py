"""The study as written in its file; `study` interprets it."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, field_validator, model_validator
from pydantic_core import ErrorDetails

from tenbaud.config.section import Section

Value = bool | int | float | str


class Range(Section):
    """Values between two ends."""

    first: float = Field(alias="from")
    last: float = Field(alias="to")
    steps: Annotated[int, Field(ge=2, le=100_000)] | None = None
    """for a grid: how many values, ends included"""
    scale: Literal["linear", "log"] = "linear"

    @model_validator(mode="after")
    def _sensible(self) -> Range:
        if self.scale == "log" and not (self.first > 0.0 and self.last > 0.0):
            raise ValueError("a range on a log scale has both ends above 0")
        if self.first == self.last:
            raise ValueError(f"the range from {self.first:g} to {self.last:g} holds one value only")
        return self

    def at(self, share: float) -> float:
        """Return the value at a share of the way, 0 to 1."""
        if share in (0.0, 1.0):
            return self.last if share else self.first
        if self.scale == "log":
            return math.exp(math.log(self.first) * (1.0 - share) + math.log(self.last) * share)
        return self.first * (1.0 - share) + self.last * share


class SampleSection(Section):
    """Points within ranges, rather than on a grid."""

    method: Literal["sobol", "random"] = "sobol"
    points: Annotated[int, Field(ge=1, le=1_000_000)]
    seed: Annotated[int, Field(ge=0)] = 1
    settings: dict[str, Range]


class StudyFile(Section):
    """The study as it is written."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$")] = "study"
    description: str = ""
    preset: str | None = None
    config: str | None = None
    seeds: Annotated[int, Field(ge=1, le=1_000_000)] | list[Annotated[int, Field(ge=0, lt=2**63)]] = 1
    engine: Literal["auto", "compiled", "plain"] = "auto"
    chunk_flights: Annotated[int, Field(ge=1, le=1_000_000)] = 100
    """flights that are computed, and kept, together"""
    set: dict[str, Any] = Field(default_factory=dict)
    grid: dict[str, list[Value] | Range] = Field(default_factory=dict)
    sample: SampleSection | None = None

    @field_validator("seeds")
    @classmethod
    def _distinct(cls, seeds: int | list[int]) -> int | list[int]:
        if isinstance(seeds, list) and (not seeds or len(set(seeds)) < len(seeds)):
            raise ValueError("seeds are at least one, and none twice")
        return seeds


def described(error: ValidationError) -> str:
    """Return one line for each field that is wrong, for a person."""
    lines: dict[str, None] = {}
    for detail in error.errors():
        place, message = _described(detail)
        if message:
            lines[f"{place}: {message}"] = None
    return "\n  ".join(lines)


def _described(detail: ErrorDetails) -> tuple[str, str]:
    """Return field and message; an empty one where another branch of a union tells more."""
    where = [str(part) for part in detail["loc"]]
    if where[0] == "grid" and len(where) > 2:
        branch = where.pop(2)
        whole = detail["type"] in ("list_type", "model_type")
        if whole and isinstance(detail["input"], dict | list):
            return "", ""
        if whole or branch.startswith("list["):
            message = "a list of finite numbers, texts, true or false; or a range: from, to, steps"
            return ".".join(where[:2]), message
    place = ".".join(part for part in where if not part.startswith(("list[", "constrained-")))
    if detail["type"] == "extra_forbidden":
        return place, f"unknown; a study has {', '.join(StudyFile.model_fields)}"
    return place, detail["msg"].removeprefix("Value error, ")
