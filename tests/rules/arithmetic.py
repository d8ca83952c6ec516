"""The arithmetic the pure modules may use, checked on the syntax tree.

The two copies of the codec must agree to the last bit on any two machines. What is refused here
either depends on the processor, the C library or the Python version (``math.sin``, ``**``,
``sum()``, numpy), hides a comparison whose result for zeros or NaN nobody chose (``min``, ``max``,
``abs``, ``round``), or brings in what is not part of the state (clocks, chance, hash order).
"""

from __future__ import annotations

import ast

from tenbaud.export.calls import DIFFERING
from tenbaud.export.expressions import POWER

INTEGERS = "# integers"
"""A line with this comment may use ``//``, ``%`` and ``divmod()``: no float can be there."""

MATH_ALLOWED = {"sqrt", "floor", "isfinite"}
CALLS_REFUSED = {
    **{function.__name__: why for function, why in DIFFERING.items()},
    "hash": "differs from process to process",
    "id": "differs from process to process",
}
IMPORTS_REFUSED = {
    "numpy": "its results depend on the processor",
    "scipy": "its results depend on the processor",
    "cmath": "its results depend on the C library",
    "statistics": "not part of the restricted arithmetic",
    "operator": "hides operators from this check",
    "random": "chance is not an input of the codec",
    "secrets": "chance is not an input of the codec",
    "time": "a clock is not an input of the codec",
    "datetime": "a clock is not an input of the codec",
    "os": "the machine is not an input of the codec",
    "platform": "the machine is not an input of the codec",
}
UNORDERED = "the order of a set or dict is not part of the state: iterate over a tuple"


class ArithmeticCheck(ast.NodeVisitor):
    """Collects ``file:line: reason`` for everything a pure module must not contain."""

    def __init__(self, source: str, name: str) -> None:
        self.name = name
        self.lines = source.splitlines()
        self.found: list[str] = []
        self.math_names = {"math"}
        self.unordered_names: set[str] = set()
        tree = ast.parse(source, filename=name)
        for node in ast.walk(tree):  # names first: a loop may stand above what it reads
            self._note_unordered_name(node)
        self.visit(tree)

    def refuse(self, node: ast.expr | ast.stmt, what: str, reason: str) -> None:
        self.found.append(f"{self.name}:{node.lineno}: {what}: {reason}")

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            if alias.name == "math" and alias.asname:
                self.math_names.add(alias.asname)
            self._check_module(node, alias.name)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        if node.level == 0 and node.module:
            self._check_module(node, node.module)
            for alias in node.names:
                if node.module == "math":
                    self._check_math(node, alias.name)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if isinstance(node.value, ast.Name) and node.value.id in self.math_names:
            self._check_math(node, node.attr)
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        if called in CALLS_REFUSED:
            self.refuse(node, f"{called}()", CALLS_REFUSED[called])
        elif called == "divmod":
            self._check_integers(node, "divmod()")
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        self._check_operator(node, node.op)
        self.generic_visit(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> None:
        self._check_operator(node, node.op)
        self.generic_visit(node)

    def visit_For(self, node: ast.For) -> None:
        self._check_order(node.iter)
        self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> None:
        self._check_order(node.iter)
        self.generic_visit(node)

    def _check_module(self, node: ast.stmt, module: str) -> None:
        root = module.split(".")[0]
        if root in IMPORTS_REFUSED:
            self.refuse(node, f"import of {root}", IMPORTS_REFUSED[root])

    def _check_math(self, node: ast.expr | ast.stmt, attribute: str) -> None:
        if attribute not in MATH_ALLOWED:
            allowed = ", ".join(sorted(MATH_ALLOWED))
            self.refuse(node, f"math.{attribute}", f"only {allowed} give equal bits everywhere")

    def _check_operator(self, node: ast.expr | ast.stmt, operator: ast.operator) -> None:
        if isinstance(operator, ast.Pow):
            self.refuse(node, "**", POWER)
        elif isinstance(operator, ast.MatMult):
            self.refuse(node, "@", "write the products out, their order is part of the result")
        elif isinstance(operator, ast.Mod | ast.FloorDiv):
            symbol = "%" if isinstance(operator, ast.Mod) else "//"
            self._check_integers(node, symbol)

    def _check_integers(self, node: ast.expr | ast.stmt, what: str) -> None:
        covered = self.lines[node.lineno - 1 : node.end_lineno]
        if not any(INTEGERS in line for line in covered):
            self.refuse(node, what, f"for integers only, on a line that says '{INTEGERS}'")

    def _note_unordered_name(self, node: ast.AST) -> None:
        """Remember names bound to a set or dict, or annotated as one, anywhere in the file."""
        if isinstance(node, ast.Assign) and _makes_unordered(node.value):
            self.unordered_names |= {t.id for t in node.targets if isinstance(t, ast.Name)}
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            made = node.value is not None and _makes_unordered(node.value)
            if made or _is_unordered_type(node.annotation):
                self.unordered_names.add(node.target.id)
        elif isinstance(node, ast.arg) and node.annotation and _is_unordered_type(node.annotation):
            self.unordered_names.add(node.arg)

    def _check_order(self, iterated: ast.expr) -> None:
        methods = ("items", "keys", "values")
        called = iterated.func if isinstance(iterated, ast.Call) else None
        if (
            _makes_unordered(iterated)
            or (isinstance(iterated, ast.Name) and iterated.id in self.unordered_names)
            or (isinstance(called, ast.Attribute) and called.attr in methods)
        ):
            self.refuse(iterated, "iteration", UNORDERED)


def _makes_unordered(node: ast.expr) -> bool:
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return node.func.id in ("set", "frozenset", "dict")
    return isinstance(node, ast.Set | ast.Dict | ast.SetComp | ast.DictComp)


def _is_unordered_type(annotation: ast.expr) -> bool:
    kinds = {"set", "frozenset", "dict", "Mapping", "MutableMapping", "Set"}
    outer = annotation.value if isinstance(annotation, ast.Subscript) else annotation
    return isinstance(outer, ast.Name) and outer.id in kinds


def findings_in(source: str, name: str) -> list[str]:
    """Return one line for each thing a pure module must not contain."""
    return ArithmeticCheck(source, name).found
