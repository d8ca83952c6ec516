"""One function while it is written: its names, its memory, its lines of C."""

from __future__ import annotations

import ast
import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NoReturn

from tenbaud.export.source import Source
from tenbaud.export.values import (
    DOUBLE,
    KINDS,
    ORDER,
    TABLE,
    TRUTH,
    Array,
    Pack,
    Scalar,
    Shape,
    Static,
    Value,
    literal,
    shape_of,
    table_of,
)

KEYWORD = re.compile(
    "auto|bool|break|case|char|const|continue|default|do|double|else|enum|extern|false|float|for|goto|if"
    "|inline|int|long|register|restrict|result|return|short|signed|sizeof|static|struct|switch|true"
    "|typedef|union|unsigned|void|volatile|while"
)


@dataclass(slots=True)
class Written:
    """A function in C."""

    name: str
    returns: Shape
    written: set[int] = field(default_factory=set)
    """places of the arguments, in C, that it writes to"""
    prototype: str = ""
    text: str = ""


class Shared(ABC):
    """What all functions of a program share: tables, types and names."""

    def __init__(self) -> None:
        self.tables: dict[tuple[str, tuple[str, ...]], str] = {}
        self.structs: dict[str, str] = {}
        # Those of codec.h: a module of that name may be translated too.
        self._names: set[str] = {"codec_is_estimate", "codec_limited", "codec_simulate"}

    @abstractmethod
    def function(self, function: Any, arguments: Sequence[Value]) -> Written:
        """Return a function for arguments of these types, written if it is not yet."""

    def table(self, kind: str, values: Sequence[Any], name: str) -> str:
        """Return the name of a table of constants."""
        texts = tuple([literal(float(one) if kind == DOUBLE else one) for one in values] or ["0"])
        if (kind, texts) not in self.tables:
            self.tables[kind, texts] = self.free(f"table_{name}" if name else "table")
        return self.tables[kind, texts]

    def struct(self, shape: Shape) -> str:
        """Return the name of a type for several values."""
        name = f"struct values_{shape.tag}"
        if name not in self.structs:
            fields = []
            for at, one in enumerate(shape.items):
                kind = self.struct(one) if one.items else one.kind
                sizes = "".join([f"[{size}]" for size in one.shape])
                fields.append(f"{kind} f{at}{sizes};")
            self.structs[name] = f"{name} {{ {' '.join(fields)} }};"
        return name

    def free(self, name: str) -> str:
        at, found = 1, name
        while found in self._names:
            at += 1
            found = f"{name}_{at}"
        self._names.add(found)
        return found


class Scope:
    """Names, declarations and lines of a function."""

    def __init__(self, program: Shared, source: Source) -> None:
        self.program = program
        self.source = source
        self.names: dict[str, Value] = {}
        self.lines: list[str] = []
        self.declared: dict[str, tuple[str, str]] = {}
        """per name in C: its declaration, and the argument that it points into"""
        self.written: set[str] = set()
        """arguments that are written to"""
        self.stores = source.stores()
        self.loop_names = source.loop_names()
        self._indent = 1
        self._temporaries = 0
        self._conditional = 0

    def refuse(self, node: ast.AST, what: str) -> NoReturn:
        raise self.source.error(node, what)

    def emit(self, line: str) -> None:
        self.lines.append("    " * self._indent + line)

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        self.emit(head + " {")
        self._indent += 1
        yield
        self._indent -= 1
        self.emit("}")

    @contextmanager
    def conditional(self) -> Iterator[None]:
        """What is evaluated within may not be evaluated at all: it has to fit one expression."""
        self._conditional += 1
        yield
        self._conditional -= 1

    def require_statement(self, node: ast.AST) -> None:
        if self._conditional:
            self.refuse(node, "a part of a condition that makes a vector: give it a name before")

    # Names in C

    def own_name(self, name: str) -> str:
        return f"{name}_" if KEYWORD.fullmatch(name) or name.startswith("_") else name

    def temporary(self) -> str:
        self._temporaries += 1
        return f"t{self._temporaries}_"

    def declare(self, name: str, declaration: str, root: str = "", node: ast.AST | None = None) -> None:
        known = self.declared.setdefault(name, (declaration, root))
        if known[0] != declaration:
            self.refuse(
                node or self.source.tree,
                f"{name.rstrip('_')} is `{known[0]}` before and `{declaration}` here: "
                "a name stands for one type of value",
            )

    def memory(self, kind: str, size: int) -> str:
        name = self.temporary()
        self.declare(name, f"{kind} {name}[{max(size, 1)}]")
        return name

    def declarations(self) -> list[str]:
        return [
            f"    {'const ' if root and root not in self.written else ''}{text};"
            for text, root in self.declared.values()
        ]

    # Values

    def shape(self, node: ast.AST, value: Value) -> Shape:
        try:
            return shape_of(value)
        except TypeError as error:
            self.refuse(node, str(error))

    def scalar(self, node: ast.AST, value: Value) -> Scalar:
        match value:
            case Scalar():
                return value
            case Static(value=bool() | int() | float() as number):
                try:
                    text = literal(number)
                except ValueError as error:
                    self.refuse(node, str(error))
                low = None if isinstance(number, float) else int(number)
                return Scalar(KINDS[type(number)], text, low, low)
        self.refuse(node, "one number is needed here")

    def as_kind(self, node: ast.AST, value: Value, kind: str) -> str:
        """Return the text of a number of a kind that holds it."""
        one = self.scalar(node, value)
        if one.kind == kind:
            return one.text
        if ORDER.index(one.kind) > ORDER.index(kind):
            self.refuse(node, f"a value of type {one.kind} where {kind} is expected")
        if isinstance(value, Static) and kind == DOUBLE:
            return literal(float(value.value))
        return f"({kind})({one.text})"

    def truth(self, node: ast.AST, value: Value) -> str:
        one = self.scalar(node, value)
        return one.text if one.kind == TRUTH else f"({one.text} != 0)"

    def array(self, node: ast.AST, value: Value) -> Array:
        """Return a value as numbers in memory."""
        match value:
            case Array():
                return value
            case Static(value=tuple() as numbers):
                try:
                    kind, shape, flat = table_of(numbers)
                    text = self.program.table(kind, flat, value.name)
                except (TypeError, ValueError) as error:
                    self.refuse(node, str(error))
                return Array(kind, text, shape, TABLE, is_stable=True)
            case Pack(items=items) if items:
                self.require_statement(node)
                scalars = [self.scalar(node, one) for one in items]
                kind = max([one.kind for one in scalars], key=ORDER.index)
                name = self.memory(kind, len(items))
                for at, one in enumerate(scalars):
                    self.emit(f"{name}[{at}] = {self.as_kind(node, one, kind)};")
                return Array(kind, name, (len(items),), is_stable=True)
        self.refuse(node, "a sequence of numbers is needed here")

    def copy(self, target: str, source: Array) -> None:
        """Write numbers to memory that does not overlap theirs."""
        if source.size:
            self.emit(f"memcpy({target}, {source.text}, {source.size} * sizeof({source.kind}));")

    def items(self, node: ast.AST, value: Value, count: int | None = None) -> list[Value]:
        """Return the parts of a value that is taken apart."""
        found: list[Value]
        match value:
            case Pack():
                found = list(value.items)
            case Static(value=tuple() as numbers):
                found = [Static(one, value.name) for one in numbers]
            case Array():
                found = [self.element(node, value, Static(at)) for at in range(value.shape[0])]
            case _:
                self.refuse(node, "this cannot be taken apart")
        if count is not None and len(found) != count:
            self.refuse(node, f"{len(found)} values for {count} names")
        return found

    def element(self, node: ast.AST, value: Array, index: Value) -> Value:
        count, rest = value.shape[0], value.shape[1:]
        text = self.index(node, index, count)
        if not rest:
            return Scalar(value.kind, f"{value.text}[{text}]")
        step = 1
        for one in rest:
            step *= one
        where = f"({value.text} + {step} * ({text}))"
        return Array(value.kind, where, rest, value.root, value.is_list, value.is_stable)

    def index(self, node: ast.AST, index: Value, count: int) -> str:
        """Return the text of an index, checked by the program where it is not known to be within."""
        if isinstance(index, Static) and isinstance(index.value, int):
            at = index.value + (count if index.value < 0 else 0)
            if not 0 <= at < count:
                self.refuse(node, f"index {index.value} of a sequence of {count}")
            return str(at)
        one = self.scalar(node, index)
        if one.kind == DOUBLE:
            self.refuse(node, "an index is a whole number")
        if one.low is not None and one.high is not None and one.low >= 0 and one.high < count:
            return one.text
        return f"arithmetic_index({one.text}, {count})"
