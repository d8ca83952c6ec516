"""The nodes' own functions, compiled: one text for each formula.

`compiled` takes a plain function of this project and returns what numba makes of it. The functions that
it calls, wherever in the project they are defined, are compiled with it; nothing is rewritten. Neither
`fastmath` nor fused multiply-adds are allowed, so the bits stay those of plain Python.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Any

from channel.errors import TenbaudError

PACKAGES = ("channel", "plant_sim", "receiver", "transmitter", "tenbaud")

OPTIONS = {"fastmath": False, "error_model": "python", "nogil": True}
"""How everything is compiled: divisions by zero are errors and nothing is reordered, as in Python."""


class StudiesMissing(TenbaudError):
    """The libraries that studies need are not installed."""


def require(*modules: str) -> None:
    """Raise StudiesMissing, naming the extra, unless these modules can be imported."""
    from importlib.util import find_spec

    missing = [name for name in modules if name not in sys.modules and find_spec(name) is None]
    if missing:
        raise StudiesMissing(
            f"this needs {' and '.join(missing)}, which is not installed: "
            "pip install 'tenbaud[studies,parquet]'"
        )


@cache
def compiled(function: Callable[..., Any], inline: bool = False) -> Any:
    """Return a function of this project, compiled, with all of ours that it calls."""
    from numba import njit

    if not isinstance(function, FunctionType):
        raise TypeError(f"{function!r} is no plain function and cannot be compiled")
    names = {}
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, FunctionType) and value.__module__.split(".")[0] in PACKAGES:
            # Arrays are counted references, and counting them at every call costs more than the call.
            names[name] = compiled(value, value.__module__.startswith("tenbaud.studies"))
    scope = {**function.__globals__, **names}
    copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
    copy.__module__ = function.__module__
    copy.__qualname__ = function.__qualname__
    return njit(**OPTIONS, inline="always" if inline else "never", forceinline=True)(copy)


@cache
def reader(size: int) -> Any:
    """Return a compiled function that makes a tuple of an array's `size` values."""
    from numba import njit
    from numba.np.unsafe.ndarray import to_fixed_tuple

    @njit(**OPTIONS)  # type: ignore[untyped-decorator]
    def read(values):  # type: ignore[no-untyped-def]
        return to_fixed_tuple(values, size)

    return read
