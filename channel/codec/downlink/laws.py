"""The laws that can be mirrored: those of the presets, and any that keeps to the rules.

A law from outside is checked before it flies: it must be a pure function of its arguments, give plain
floats of the right number, and keep to the codec's arithmetic as far as its code shows.
"""

from __future__ import annotations

import dis
import math
from types import FunctionType, ModuleType
from typing import NamedTuple

from channel.codec.codec import Model, Vector
from channel.codec.downlink.mirrored import Law
from channel.codec.laws import FeedbackLaw, PidConstants, feedback_command, pid_command

FUNCTIONS_REFUSED = ("sum", "min", "max", "abs", "round", "pow", "hash", "id", "open", "eval", "exec")
MATH_ALLOWED = ("sqrt", "floor", "isfinite")
PACKAGES_ALLOWED = ("channel", "builtins")


class MirroredFeedback:
    """A `Law`: feedback of all states, with integrals of the outputs' errors. Memory: the integrals."""

    def __init__(self, law: FeedbackLaw, command_max: Vector, tick_s: float) -> None:
        self._law = law
        self._command_max = command_max
        self._tick_s = tick_s
        self._outputs = len(law.forward[0])

    def initial(self) -> Vector:
        return (0.0,) * self._outputs

    def command(
        self, memory: Vector, targets: Vector, outputs: Vector, state: Vector
    ) -> tuple[Vector, Vector]:
        """Return (command, memory after it); ValueError for a state that is not finite."""
        integrals = list(memory)
        wanted = [0.0] * len(self._law.base)
        if not feedback_command(
            self._law, integrals, targets, outputs, state, self._command_max, self._tick_s, wanted
        ):
            raise ValueError(f"the law was given the state {state}; it must be finite")
        return tuple(wanted), tuple(integrals)


class MirroredLoop(NamedTuple):
    """One loop of `MirroredPid`."""

    constants: PidConstants
    output: int
    rate: int
    """the state that is the output's rate; -1: its change from tick to tick"""
    follows: bool = True
    """whether it has the output's set-point; else 0, to which a loop that steers it adds"""


class MirroredPid:
    """A `Law`: PID loops. Memory: each loop's integral, its last output, and whether there is one."""

    def __init__(
        self, loops: tuple[MirroredLoop, ...], command_max: Vector, bias: Vector, tick_s: float
    ) -> None:
        self._loops = loops
        self._constants = tuple([loop.constants for loop in loops])
        self._command_max = command_max
        self._bias = bias
        self._tick_s = tick_s

    def initial(self) -> Vector:
        return (0.0,) * (2 * len(self._loops) + 1)

    def command(
        self, memory: Vector, targets: Vector, outputs: Vector, state: Vector
    ) -> tuple[Vector, Vector]:
        """Return (command, memory after it); ValueError for a state that is not finite."""
        count = len(self._loops)
        integrals = list(memory[:count])
        errors, rates, last = [0.0] * count, [0.0] * count, [0.0] * count
        for place in range(count):
            loop = self._loops[place]
            value = outputs[loop.output]
            errors[place] = (targets[loop.output] if loop.follows else 0.0) - value
            if loop.rate >= 0:
                rates[place] = state[loop.rate]
            else:
                last[place] = value
                if memory[-1] > 0.0:
                    rates[place] = (value - memory[count + place]) / self._tick_s
        wanted = list(self._bias)
        if not pid_command(self._constants, integrals, errors, rates, self._command_max, wanted):
            raise ValueError(f"the law was given the state {state}; it must be finite")
        return tuple(wanted), (*integrals, *last, 1.0)


def check_law(law: Law, model: Model) -> None:
    """Raise ValueError, saying what and where, for a law that two machines need not agree on."""
    where = type(law).__name__
    found = _findings(getattr(law.command, "__func__", law.command), set())
    if found:
        raise ValueError(f"the law {where} cannot be mirrored: " + "; ".join(found))
    state = model.initial()
    outputs = model.measured(state)
    memory = law.initial()
    rows = []
    for number in range(1, 9):
        moved = tuple([value + 0.01 * number for value in state])
        targets = tuple([0.1 * number for _ in outputs])
        rows.append((memory, targets, tuple([value + 0.01 * number for value in outputs]), moved))
        command, memory = law.command(*rows[-1])
        _check_floats(f"the command of the law {where}", command, model.input_size)
        _check_floats(f"the memory of the law {where}", memory, len(law.initial()))
    first = [law.command(*row) for row in rows]
    again = [law.command(*row) for row in reversed(rows)]
    for number, (one, other) in enumerate(zip(first, reversed(again), strict=True)):
        if one != other:
            raise ValueError(
                f"the law {where} gave {one[0]} and then {other[0]} for the same arguments (vector "
                f"{number}); keep all that it remembers in its memory, and use neither clock nor chance"
            )


def _check_floats(what: str, values: object, count: int) -> None:
    if not isinstance(values, tuple) or len(values) != count:
        raise ValueError(f"{what} is {values!r}; a tuple of {count} floats is needed")
    for value in values:
        if type(value) is not float or not math.isfinite(value):
            raise ValueError(f"{what} is {values!r}; plain finite floats are needed")


def _findings(function: object, seen: set[object]) -> list[str]:
    """Return what in a function, and in those that it calls, is outside the codec's arithmetic."""
    if not isinstance(function, FunctionType) or function in seen:
        return []
    seen.add(function)
    if function.__module__.partition(".")[0] in PACKAGES_ALLOWED:
        return []
    found = []
    line = function.__code__.co_firstlineno
    module_is_math = False
    for one in dis.get_instructions(function):
        here = getattr(one, "line_number", one.starts_line)  # from Python 3.13 on it is the former
        line = here if type(here) is int else line
        reason = ""
        name = one.argval
        if one.opname == "BINARY_OP" and one.argrepr.rstrip("=") in ("**", "@", "%", "//"):
            reason = f"uses {one.argrepr}"
        elif one.opname == "LOAD_GLOBAL":
            value = function.__globals__.get(name)
            module_is_math = value is math
            if name in FUNCTIONS_REFUSED:
                reason = f"uses {name}()"
            elif isinstance(value, ModuleType) and value is not math:
                reason = f"uses the module {value.__name__}"
            elif getattr(value, "__module__", "") == "math" and name not in MATH_ALLOWED:
                reason = f"uses math.{name}"
            elif isinstance(value, FunctionType):
                found += _findings(value, seen)
        elif one.opname in ("LOAD_ATTR", "LOAD_METHOD"):
            if module_is_math and name not in MATH_ALLOWED:
                reason = f"uses math.{name}"
            module_is_math = False
        if reason:
            found.append(f"line {line} of {function.__qualname__} {reason}")
    return found
