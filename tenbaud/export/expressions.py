"""Expressions: from Python's syntax tree to C, each operation as Python does it."""

from __future__ import annotations

import ast
import builtins
import operator
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

from tenbaud.export.scope import Scope
from tenbaud.export.values import (
    DOUBLE,
    ORDER,
    TRUTH,
    WHOLE,
    Array,
    Pack,
    Scalar,
    Static,
    Value,
)

OPERATORS: dict[type[ast.AST], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Add: ("+", operator.add),
    ast.Sub: ("-", operator.sub),
    ast.Mult: ("*", operator.mul),
    ast.Div: ("/", operator.truediv),
    ast.FloorDiv: ("//", operator.floordiv),
    ast.Mod: ("%", operator.mod),
    ast.BitAnd: ("&", operator.and_),
    ast.BitOr: ("|", operator.or_),
    ast.BitXor: ("^", operator.xor),
    ast.LShift: ("<<", operator.lshift),
    ast.RShift: (">>", operator.rshift),
}
COMPARISONS: dict[type[ast.AST], tuple[str, Callable[[Any, Any], Any]]] = {
    ast.Lt: ("<", operator.lt),
    ast.LtE: ("<=", operator.le),
    ast.Gt: (">", operator.gt),
    ast.GtE: (">=", operator.ge),
    ast.Eq: ("==", operator.eq),
    ast.NotEq: ("!=", operator.ne),
}
WHOLE_ONLY = ("//", "%", "&", "|", "^", "<<", ">>")
POWER = "x**2 is not x*x on every C library: multiply"
REFUSED = {
    ast.Pow: POWER,
    ast.MatMult: "@: write the products out, their order is part of the result",
}


class Expressions(Scope):
    """Evaluates expressions; lines that must come before one are written at once."""

    def value(self, node: ast.expr) -> Value:
        """Return what an expression stands for."""
        handle = getattr(self, f"_{type(node).__name__.lower()}", None)
        if handle is None:
            self.refuse(node, f"{type(node).__name__}: not in the language of the codec's functions")
        found: Value = handle(node)
        return found

    @abstractmethod
    def _call(self, node: ast.Call) -> Value: ...

    def _constant(self, node: ast.Constant) -> Value:
        if isinstance(node.value, bool | int | float) or node.value is None:
            return Static(node.value)
        if isinstance(node.value, str):
            return Static(node.value)
        self.refuse(node, f"a constant of type {type(node.value).__name__}")

    def _name(self, node: ast.Name) -> Value:
        if node.id in self.names:
            return self.names[node.id]
        if node.id in self.stores:
            self.refuse(node, f"{node.id} has no value yet")
        scope = self.source.function.__globals__
        if node.id in scope:
            return Static(scope[node.id], node.id)
        if hasattr(builtins, node.id):
            return Static(getattr(builtins, node.id), node.id)
        self.refuse(node, f"{node.id} is not known here")

    def _attribute(self, node: ast.Attribute) -> Value:
        value = self.value(node.value)
        if not isinstance(value, Static):
            self.refuse(node, f".{node.attr} of a value that the program computes")
        if not hasattr(value.value, node.attr):
            self.refuse(node, f"there is no {node.attr} here")
        return Static(getattr(value.value, node.attr), node.attr)

    def _tuple(self, node: ast.Tuple) -> Value:
        items = tuple([self.value(one) for one in node.elts])
        if all(isinstance(one, Static) for one in items):
            return Static(tuple([one.value for one in items if isinstance(one, Static)]))
        return Pack(items)

    def _list(self, node: ast.List) -> Value:
        self.require_statement(node)
        made = self.array(node, Pack(tuple([self.value(one) for one in node.elts])))
        return Array(made.kind, made.text, made.shape, is_list=True, is_stable=True)

    def _repeated(self, node: ast.BinOp, first: ast.List) -> Value:
        """Make a list of one number, several times."""
        self.require_statement(node)
        count = self.value(node.right)
        if len(first.elts) != 1 or not isinstance(count, Static) or not isinstance(count.value, int):
            self.refuse(node, "a list has one number, times a size that is known beforehand")
        number = self.scalar(first, self.value(first.elts[0]))
        name = self.memory(number.kind, count.value)
        at = self.temporary()
        self.emit(f"for (int32_t {at} = 0; {at} < {count.value}; {at}++) {name}[{at}] = {number.text};")
        return Array(number.kind, name, (count.value,), is_list=True, is_stable=True)

    def _subscript(self, node: ast.Subscript) -> Value:
        value = self.value(node.value)
        if isinstance(node.slice, ast.Slice):
            return self._part(node, value, node.slice)
        index = self.value(node.slice)
        if isinstance(value, Static) and isinstance(index, Static):
            try:
                return Static(value.value[index.value], value.name)
            except (LookupError, TypeError) as error:
                self.refuse(node, str(error))
        if isinstance(value, Pack):
            if not isinstance(index, Static):
                self.refuse(node, "an index into unlike values must be known beforehand")
            found: Value = value.items[index.value]
            return found
        return self.element(node, self.array(node, value), index)

    def _part(self, node: ast.Subscript, value: Value, part: ast.Slice) -> Value:
        """Return a part of a sequence, as a pack of its entries."""
        ends = [None if one is None else self.value(one) for one in (part.lower, part.upper, part.step)]
        if not all(one is None or isinstance(one, Static) for one in ends):
            self.refuse(node, "the ends of a part must be known beforehand")
        where = slice(*[one.value if isinstance(one, Static) else None for one in ends])
        if isinstance(value, Static):
            return Static(value.value[where], value.name)
        return Pack(tuple(self.items(node, value)[where]))

    def _unaryop(self, node: ast.UnaryOp) -> Value:
        value = self.value(node.operand)
        if isinstance(node.op, ast.Not):
            if isinstance(value, Static):
                return Static(not value.value)
            return Scalar(TRUTH, f"(!{self.truth(node, value)})")
        one = self.scalar(node, value)
        if isinstance(node.op, ast.USub):
            if isinstance(value, Static):
                return Static(-value.value)
            kind = WHOLE if one.kind == TRUTH else one.kind
            low, high = (None, None) if one.low is None else (-(one.high or 0), -one.low)
            return Scalar(kind, f"(-{one.text})", low if one.high is not None else None, high)
        self.refuse(node, "only `-` and `not` stand before a value")

    def _binop(self, node: ast.BinOp) -> Value:
        if isinstance(node.left, ast.List) and isinstance(node.op, ast.Mult):
            return self._repeated(node, node.left)
        return self.operation(node, node.op, self.value(node.left), self.value(node.right))

    def operation(self, node: ast.AST, op: ast.operator, left: Value, right: Value) -> Value:
        if type(op) in REFUSED:
            self.refuse(node, REFUSED[type(op)])
        text, known = OPERATORS[type(op)]
        if isinstance(left, Static) and isinstance(right, Static):
            try:
                return Static(known(left.value, right.value))
            except (ArithmeticError, TypeError, ValueError) as error:
                self.refuse(node, str(error))
        sequences = (Array, Pack)
        if text == "+" and (isinstance(left, sequences) or isinstance(right, sequences)):
            return Pack((*self.items(node, left), *self.items(node, right)))
        return self._arithmetic(node, text, left, right)

    def _arithmetic(self, node: ast.AST, text: str, left: Value, right: Value) -> Scalar:
        a, b = self.scalar(node, left), self.scalar(node, right)
        if text == "/":
            over, under = self.as_kind(node, left, DOUBLE), self.as_kind(node, right, DOUBLE)
            if isinstance(right, Static) and right.value != 0:
                return Scalar(DOUBLE, f"({over} / {under})")
            return Scalar(DOUBLE, f"arithmetic_divide({over}, {under})")
        if DOUBLE in (a.kind, b.kind):
            if text in WHOLE_ONLY:
                self.refuse(node, f"{text} is for whole numbers")
            over, under = self.as_kind(node, left, DOUBLE), self.as_kind(node, right, DOUBLE)
            return Scalar(DOUBLE, f"({over} {text} {under})")
        if text in ("//", "%"):
            if not (isinstance(right, Static) and right.value > 0):
                self.refuse(node, f"{text} is by a whole number above 0 that is known beforehand")
            called = "arithmetic_floor_divide" if text == "//" else "arithmetic_remainder"
            return Scalar(WHOLE, f"{called}({a.text}, {b.text})")
        low, high = reach_of(text, a, b)
        return Scalar(WHOLE, f"({a.text} {text} {b.text})", low, high)

    def _boolop(self, node: ast.BoolOp) -> Value:
        is_and = isinstance(node.op, ast.And)
        parts: list[str] = []
        for at, one in enumerate(node.values):
            if at == 0:
                value = self.value(one)
            else:
                with self.conditional():
                    value = self.value(one)
            if not isinstance(value, Static):
                parts.append(self.truth(one, value))
            elif bool(value.value) != is_and:
                # What follows is not evaluated; a call before it may write.
                if not parts:
                    return Static(not is_and)
                parts.append("false" if is_and else "true")
                break
        if not parts:
            return Static(is_and)
        return Scalar(TRUTH, "(" + (" && " if is_and else " || ").join(parts) + ")")

    def _compare(self, node: ast.Compare) -> Value:
        values = [self.value(node.left), *[self.value(one) for one in node.comparators]]
        if isinstance(node.ops[0], ast.Is | ast.IsNot):
            return self._identical(node, values)
        parts = []
        for op, left, right in zip(node.ops, values, values[1:], strict=False):
            if type(op) not in COMPARISONS:
                self.refuse(node, "only numbers are compared")
            text, known = COMPARISONS[type(op)]
            if isinstance(left, Static) and isinstance(right, Static):
                if not known(left.value, right.value):
                    return Static(False)
                continue
            a, b = self.scalar(node, left), self.scalar(node, right)
            kind = max(a.kind, b.kind, key=ORDER.index)
            parts.append(f"({self.as_kind(node, left, kind)} {text} {self.as_kind(node, right, kind)})")
        if not parts:
            return Static(True)
        return Scalar(TRUTH, f"({' && '.join(parts)})" if len(parts) > 1 else parts[0])

    def _identical(self, node: ast.Compare, values: Sequence[Value]) -> Value:
        left, right = values[0], values[1]
        if len(values) == 2 and isinstance(right, Static) and right.value is None:
            is_none = isinstance(left, Static) and left.value is None
            return Static(is_none == isinstance(node.ops[0], ast.Is))
        self.refuse(node, "`is` compares with None alone")

    def _ifexp(self, node: ast.IfExp) -> Value:
        test = self.value(node.test)
        if isinstance(test, Static):
            return self.value(node.body if test.value else node.orelse)
        with self.conditional():
            left, right = self.value(node.body), self.value(node.orelse)
        kinds = [self.scalar(node, one).kind for one in (left, right)]
        kind = max(kinds, key=ORDER.index)
        texts = [self.as_kind(node, one, kind) for one in (left, right)]
        return Scalar(kind, f"({self.truth(node, test)} ? {texts[0]} : {texts[1]})")


def reach_of(text: str, a: Scalar, b: Scalar) -> tuple[int | None, int | None]:
    """Return the limits of a whole number, as far as they are known."""
    if text == "&" and b.low is not None and b.low == b.high and b.low >= 0:
        return 0, b.low
    if a.low is None or a.high is None or b.low is None or b.high is None:
        return None, None
    pairs = [(x, y) for x in (a.low, a.high) for y in (b.low, b.high)]
    if text not in ("+", "-", "*"):
        return None, None
    known = {"+": operator.add, "-": operator.sub, "*": operator.mul}[text]
    results = [known(x, y) for x, y in pairs]
    return min(results), max(results)
