"""The functions of a program, each written once for every kind of arguments that it is called with.

Constants are part of the function: what is an argument in Python and known beforehand is none in C, but
for numbers with a fraction, for which nothing would be gained.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tenbaud.export.scope import Shared, Written
from tenbaud.export.source import Source, source_of
from tenbaud.export.statements import SCALARS, Statements
from tenbaud.export.values import (
    DOUBLE,
    Array,
    Pack,
    Scalar,
    Shape,
    Static,
    Value,
)

FUNCTIONS_MAX = 500


class Program(Shared):
    """Tables, types and functions, in the order in which C needs them."""

    def __init__(self) -> None:
        super().__init__()
        self.functions: dict[tuple[object, ...], Written] = {}
        self._order: list[Written] = []
        self._kept: list[object] = []
        """what is known by its identity"""

    def text(self) -> str:
        tables = [
            f"static const {kind} {name}[] = {{{', '.join(numbers)}}};"
            for (kind, numbers), name in self.tables.items()
        ]
        prototypes = [f"{one.prototype};" for one in self._order]
        return "\n".join(
            [*self.structs.values(), "", *tables, "", *prototypes, ""]
            + [one.text for one in self._order]
        )

    def function(self, function: Any, arguments: Sequence[Value], name: str = "") -> Written:
        """Return a function for arguments of these types, written if it is not yet, with this name."""
        key = (id(function), *[self._key(one) for one in arguments])
        found = self.functions.get(key)
        if found is None:
            self._kept.append(function)
            found = self._write(key, source_of(function), arguments, name)
        return found

    def _write(
        self, key: tuple[object, ...], source: Source, arguments: Sequence[Value], name: str
    ) -> Written:
        if len(self.functions) >= FUNCTIONS_MAX:
            raise source.error(source.tree, f"more than {FUNCTIONS_MAX} functions: a call without end?")
        module = source.function.__module__.rpartition(".")[2]
        name = self.free(name or f"{module}_{source.function.__name__.strip('_')}")
        made = Written(name, annotated(source) or Shape(""))
        self.functions[key] = made
        writer = Statements(self, source)
        writer.returns = annotated(source)
        names = [one.arg for one in source.tree.args.args]
        given = [
            taken
            for name, one in zip(names, arguments, strict=True)
            for taken in take(writer, name, one)
        ]
        ends = writer.body(source.tree.body)
        made.returns = writer.returns or Shape("")
        if not ends and made.returns.kind:
            writer.refuse(source.tree, f"{source.function.__name__} may end without a value")
        made.written = {at for at, one in enumerate(given) if one.name in writer.written}
        if made.written and source.calls_itself:
            writer.refuse(source.tree, "a function that calls itself writes to no argument")
        self._finish(made, source, writer, given)
        return made

    def _finish(self, made: Written, source: Source, writer: Statements, given: list[Argument]) -> None:
        returns = made.returns
        parameters = [one.declaration(one.name in writer.written) for one in given]
        kind = returns.kind or "void"
        if returns.shape:
            kind = "void"
            parameters.append(f"{returns.kind} *result")
        elif returns.items:
            kind = self.struct(returns)
        made.prototype = f"static {kind} {made.name}({', '.join(parameters) or 'void'})"
        lines = [f"/* {source.name} */", made.prototype, "{", *writer.declarations(), *writer.lines]
        made.text = "\n".join([*lines, "}", ""])
        self._order.append(made)

    def _key(self, value: Value) -> object:
        match value:
            case Static(value=float()):
                return DOUBLE
            case Static(value=bool() | int() | str() | None as known):
                return type(known), known
            case Static():
                self._kept.append(value.value)
                return id(value.value)
            case Scalar():
                return value.kind
            case Array():
                return value.kind, value.shape
            case Pack():
                return tuple([self._key(one) for one in value.items])


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument in C."""

    name: str
    kind: str
    is_pointer: bool

    def declaration(self, is_written: bool) -> str:
        if not self.is_pointer:
            return f"{self.kind} {self.name}"
        return f"{'' if is_written else 'const '}{self.kind} *{self.name}"


def take(writer: Statements, name: str, value: Value) -> list[Argument]:
    """Let a name stand for an argument; return the arguments in C."""
    changes = writer.stores[name] > 1
    own = writer.own_name(name)
    taken: list[Argument] = []
    value = _received(own + ("_given" if changes else ""), value, taken)
    if not changes:
        writer.names[name] = value
        return taken
    if isinstance(value, Array):
        writer.declare(own, f"{value.kind} {own}[{max(value.size, 1)}]")
        writer.copy(own, value)
        writer.names[name] = Array(value.kind, own, value.shape)
    else:
        one = writer.scalar(writer.source.tree, value)
        writer.declare(own, f"{one.kind} {own}")
        writer.emit(f"{own} = {one.text};")
        writer.names[name] = Scalar(one.kind, own)
    return taken


def _received(name: str, value: Value, taken: list[Argument]) -> Value:
    match value:
        case Static(value=float()):
            taken.append(Argument(name, DOUBLE, False))
            return Scalar(DOUBLE, name)
        case Static():
            return value
        case Scalar():
            taken.append(Argument(name, value.kind, False))
            return Scalar(value.kind, name)
        case Array():
            taken.append(Argument(name, value.kind, True))
            return Array(value.kind, name, value.shape, name, is_list=True, is_stable=True)
        case Pack(items=items):
            return Pack(tuple([_received(f"{name}_{at}", one, taken) for at, one in enumerate(items)]))


def annotated(source: Source) -> Shape | None:
    """Return what an annotation says of a function that returns one number, or nothing."""
    match source.tree.returns:
        case ast.Name(id=name) if name in SCALARS:
            return Shape(SCALARS[name])
        case ast.Constant(value=None):
            return Shape("")
    return None
