"""The pure modules keep to arithmetic that gives equal bits on any two machines."""

from __future__ import annotations

import pytest

from tests.rules.arithmetic import findings_in
from tests.rules.sources import TOP, files_below, report

PURE = "channel/codec"
"""The folder is the rule: every module in it computes codec state, or is part of what does."""


def pure_modules() -> list[str]:
    return [name for name, _ in files_below(PURE)]


def test_pure_modules_are_found() -> None:
    assert "channel/codec/numerics.py" in pure_modules()


@pytest.mark.parametrize("name", pure_modules())
def test_pure_module_keeps_to_the_restricted_arithmetic(name: str) -> None:
    found = findings_in((TOP / name).read_text(encoding="utf-8"), name)
    assert not found, report(found)


@pytest.mark.parametrize(
    "statement",
    [
        "y = x ** 2",
        "x **= 2",
        "y = a @ b",
        "y = x % 3",
        "y = x // 3",
        "x %= 3",
        "y = sum(values)",
        "y = min(x, 1.0)",
        "y = max(x, 1.0)",
        "y = abs(x)",
        "y = round(x)",
        "y = pow(x, 2)",
        "y = divmod(x, 2)",
        "y = hash(x)",
        "import math\ny = math.sin(x)",
        "import math as m\ny = m.exp(x)",
        "from math import hypot",
        "import numpy as np",
        "import numpy.linalg",
        "from random import Random",
        "import time",
        "def f():\n    import os",
        "for x in {1, 2}: pass",
        "for x in set(values): pass",
        "for key in table.items(): pass",
        "y = [x for x in {1: 2}]",
        "table = {1: 2}\nfor x in table: pass",
        "def f(table: dict[int, float]) -> None:\n    for x in table: pass",
    ],
)
def test_a_refused_construct_is_caught_with_file_and_line(statement: str) -> None:
    found = findings_in("# first line\n" + statement, "channel/bad.py")
    assert len(found) == 1
    line = statement.count("\n") + 2
    position, _, reason = found[0].partition(": ")
    assert position == f"channel/bad.py:{line}"
    assert ": " in reason


@pytest.mark.parametrize(
    "statement",
    [
        "import math\ny = math.sqrt(x) + math.floor(x) * -x / 2.0",
        "from math import isfinite, sqrt",
        "slot = index % 4  # integers",
        "slot = index // 4  # integers",
        "slot, rest = divmod(index, 4)  # integers",
        "for x in (1, 2): pass",
        "table = {1: 2}\ny = table[1]",
        "from channel.codec.numerics import sin\ny = sin(x)",
        "y = x if x > 0.0 else -x",
    ],
)
def test_an_allowed_construct_passes(statement: str) -> None:
    assert findings_in(statement, "channel/good.py") == []
