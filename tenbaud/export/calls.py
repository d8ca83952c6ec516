"""Calls: of functions of the same language, and of the few that Python brings."""

from __future__ import annotations

import ast
import builtins
import math
from collections.abc import Iterator, Sequence
from types import FunctionType
from typing import Any

from channel.codec.numerics import refuse
from tenbaud.export.expressions import POWER, Expressions
from tenbaud.export.scope import Written
from tenbaud.export.source import source_of
from tenbaud.export.values import (
    DOUBLE,
    TABLE,
    TRUTH,
    WHOLE,
    Array,
    Pack,
    Rows,
    Scalar,
    Shape,
    Static,
    Value,
)

DIFFERING: dict[Any, str] = {
    builtins.sum: "its rounding changed in Python 3.12: write the additions out",
    builtins.min: "write the comparison out, so that ties, zeros and NaN are decided in sight",
    builtins.max: "write the comparison out, so that ties, zeros and NaN are decided in sight",
    builtins.abs: "write the comparison out, so that the sign of zero is decided in sight",
    builtins.round: "use math.floor(x + 0.5), which has one reading",
    builtins.pow: POWER,
}
"""Functions whose results differ between machines or are not plain in the text."""
REFUSED: dict[Any, str] = {
    **DIFFERING,
    builtins.range: "only `for` goes over a range",
    builtins.enumerate: "go over range(len(...)) instead",
}
OWN = {
    math.sqrt: ("arithmetic_sqrt", DOUBLE, DOUBLE),
    math.floor: ("arithmetic_floor", DOUBLE, WHOLE),
    math.isfinite: ("arithmetic_is_finite", DOUBLE, TRUTH),
    builtins.int: ("arithmetic_whole", DOUBLE, WHOLE),
}


class Calls(Expressions):
    """Evaluates calls."""

    def _call(self, node: ast.Call) -> Value:
        called = self.value(node.func)
        if not isinstance(called, Static):
            self.refuse(node, "what is called must be known beforehand")
        function = called.value
        if function is refuse:
            self.require_statement(node)
            self.emit("arithmetic_fault = true;")
            return Static(None)
        if isinstance(function, Rows):
            return self._rows(node, function)
        if isinstance(function, FunctionType):
            return self._function(node, function, self._arguments(node, function))
        reason = next((why for one, why in REFUSED.items() if one is function), "")
        if not reason and function not in (len, float, *OWN):
            reason = "only sqrt, floor and isfinite give equal bits everywhere"
        if reason or node.keywords or len(node.args) != 1:
            self.refuse(node, f"{called.name}(): {reason or 'takes one value'}")
        return self._own(node, function, self.value(node.args[0]))

    def _own(self, node: ast.Call, function: Any, value: Value) -> Value:
        if function is len:
            if isinstance(value, Static):
                return Static(len(value.value))
            if isinstance(value, Pack):
                return Static(len(value.items))
            return Static(self.array(node, value).shape[0])
        if function is float:
            return Scalar(DOUBLE, self.as_kind(node, value, DOUBLE))
        name, taken, given = OWN[function]
        if isinstance(value, Static):
            return Static(function(value.value))
        one = self.scalar(node, value)
        if given == WHOLE and one.kind == WHOLE:
            return one
        return Scalar(given, f"{name}({self.as_kind(node, one, taken)})")

    def _arguments(self, node: ast.Call, function: FunctionType) -> list[Value]:
        """Return a value for each argument, defaults included."""
        names = [one.arg for one in source_of(function).tree.args.args]
        given: dict[str, Value] = dict(zip(names, [self.value(one) for one in node.args], strict=False))
        given |= {one.arg or "**": self.value(one.value) for one in node.keywords}
        defaults = function.__defaults__ or ()
        for name, default in zip(names[len(names) - len(defaults) :], defaults, strict=True):
            given.setdefault(name, Static(default, name))
        if set(given) != set(names) or len(node.args) > len(names):
            self.refuse(node, f"{function.__name__}() takes {', '.join(names) or 'nothing'}")
        return [given[name] for name in names]

    def _rows(self, node: ast.Call, rows: Rows) -> Value:
        """Return a state of which each entry is a call."""
        self.require_statement(node)
        arguments = [self.value(one) for one in node.args]
        state = self.array(node, arguments[0])
        name, at = self.memory(state.kind, state.shape[0]), self.temporary()
        with self.block(f"for (int32_t {at} = 0; {at} < {state.shape[0]}; {at}++)"):
            row = Scalar(WHOLE, at, 0, state.shape[0] - 1)
            entry = self._function(node, rows.row_function, [*arguments, row])
            self.emit(f"{name}[{at}] = {self.as_kind(node, entry, state.kind)};")
        return Array(state.kind, name, state.shape, is_stable=True)

    def _function(self, node: ast.Call, function: Any, arguments: Sequence[Value]) -> Value:
        """Call a function of the program; what it makes of known values alone is known too."""
        if all(isinstance(one, Static) for one in arguments):
            try:
                return Static(function(*[one.value for one in arguments if isinstance(one, Static)]))
            except (ArithmeticError, LookupError, TypeError, ValueError) as error:
                self.refuse(node, f"{function.__name__}(): {error}")
        prepared = [self._prepared(node, one) for one in arguments]
        if source_of(function).calls_itself:
            # Its depth is a number like another: not a function for each.
            prepared = [self.scalar(node, one) if _is_whole(one) else one for one in prepared]
        callee = self.program.function(function, prepared)
        texts = self._passed(node, callee, prepared)
        returns = callee.returns
        if returns.kind == "":
            self.require_statement(node)
            self.emit(f"{callee.name}({', '.join(texts)});")
            return Static(None)
        if callee.written:
            # C does not say in which order it evaluates the parts of an expression.
            self.require_statement(node)
        if not returns.shape and not returns.items:
            return self._kept(node, callee, Scalar(returns.kind, f"{callee.name}({', '.join(texts)})"))
        self.require_statement(node)
        if returns.shape:
            made = Array(
                returns.kind, self.memory(returns.kind, _size(returns)), returns.shape, is_stable=True
            )
            self.emit(f"{callee.name}({', '.join([*texts, made.text])});")
            return made
        kind, name = self.program.struct(returns), self.temporary()
        self.declare(name, f"{kind} {name}")
        self.emit(f"{name} = {callee.name}({', '.join(texts)});")
        return self._parts(returns, name)

    def _kept(self, node: ast.Call, callee: Written, value: Scalar) -> Scalar:
        """Return the result; of a call that writes it is taken at once."""
        if not callee.written:
            return value
        name = self.temporary()
        self.declare(name, f"{value.kind} {name}")
        self.emit(f"{name} = {value.text};")
        return Scalar(value.kind, name)

    def _parts(self, returns: Shape, text: str) -> Pack:
        return Pack(
            tuple(
                [
                    Array(one.kind, f"{text}.f{at}", one.shape, is_stable=True)
                    if one.shape
                    else self._parts(one, f"{text}.f{at}")
                    if one.items
                    else Scalar(one.kind, f"{text}.f{at}")
                    for at, one in enumerate(returns.items)
                ]
            )
        )

    def _prepared(self, node: ast.Call, value: Value) -> Value:
        """Return an argument as it is passed: numbers of one kind together in memory."""
        if not isinstance(value, Pack):
            return value
        if value.items and all(isinstance(one, Scalar) for one in value.items):
            return self.array(node, value)
        return Pack(tuple([self._prepared(node, one) for one in value.items]))

    def _passed(self, node: ast.Call, callee: Written, arguments: Sequence[Value]) -> list[str]:
        """Return the arguments in C: nothing for what is known beforehand, but for its numbers."""
        texts: list[str] = []
        for one in [leaf for argument in arguments for leaf in leaves(argument)]:
            if isinstance(one, Array):
                if len(texts) in callee.written:
                    self.write_to(node, one)
                texts.append(one.text)
            elif isinstance(one, Scalar) or isinstance(getattr(one, "value", None), float):
                texts.append(self.scalar(node, one).text)
        return texts

    def write_to(self, node: ast.AST, array: Array) -> None:
        """Note that memory is written to."""
        if array.root == TABLE:
            self.refuse(node, "a constant is written to")
        if array.root:
            self.written.add(array.root)


def leaves(value: Value) -> Iterator[Value]:
    """Yield the values that an argument consists of."""
    if isinstance(value, Pack):
        for one in value.items:
            yield from leaves(one)
    else:
        yield value


def _is_whole(value: Value) -> bool:
    return isinstance(value, Static) and isinstance(value.value, int)


def _size(shape: Shape) -> int:
    return math.prod(shape.shape)
