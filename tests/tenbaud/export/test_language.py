"""Each construct of the language means in C what it means in Python, or is refused with its place."""

from __future__ import annotations

import ctypes
import inspect
import math
import random
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tenbaud.export.codec import BY_HAND
from tenbaud.export.program import Program
from tenbaud.export.source import CannotExport
from tenbaud.export.values import DOUBLE, Array, Scalar, Static
from tests.tenbaud.export import snippets
from tests.tenbaud.export.compiled_codec import FLAGS, compiler, need

CALLS = 2_000
WILD = (0.0, -0.0, 0.5, -0.5, 1.0, 2.0, -1.0, 3.0)


def translated(program: Program, function: Callable[..., Any]) -> str:
    """Translate a function of two numbers and a list of three; return its name in C."""
    more = [Static(one) for one in function.__defaults__ or ()]
    arguments = (Scalar(DOUBLE, ""), Scalar(DOUBLE, ""), Array(DOUBLE, "", (3,)), *more)
    return program.function(function, arguments).name


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> tuple[ctypes.CDLL, dict[Any, str]]:
    need("gcc", "gcc")
    folder, program = tmp_path_factory.mktemp("language"), Program()
    functions = [*snippets.SNIPPETS, *[one[0] for one in snippets.FAULTS]]
    names = {one: translated(program, one) for one in functions}
    for name in ("arithmetic.h", "arithmetic.c"):
        (folder / name).write_text((BY_HAND / name).read_text())
    text = program.text()
    for name in names.values():
        text = text.replace(f"static void {name}(", f"void {name}(")
    (folder / "snippets.c").write_text(f'#include "arithmetic.h"\n{text}')
    done = compiler(folder, "-fPIC", "-shared", "-o", str(folder / "snippets.so"))
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(folder / "snippets.so")), names


def called(library: ctypes.CDLL, name: str, x: float, y: float) -> list[float]:
    result = (ctypes.c_double * 3)()
    getattr(library, name)(ctypes.c_double(x), ctypes.c_double(y), result)
    return list(result)


def fault(library: ctypes.CDLL) -> ctypes.c_bool:
    return ctypes.c_bool.in_dll(library, "arithmetic_fault")


@pytest.mark.parametrize("function", snippets.SNIPPETS, ids=lambda one: one.__name__)
def test_a_construct_means_in_c_what_it_means_in_python(
    function: Callable[..., Any], library: tuple[ctypes.CDLL, dict[Any, str]]
) -> None:
    chance = random.Random(3)
    for call in range(CALLS):
        x, y = (chance.choice(WILD) if call % 5 == 0 else chance.uniform(-9.0, 9.0) for _ in "xy")
        expected = [0.0] * 3
        function(x, y, expected)
        found = called(library[0], library[1][function], x, y)
        assert [one.hex() for one in found] == [float(one).hex() for one in expected], (x, y)
    assert not fault(library[0])


@pytest.mark.parametrize(("function", "x", "y"), snippets.FAULTS)
def test_an_exception_of_python_is_a_fault_in_c(
    function: Callable[..., Any], x: float, y: float, library: tuple[ctypes.CDLL, dict[Any, str]]
) -> None:
    with pytest.raises((ArithmeticError, LookupError, ValueError)):
        function(x, y, [0.0] * 3)
    flag = fault(library[0])
    flag.value = False
    called(library[0], library[1][function], x, y)
    assert flag
    flag.value = False


@pytest.mark.parametrize(("function", "text", "reason"), snippets.REFUSED)
def test_what_is_no_part_of_the_language_is_refused_with_its_place(
    function: Callable[..., Any], text: str, reason: str
) -> None:
    caller = snippets.ends_without if function is snippets.unfinished else function
    with pytest.raises(CannotExport) as refusal:
        translated(Program(), caller)
    lines, first = inspect.getsourcelines(function)
    line, column = next(
        (first + at, one.index(text) + 1) for at, one in enumerate(lines) if text in one
    )
    where, _, what = str(refusal.value).partition(": ")
    file, found_line, found_column = where.rsplit(":", 2)
    assert Path(file).name == "snippets.py"
    assert int(found_line) == line
    assert column <= int(found_column) <= column + len(text)
    assert reason in what


def test_the_square_root_is_the_nearest_double(
    library: tuple[ctypes.CDLL, dict[Any, str]],
) -> None:
    root = library[0].arithmetic_sqrt
    root.restype, chance = ctypes.c_double, random.Random(4)
    numbers = [0.0, -0.0, 5e-324, 2.0**-1022, 1.0 - 2.0**-53, 1.0 + 2.0**-52, math.inf, 1.7e308]
    while len(numbers) < 50_000:
        (number,) = struct.unpack("<d", chance.randbytes(7) + bytes((chance.randrange(0x80),)))
        numbers.append(number)
        numbers.append(number * number)
    for number in numbers:
        if not math.isnan(number):
            assert root(ctypes.c_double(number)).hex() == math.sqrt(number).hex(), number.hex()


@pytest.mark.parametrize("flag", ["-ffast-math", "-mfpmath=387", "-ffinite-math-only"])
def test_a_compiler_that_does_not_round_as_written_is_refused(flag: str, tmp_path: Path) -> None:
    need("gcc", "gcc")
    (tmp_path / "empty.c").write_text((BY_HAND / "arithmetic.h").read_text())
    done = compiler(tmp_path, "-c", "-o", str(tmp_path / "empty.o"), flags=(*FLAGS, flag))
    assert done.returncode != 0
    assert "the codec needs" in done.stderr
