"""Statements of a function, one after another."""

from __future__ import annotations

import ast
from collections.abc import Sequence

from tenbaud.export.calls import Calls
from tenbaud.export.values import (
    DOUBLE,
    KINDS,
    WHOLE,
    Array,
    Pack,
    Scalar,
    Shape,
    Static,
    Value,
)

SCALARS = {"float": DOUBLE, "int": WHOLE, "bool": KINDS[bool]}


class Statements(Calls):
    """Writes the statements of a function body."""

    returns: Shape | None = None
    """what the first `return` gives, or the annotation says"""

    def body(self, statements: Sequence[ast.stmt]) -> bool:
        """Write statements; return whether the last one is never passed."""
        for one in statements:
            handle = getattr(self, f"_{type(one).__name__.lower()}_statement", None)
            if handle is None:
                name = type(one).__name__
                self.refuse(one, f"{name}: not in the language of the codec's functions")
            if handle(one):
                return True
        return False

    def _expr_statement(self, node: ast.Expr) -> bool:
        if isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            return False
        value = self.value(node.value)
        if isinstance(value, Scalar):
            self.emit(f"(void){value.text};")
        return False

    def _pass_statement(self, node: ast.Pass) -> bool:
        return False

    def _break_statement(self, node: ast.Break) -> bool:
        self.emit("break;")
        return True

    def _continue_statement(self, node: ast.Continue) -> bool:
        self.emit("continue;")
        return True

    # Assignments

    def _assign_statement(self, node: ast.Assign) -> bool:
        value = self.value(node.value)
        for target in node.targets:
            self._assign(target, value)
        return False

    def _annassign_statement(self, node: ast.AnnAssign) -> bool:
        if node.value is not None:
            self._assign(node.target, self.value(node.value))
        return False

    def _augassign_statement(self, node: ast.AugAssign) -> bool:
        if isinstance(node.target, ast.Subscript):
            array = self.array(node, self.value(node.target.value))
            index = self.value(node.target.slice)
            if not isinstance(index, Static):
                one, at = self.scalar(node, index), self.temporary()
                self.declare(at, f"{WHOLE} {at}")
                self.emit(f"{at} = {self.index(node, one, array.shape[0])};")
                index = Scalar(WHOLE, at, 0, array.shape[0] - 1)
            before = self.element(node, array, index)
            result = self.operation(node, node.op, before, self.value(node.value))
            self._store(node, array, index, result)
        elif isinstance(node.target, ast.Name):
            before = self.value(ast.copy_location(ast.Name(node.target.id, ast.Load()), node))
            self._assign(node.target, self.operation(node, node.op, before, self.value(node.value)))
        else:
            self.refuse(node, "only names and entries are assigned")
        return False

    def _assign(self, target: ast.expr, value: Value) -> None:
        match target:
            case ast.Name():
                self._name_value(target, target.id, value)
            case ast.Tuple(elts=elements):
                items = self.items(target, value, len(elements))
                if isinstance(value, Pack):
                    items = [self._taken(target, one) for one in items]
                for one, item in zip(elements, items, strict=True):
                    self._assign(one, item)
            case ast.Subscript():
                array = self.array(target, self.value(target.value))
                self._store(target, array, self.value(target.slice), value)
            case _:
                self.refuse(target, "only names and entries are assigned")

    def _taken(self, node: ast.AST, value: Value) -> Value:
        """Return a value that a later assignment does not change."""
        if isinstance(value, Scalar):
            name = self.temporary()
            self.declare(name, f"{value.kind} {name}")
            self.emit(f"{name} = {value.text};")
            return Scalar(value.kind, name, value.low, value.high)
        if isinstance(value, Array) and not value.is_stable:
            if value.is_list:
                name = self.temporary()
                self.declare(name, f"{value.kind} *{name}", value.root)
                self.emit(f"{name} = {value.text};")
                return Array(value.kind, name, value.shape, value.root, True)
            name = self.memory(value.kind, value.size)
            self.copy(name, value)
            return Array(value.kind, name, value.shape, is_stable=True)
        return value

    def _store(self, node: ast.AST, array: Array, index: Value, value: Value) -> None:
        if not array.is_list:
            self.refuse(node, "only a list, or an argument that is not assigned, is written to")
        self.write_to(node, array)
        entry = self.element(node, array, index)
        if not isinstance(entry, Scalar):
            self.refuse(node, "a row is written entry by entry")
        self.emit(f"{entry.text} = {self.as_kind(node, value, array.kind)};")

    def _name_value(self, node: ast.AST, name: str, value: Value) -> None:
        """Let a name stand for a value: known ones and memory as they are, numbers in a variable."""
        if name == "_":
            return
        only = self.stores[name] == 1
        if isinstance(value, Pack):
            numbers = [one for one in value.items if isinstance(getattr(one, "value", 0.0), float)]
            if all(isinstance(one, Static | Scalar) for one in value.items) and numbers:
                value = self.array(node, value)
            elif only:
                value = Pack(tuple([self._taken(node, one) for one in value.items]))
        if only and isinstance(value, Static | Pack):
            self.names[name] = value
        elif isinstance(value, Static) and isinstance(value.value, tuple):
            self._name_array(node, name, self.array(node, value), only)
        elif isinstance(value, Array):
            self._name_array(node, name, value, only)
        else:
            if isinstance(value, Static | Pack) and not isinstance(
                getattr(value, "value", None), bool | int | float
            ):
                self.refuse(node, f"{name} is assigned more than once, and this is no number")
            one, own = self.scalar(node, value), self.own_name(name)
            self.declare(own, f"{one.kind} {own}", node=node)
            self.emit(f"{own} = {one.text};")
            limits = (one.low, one.high) if only else (None, None)
            self.names[name] = Scalar(one.kind, own, *limits)

    def _name_array(self, node: ast.AST, name: str, value: Array, only: bool) -> None:
        if only and value.is_stable and value.text.isidentifier():
            self.names[name] = value
            return
        own = self.own_name(name)
        memory = f"{value.kind} {own}[{max(value.size, 1)}]"
        has_own = self.declared.get(own, ("",))[0] == memory
        if (value.is_list or (only and value.is_stable)) and not has_own:
            self.declare(own, f"{value.kind} *{own}", value.root, node)
            self.emit(f"{own} = {value.text};")
            self.names[name] = Array(value.kind, own, value.shape, value.root, value.is_list, only)
            return
        self.declare(own, memory, node=node)
        self.copy(own, value)
        self.names[name] = Array(value.kind, own, value.shape, is_stable=only)

    # The course

    def _if_statement(self, node: ast.If) -> bool:
        test = self.value(node.test)
        if isinstance(test, Static):
            return self.body(node.body if test.value else node.orelse)
        with self.block(f"if ({self.truth(node.test, test)})"):
            left = self.body(node.body)
        right = False
        if node.orelse:
            with self.block("else"):
                right = self.body(node.orelse)
        return left and right

    def _while_statement(self, node: ast.While) -> bool:
        if node.orelse:
            self.refuse(node, "`else` of a loop")
        with self.block("for (;;)"):
            self.emit(f"if (!{self.truth(node.test, self.value(node.test))}) break;")
            self.body(node.body)
        return False

    def _for_statement(self, node: ast.For) -> bool:
        if node.orelse or not isinstance(node.target, ast.Name):
            self.refuse(node, "a loop goes over one name, and has no `else`")
        called = node.iter.func if isinstance(node.iter, ast.Call) else None
        if isinstance(called, ast.Name) and self.value(called) == Static(range, "range"):
            self._range(node, [self.value(one) for one in node.iter.args])  # type: ignore[attr-defined]
            return False
        array, at = self.array(node.iter, self.value(node.iter)), self.temporary()
        count = array.shape[0]
        with self.block(f"for (int32_t {at} = 0; {at} < {count}; {at}++)"):
            self._name_value(
                node, node.target.id, self.element(node, array, Scalar(WHOLE, at, 0, count - 1))
            )
            self.body(node.body)
        return False

    def _range(self, node: ast.For, ends: list[Value]) -> None:
        step = ends[2].value if len(ends) == 3 and isinstance(ends[2], Static) else 1
        if (len(ends) == 3 and not isinstance(ends[2], Static)) or not step:
            self.refuse(node, "the step of a range must be known beforehand")
        first = self.scalar(node, ends[0] if len(ends) > 1 else Static(0))
        last = self.scalar(node, ends[1] if len(ends) > 1 else ends[0])
        at, end = self.temporary(), last.text
        if not isinstance(ends[min(1, len(ends) - 1)], Static):
            end = self.temporary()
            self.declare(end, f"{WHOLE} {end}")
            self.emit(f"{end} = {last.text};")
        sign = "<" if step > 0 else ">"
        head = f"for ({WHOLE} {at} = {first.text}; {at} {sign} {end}; {at} += {step})"
        name = node.target.id  # type: ignore[attr-defined]
        own = self.own_name(name)
        with self.block(head):
            if name != "_":
                self.declare(own, f"{WHOLE} {own}", node=node)
                self.emit(f"{own} = {at};")
            low, high = first.low, None if last.high is None else last.high - 1
            if step < 0:
                low, high = None if last.low is None else last.low + 1, first.high
            known = name in self.loop_names
            self.names[name] = Scalar(WHOLE, own, low if known else None, high if known else None)
            self.body(node.body)
        self.names[name] = Scalar(WHOLE, own)

    def _return_statement(self, node: ast.Return) -> bool:
        value: Value = Static(None) if node.value is None else self.value(node.value)
        if self.returns is None:
            self.returns = self.shape(node, value)
        shape = self.returns
        if shape.kind == "":
            self.emit("return;")
        elif shape.shape:
            self._return_array(node, shape, value)
        elif shape.items:
            name = self.temporary()
            self.declare(name, f"{self.program.struct(shape)} {name}")
            self._fill(node, shape, value, name)
            self.emit(f"return {name};")
        else:
            self.emit(f"return {self.as_kind(node, value, shape.kind)};")
        return True

    def _return_array(self, node: ast.Return, shape: Shape, value: Value) -> None:
        if isinstance(value, Pack):
            items = self.items(node, value, shape.shape[0])
            for at, one in enumerate(items):
                self.emit(f"result[{at}] = {self.as_kind(node, one, shape.kind)};")
        else:
            array = self.array(node, value)
            if (array.kind, array.shape) != (shape.kind, shape.shape):
                self.refuse(node, "what is returned here has another size or type than before")
            self.copy("result", array)
        self.emit("return;")

    def _fill(self, node: ast.AST, shape: Shape, value: Value, text: str) -> None:
        for at, (one, wanted) in enumerate(
            zip(self.items(node, value, len(shape.items)), shape.items, strict=True)
        ):
            field = f"{text}.f{at}"
            if wanted.items:
                self._fill(node, wanted, one, field)
            elif wanted.shape:
                self.copy(field, self.array(node, one))
            else:
                self.emit(f"{field} = {self.as_kind(node, one, wanted.kind)};")
