"""The nodes' own functions, compiled: one text for each formula.

`compiled` takes a plain function of the project and returns it compiled by numba. The functions that it
calls, wherever in the project they are defined, are compiled with it; nothing is rewritten. Neither
`fastmath` nor fused multiply-adds are allowed, so the bits stay those of plain Python.

Machine code is kept in the user's cache folder under a digest of all sources that could matter, so that
a second study, or a second worker, does not compile again and no stale code is ever found.
"""

from __future__ import annotations

import os
import shutil
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from hashlib import blake2b
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType
from typing import Any

import numpy as np

from channel.codec.lead import fly_ticks
from channel.codec.numerics import refuse
from channel.errors import TenbaudError

PACKAGES = ("channel", "plant_sim", "receiver", "transmitter", "tenbaud")

OPTIONS = {"fastmath": False, "error_model": "python", "nogil": True, "no_cfunc_wrapper": True}
"""How everything is compiled: divisions by zero are errors and nothing is reordered, as in Python. No
memory is allocated, and so none is counted, but where a function says so."""

SOURCES = (
    *PACKAGES[:-1],
    *(f"tenbaud.{name}" for name in ("bounds", "build", "config", "design", "flight", "studies")),
)
"""Packages that the figures of a flight depend on."""

BESIDE = (
    "channel/links/endpoints.py",
    *(
        f"tenbaud/studies/{name}.py"
        for name in (
            *("constants", "judging", "tuning", "records", "bench", "families", "quick", "search"),
            *("plots", "run", "table", "study", "study_file", "points", "settings", "progress"),
        )
    ),
)
"""Modules that no figure of a flight depends on."""

KEPT_FOLDERS = 8
KEPT_S = 86_400.0
"""How long machine code is kept unused, and of how many versions of the sources in any case."""

Parts = tuple[tuple[str, Any], ...]
"""Replacements for the placeholders of the flight: (name, compiled function, or a number)."""


class StudiesMissing(TenbaudError):
    """The libraries that studies need are not installed."""


def require(*modules: str) -> None:
    """Raise StudiesMissing, naming the extras, unless these modules can be imported."""
    missing = [name for name in modules if name not in sys.modules and find_spec(name) is None]
    if missing:
        raise StudiesMissing(
            f"studies need {' and '.join(missing)}, not installed here: "
            "pip install 'tenbaud[studies,parquet]'"
        )


@cache
def compiled(
    function: Callable[..., Any],
    parts: Parts = (),
    allocates: bool = False,
    inner: bool = False,
) -> Any:
    """Return a function of this project, compiled, with all of ours that it calls.

    `parts` replace names in functions of the studies; these are kept on disk within the flight alone.
    `allocates`: they make lists; `inner`: only compiled functions call this one.
    """
    if not isinstance(function, FunctionType):
        raise TypeError(f"{function!r} is no plain function and cannot be compiled")
    names = dict(parts)
    for name in function.__code__.co_names:
        value = function.__globals__.get(name)
        if name in names or not isinstance(value, FunctionType) or value is function:
            continue
        package, _, rest = value.__module__.partition(".")
        if value is refuse:
            names[name] = _jit(_refuse, no_cpython_wrapper=True)
        elif hasattr(value, "row_function"):
            names[name] = whole_of(value.row_function)
        elif package in PACKAGES:
            of_flight = rest.startswith("studies") or value is fly_ticks
            names[name] = compiled(value, parts if of_flight else (), allocates, True)
    scope = {**function.__globals__, **names}
    copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
    copy.__module__ = function.__module__
    # The cache knows a function by its name: with other parts, or for inner use, it is another one.
    named = [getattr(part, "__name__", str(part)) for _, part in parts]
    own = "_".join([function.__qualname__, *named, *(["inner"] if inner else [])])
    copy.__qualname__ = copy.__name__ = own
    again = function.__name__ in function.__code__.co_names
    how = {"no_cpython_wrapper": inner, "forceinline": not again}
    # Machine code is kept for sources that its folder stands for.
    outside = function.__module__.partition(".")[0] not in PACKAGES
    outside = outside or any(getattr(one, "from_outside", False) for one in names.values())
    made = _jit(copy, allocates, not outside and not (inner and parts), **how)
    made.from_outside = outside
    if again:  # a function that calls itself
        scope[function.__name__] = made
    return made


def arrays_of(constants: Any) -> Any:
    """Return constants with arrays for their sequences of numbers, which are read at any index."""
    if not hasattr(constants, "_replace"):
        return constants
    rows = {name: value for name, value in constants._asdict().items() if type(value) is tuple}
    numbers = {name: np.array(value) for name, value in rows.items() if isinstance(value[0], float)}
    return constants._replace(**numbers)


@cache
def whole_of(row_function: Callable[..., float]) -> Any:
    """Return what makes a tuple, as long as its first argument, of a function of each entry.

    So is a tick of a model written, or a step of a plant, for any number of states.
    """
    row = compiled(row_function)
    tuple_setitem: Any = import_module("numba.cpython.unsafe.tuple").tuple_setitem

    def whole(first: Any, *others: Any) -> Any:
        after = first
        for index in range(len(first)):
            after = tuple_setitem(after, index, row(first, *others, index))
        return after

    made = named(whole, f"whole_{row_function.__name__}", not row.from_outside)
    made.from_outside = row.from_outside
    return made


@cache
def reader(size: int) -> Any:
    """Return a compiled function that makes a tuple of an array's `size` values."""
    to_fixed_tuple: Any = import_module("numba.np.unsafe.ndarray").to_fixed_tuple

    def read(values: Any) -> Any:
        return to_fixed_tuple(values, size) if size else ()

    return named(read, f"read_{size}")


@cache
def states_read(states: tuple[int, ...]) -> Any:
    """Return a compiled function that reads an output which is a state."""

    def output(state: Any, constants: Any, place: int) -> Any:
        return state[states[place]]

    return named(output, "output_" + "_".join(map(str, states)))


def _refuse(what: str, x: float) -> None:
    """Stand for `channel.codec.numerics.refuse`: writing the number down would take memory."""
    raise ValueError("an argument of sin, cos or exp is out of range")


def named(function: Callable[..., Any], name: str, keep: bool = True) -> Any:
    """Return a function compiled, under a name by which the cache tells it from others."""
    function.__qualname__ = function.__name__ = name
    return _jit(function, keep=keep, forceinline=True)


def _jit(function: Callable[..., Any], allocates: bool = False, keep: bool = True, **more: Any) -> Any:
    numba: Any = import_module("numba")
    others = numba.config.CACHE_LOCATOR_CLASSES
    numba.config.CACHE_LOCATOR_CLASSES = f"{__name__}.{MachineCode.__qualname__}"
    try:
        keep = keep and _cache_folder() is not None
        return numba.njit(**OPTIONS, **more, _nrt=allocates, cache=keep)(function)
    finally:
        numba.config.CACHE_LOCATOR_CLASSES = others


class MachineCode:
    """Where numba keeps the machine code of a function: wherever its source is, in one place.

    So a copy of the project, in another folder or another environment, compiles nothing again.
    """

    def __init__(self, line: int) -> None:
        self._line = line

    @classmethod
    def from_function(cls, function: FunctionType, _file: str) -> MachineCode:
        return cls(function.__code__.co_firstlineno)

    def ensure_cache_path(self) -> None:
        """Do nothing: the folder is there."""

    def get_cache_path(self) -> str:
        return str(_cache_folder())

    def get_source_stamp(self) -> str:
        """Return nothing more: the folder stands for the sources."""
        return ""

    def get_disambiguator(self) -> str:
        return str(self._line)


@cache
def sources_digest() -> str:
    """Return a digest of all sources that the figures of a flight depend on."""
    digest = blake2b(digest_size=12)
    for path in figure_sources():
        digest.update(path.read_bytes())
    return digest.hexdigest()


def figure_sources() -> list[Path]:
    """Return the files that the figures of a flight depend on, always in the same order."""
    found: list[Path] = []
    for package in SOURCES:
        spec = find_spec(package)
        for place in (spec and spec.submodule_search_locations) or ():
            paths = sorted(Path(place).rglob("*.py"))
            found += [path for path in paths if not path.as_posix().endswith(BESIDE)]
    return found


@cache
def _cache_folder() -> Path | None:
    """Return where machine code is kept, None when that cannot be written."""
    try:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(base) / "tenbaud" / sources_digest()
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            prune(folder.parent)
        os.utime(folder)
    except (OSError, RuntimeError):  # the latter for a user without a home, as in containers
        return None
    return folder if os.access(folder, os.W_OK) else None


def prune(base: Path) -> None:
    """Remove the machine code of sources that are in use no more; other processes may do so too."""
    with suppress(OSError):
        folders = sorted(base.iterdir(), key=lambda one: one.stat().st_mtime, reverse=True)
        for folder in folders[KEPT_FOLDERS:]:
            if time.time() - folder.stat().st_mtime > KEPT_S:
                shutil.rmtree(folder, ignore_errors=True)
