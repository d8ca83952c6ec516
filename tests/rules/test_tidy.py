"""Sizes, leftovers and docstrings: the part of the style that a machine can check."""

from __future__ import annotations

import ast
import re
import tomllib

import pytest

from tests.rules.sources import OUTSIDE, PACKAGES, TOP, files_below, report

FILE_LINES_MAX = 400
FUNCTION_LINES_MAX = 70
CODE_FOLDERS = (*PACKAGES, *OUTSIDE, "tests", "benchmarks")
TEXT_PATTERNS = ("*.py", "*.md", "*.toml", "*.json", "*.yml", "*.csv", "*.sh")
TOP_FILES = ("pyproject.toml", "Makefile", ".gitignore", ".ci/run")

MACHINE_PATH = re.compile(r"(?<![\w.>)}])/(?:home|root|work|Users)/\w")
LEFTOVER = re.compile(r"\b(?:TODO|FIXME|XXX|NotImplementedError)\b")


def size_findings(source: str, name: str) -> list[str]:
    """Return one line for each file or function that is too long to be read in one go."""
    found = []
    count = len(source.splitlines())
    if count > FILE_LINES_MAX:
        found.append(f"{name}:1: {count} lines, at most {FILE_LINES_MAX}")
    for node in ast.walk(ast.parse(source, filename=name)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            if length > FUNCTION_LINES_MAX:
                found.append(
                    f"{name}:{node.lineno}: {node.name} has {length} lines, "
                    f"at most {FUNCTION_LINES_MAX}"
                )
    return found


def matches(pattern: re.Pattern[str], text: str, name: str, reason: str) -> list[str]:
    return [
        f"{name}:{number}: {reason}: {line.strip()}"
        for number, line in enumerate(text.splitlines(), start=1)
        if pattern.search(line)
    ]


def docstring_findings(source: str, name: str) -> list[str]:
    """Return one line for each public function or class of a module without a docstring."""
    return [
        f"{name}:{node.lineno}: {node.name} has no docstring"
        for node in ast.parse(source, filename=name).body
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
        and not node.name.startswith("_")
        and not ast.get_docstring(node)
    ]


MAY_BE_ASSIGNED = ("sys.stdout", "sys.stderr", "numba.config", "self._open")
"""What belongs to others but is set, and the hole that HoleFinder itself has open."""


def test_parts_of_parts_are_given_at_construction_or_through_a_method() -> None:
    found = []
    for name, source in files_below(*PACKAGES):
        for node in ast.walk(ast.parse(source, filename=name)):
            for target in node.targets if isinstance(node, ast.Assign) else ():
                if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Attribute):
                    text = ast.unparse(target)
                    if not text.startswith(MAY_BE_ASSIGNED):
                        found.append(f"{name}:{node.lineno}: {text} is assigned from outside")
    assert not found, report(found)


def test_every_folder_of_code_but_the_tests_is_type_checked() -> None:
    checked = tomllib.loads((TOP / "pyproject.toml").read_text())["tool"]["mypy"]["packages"]
    assert set(CODE_FOLDERS) - {"tests"} <= set(checked)


def test_files_and_functions_are_short() -> None:
    found = [
        line for name, source in files_below(*CODE_FOLDERS) for line in size_findings(source, name)
    ]
    assert not found, report(found)


def test_no_text_names_a_path_of_one_machine() -> None:
    texts = [
        pair
        for pattern in TEXT_PATTERNS
        for pair in files_below(*CODE_FOLDERS, "docs", pattern=pattern)
    ]
    names = [*TOP_FILES, *(path.name for path in TOP.glob("*.md"))]
    texts += [
        (name, (TOP / name).read_text(encoding="utf-8")) for name in names if (TOP / name).exists()
    ]
    found = [line for name, text in texts for line in matches(MACHINE_PATH, text, name, "machine path")]
    assert not found, report(found)


def test_the_packages_hold_no_leftovers() -> None:
    found = [
        line
        for name, source in files_below(*PACKAGES)
        for line in matches(LEFTOVER, source, name, "unfinished")
    ]
    assert not found, report(found)


@pytest.mark.parametrize("package", PACKAGES)
def test_package_is_marked_as_typed(package: str) -> None:
    assert (TOP / package / "py.typed").is_file()


def test_public_names_of_the_channel_have_docstrings() -> None:
    found = [
        line for name, source in files_below("channel") for line in docstring_findings(source, name)
    ]
    assert not found, report(found)


def test_a_long_file_and_a_long_function_are_caught() -> None:
    assert size_findings("x = 1\n" * FILE_LINES_MAX, "a.py") == []
    assert size_findings("x = 1\n" * (FILE_LINES_MAX + 1), "a.py") != []
    body = "    x = 1\n"
    assert size_findings("def f():\n" + body * (FUNCTION_LINES_MAX - 1), "a.py") == []
    assert size_findings("def f():\n" + body * FUNCTION_LINES_MAX, "a.py") != []


@pytest.mark.parametrize("folder", ["home", "root", "work", "Users"])
def test_a_machine_path_is_caught(folder: str) -> None:
    assert matches(MACHINE_PATH, f'path = "/{folder}/x"', "a.py", "") != []
    assert matches(MACHINE_PATH, f"see https://example.org/{folder}/x", "a.py", "") == []


@pytest.mark.parametrize("word", ["# TODO later", "# FIXME", "raise NotImplementedError"])
def test_a_leftover_is_caught(word: str) -> None:
    assert matches(LEFTOVER, word, "a.py", "") != []


def test_a_missing_docstring_is_caught() -> None:
    assert len(docstring_findings("def f(): pass\nclass C: pass\ndef _g(): pass", "a.py")) == 2
    assert docstring_findings('def f():\n    "Do it."', "a.py") == []
