"""Coder constants that suit an identified plant, by the tuner's quick form on the record itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from channel.errors import TenbaudError
from tenbaud.config.load import merged
from tenbaud.identification.flown import replayed


def with_coder(values: Mapping[str, Any]) -> tuple[dict[str, Any], str]:
    """Return settings with a coder fitted to their record, and a note where it could not be.

    Then the coder stays that of the preset, or as it was designed for a linear model.
    """
    settings = dict(values)
    try:
        from tenbaud.studies.quick import quick_coder

        found = quick_coder(replayed(settings))
    except ImportError as error:
        missing = f"{error.name} is missing: install tenbaud[studies]"
        return settings, f"the coder was not fitted to the record, as {missing}"
    except TenbaudError as error:
        return settings, f"the coder was not fitted to the record: {error}"
    return merged(settings, found.sections), ""
