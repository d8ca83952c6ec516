"""Fly a helicopter over a ten-baud wire.

For work in Python: `Run` reads a recorded flight, `fly` flies one. Both are loaded when they are
first used, so that `import tenbaud` and the command line stay quick.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tenbaud.flight.fly import fly
    from tenbaud.recording.run import Run

__all__ = ["Run", "fly"]

_HOMES = {"Run": "tenbaud.recording.run", "fly": "tenbaud.flight.fly"}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'tenbaud' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
