"""The text of a function, and errors that say where in it something is."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections import Counter
from dataclasses import dataclass
from functools import cache
from types import FunctionType
from typing import Any

from channel.errors import TenbaudError


class CannotExport(TenbaudError):
    """A model or coder is not written in what the export translates."""


@dataclass(frozen=True, slots=True)
class Source:
    """A function's syntax tree, and where it is from."""

    function: FunctionType
    tree: ast.FunctionDef
    line: int
    """lines of the file before the text"""
    column: int
    """columns that the text is indented by"""

    def error(self, node: ast.AST, what: str) -> CannotExport:
        """Return the error of a place in the function, with file, line and column."""
        line = self.line + getattr(node, "lineno", 1)
        column = self.column + getattr(node, "col_offset", 0) + 1
        return CannotExport(f"{self.function.__code__.co_filename}:{line}:{column}: {what}")

    @property
    def name(self) -> str:
        return f"{self.function.__module__}.{self.function.__qualname__}"

    @property
    def calls_itself(self) -> bool:
        return self.function.__name__ in self.function.__code__.co_names

    def stores(self) -> Counter[str]:
        """Return how often each name is assigned, an argument once more."""
        found = Counter(argument.arg for argument in self.tree.args.args)
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                found[node.id] += 1
        return found

    def loop_names(self) -> set[str]:
        """Return the names that only `for` assigns."""
        targets = [one.target for one in ast.walk(self.tree) if isinstance(one, ast.For)]
        counted = Counter(one.id for one in targets if isinstance(one, ast.Name))
        stores = self.stores()
        return {name for name, count in counted.items() if stores[name] == count}


@cache
def source_of(function: Any) -> Source:
    """Return the text of a function; CannotExport for what is none."""
    if not isinstance(function, FunctionType):
        raise CannotExport(f"{function!r} is not a plain function, so it cannot be exported")
    try:
        lines, first = inspect.getsourcelines(function)
    except OSError as error:
        raise CannotExport(f"{function.__qualname__}: its source is not there: {error}") from error
    text = "".join(lines)
    column = len(lines[0]) - len(lines[0].lstrip())
    tree = ast.parse(textwrap.dedent(text)).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise CannotExport(f"{function.__qualname__} is not made by `def`, so it cannot be exported")
    source = Source(function, tree, first - 1, column)
    arguments = tree.args
    if function.__closure__:
        raise source.error(tree, "a function within a function reads its variables: pass them")
    if arguments.vararg or arguments.kwarg or arguments.kwonlyargs or arguments.posonlyargs:
        raise source.error(tree, "only plain arguments can be exported")
    return source
