"""The version of this software."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version


@cache
def software_version() -> str:
    """Return the installed version of tenbaud."""
    try:
        return version("tenbaud")
    except PackageNotFoundError:
        return "0+source"
