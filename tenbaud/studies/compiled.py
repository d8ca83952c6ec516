"""The nodes' own functions, compiled: one text for each formula.

`compiled` takes a plain function of the project and returns it compiled by numba. The functions that it
calls, wherever in the project they are defined, are compiled with it; nothing is rewritten. Neither
`fastmath` nor fused multiply-adds are allowed, so the bits stay those of plain Python.

`machine_code.py` keeps what was compiled.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from types import FunctionType
from typing import Any

import numpy as np

from channel.codec.lead import fly_ticks
from channel.codec.numerics import refuse
from channel.errors import TenbaudError
from tenbaud.studies import machine_code
from tenbaud.studies.linked import part_compiler
from tenbaud.studies.machine_code import PACKAGES, MachineCode

OPTIONS = {"fastmath": False, "error_model": "python", "nogil": True, "no_cfunc_wrapper": True}
"""How everything is compiled: divisions by zero are errors and nothing is reordered, as in Python. No
memory is allocated, and so none is counted, but where a function says so."""

INNER = "_inner"
"""The end of the name of a function that only compiled ones call: Python has no way into it."""

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
    inlined: bool = True,
) -> Any:
    """Return a function of this project, compiled, with all of ours that it calls.

    `parts` replace names in functions of the studies; these are kept on disk within the flight alone.
    `allocates`: they make lists; `inner`: only compiled functions call this one; `inlined`: it is put
    into each of them, which takes long to compile where it is large.
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
            names[name] = whole_of(value.row_function, True)
        elif package in PACKAGES:
            of_flight = rest.startswith("studies") or value is fly_ticks
            names[name] = part(value, parts if of_flight else (), allocates)
    scope = {**function.__globals__, **names}
    copy = FunctionType(function.__code__, scope, function.__name__, function.__defaults__)
    copy.__module__ = function.__module__
    # The cache knows a function by its name: with other parts, or for inner use, it is another one.
    named = [getattr(one, "__name__", str(one)).removesuffix(INNER) for _, one in parts]
    own = "_".join([function.__qualname__, *named]) + (INNER if inner else "")
    copy.__qualname__ = copy.__name__ = own
    again = function.__name__ in function.__code__.co_names
    how: dict[str, Any] = {"no_cpython_wrapper": inner, "forceinline": inlined and not again}
    if inner and not again:
        how |= part_compiler()
    # Machine code is kept for sources that its folder stands for.
    outside = function.__module__.partition(".")[0] not in PACKAGES
    outside = outside or any(getattr(one, "from_outside", False) for one in names.values())
    made = _jit(copy, allocates, not outside and not (inner and parts), **how)
    made.from_outside = outside
    if again:  # a function that calls itself
        scope[function.__name__] = made
    return made


def part(
    function: Callable[..., Any], parts: Parts = (), allocates: bool = False, inlined: bool = True
) -> Any:
    """Return a function of this project, compiled, as a part of others that are."""
    return compiled(function, parts, allocates, True, inlined)


def arrays_of(constants: Any) -> Any:
    """Return constants with arrays for their sequences of numbers, which are read at any index."""
    if not hasattr(constants, "_replace"):
        return constants
    rows = {name: value for name, value in constants._asdict().items() if type(value) is tuple}
    numbers = {name: np.array(value) for name, value in rows.items() if isinstance(value[0], float)}
    return constants._replace(**numbers)


@cache
def whole_of(row_function: Callable[..., float], inner: bool = False) -> Any:
    """Return what makes a tuple, as long as its first argument, of a function of each entry.

    So is a tick of a model written, or a step of a plant, for any number of states. `inner`: only
    compiled functions call it.
    """
    row = part(row_function)
    tuple_setitem: Any = import_module("numba.cpython.unsafe.tuple").tuple_setitem

    def whole(first: Any, *others: Any) -> Any:
        after = first
        for index in range(len(first)):
            after = tuple_setitem(after, index, row(first, *others, index))
        return after

    made = named(whole, f"whole_{row_function.__name__}", not row.from_outside, inner)
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


def named(function: Callable[..., Any], name: str, keep: bool = True, inner: bool = True) -> Any:
    """Return a function compiled, under a name by which the cache tells it from others."""
    function.__qualname__ = function.__name__ = name + (INNER if inner else "")
    how = part_compiler() if inner else {}
    return _jit(function, keep=keep, forceinline=True, no_cpython_wrapper=inner, **how)


def _jit(function: Callable[..., Any], allocates: bool = False, keep: bool = True, **more: Any) -> Any:
    numba: Any = import_module("numba")
    others = numba.config.CACHE_LOCATOR_CLASSES
    numba.config.CACHE_LOCATOR_CLASSES = f"{MachineCode.__module__}.{MachineCode.__qualname__}"
    try:
        keep = keep and machine_code.cache_folder() is not None
        return numba.njit(**OPTIONS, **more, _nrt=allocates, cache=keep)(function)
    finally:
        numba.config.CACHE_LOCATOR_CLASSES = others
