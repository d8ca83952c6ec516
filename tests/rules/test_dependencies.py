"""What the packages import is declared: the ordinary at the top, the extras inside functions."""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.metadata import packages_distributions

import pytest

from tests.rules.sources import OUTSIDE, PACKAGES, TOP, files_below, report
from tests.rules.test_imports import imports_of

PROJECT = tomllib.loads((TOP / "pyproject.toml").read_text())["project"]
NOT_FOR_USERS = ("dev", "docs")
"""Extras of the developers; nothing in the wheel may need them."""

UNDECLARED = {
    "IPython": "a notebook has it, and it is imported there alone",
    "quanser": "the maker's own package comes with its driver and is in no index",
}
"""Imported where a person has them, never installed by us."""


HOMES = {"nicegui": "tenbaud/view/page.py"}
"""Modules that are all about an extra, and imported where it is known to be there."""


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def named(requirements: list[str]) -> set[str]:
    """Return the distributions that a list of requirements names."""
    found = (re.match(r"[A-Za-z0-9._-]+", one) for one in requirements)
    return {normal(one.group()) for one in found if one}


REQUIRED = named(PROJECT["dependencies"])
EXTRAS = {
    one
    for extra, requirements in PROJECT["optional-dependencies"].items()
    if extra not in NOT_FOR_USERS
    for one in named(requirements)
}


@cache
def owners_of(module: str) -> list[str]:
    """Return the distributions that have this module."""
    root = module.split(".")[0]
    return [normal(one) for one in _distributions().get(root, [root])]


@cache
def _distributions() -> Mapping[str, list[str]]:
    return packages_distributions()


def findings_in(source: str, name: str) -> list[str]:
    """Return one line for each import of a package that the project does not declare."""
    found = []
    for line, module, at_module_level in imports_of(source, name):
        root = module.split(".")[0]
        if root in (*sys.stdlib_module_names, *PACKAGES, *OUTSIDE, *UNDECLARED):
            continue
        owners = set(owners_of(root))
        if owners & REQUIRED:
            continue
        if not owners & EXTRAS:
            found.append(f"{name}:{line}: imports {module}: declare {' or '.join(sorted(owners))}")
        elif at_module_level and HOMES.get(root) != name:
            found.append(f"{name}:{line}: imports {module}, of an extra: inside a function only")
    return found


def test_every_import_is_declared() -> None:
    texts = files_below(*PACKAGES)
    found = [line for name, source in texts for line in findings_in(source, name)]
    assert not found, report(found)


def test_everything_declared_is_imported() -> None:
    used = {
        owner
        for name, source in files_below(*PACKAGES)
        for _, module, _ in imports_of(source, name)
        for owner in owners_of(module)
    }
    assert used >= REQUIRED | EXTRAS


@pytest.mark.parametrize(
    "source",
    [
        "import requests",
        "def f():\n    import pytest",
        "import pyarrow as pa",
        "from numba import njit",
    ],
)
def test_an_undeclared_import_is_caught(source: str) -> None:
    assert findings_in(source, "tenbaud/some.py")


@pytest.mark.parametrize("source", ["import zenoh, serial", "def f():\n    import distributed"])
def test_a_declared_import_passes(source: str) -> None:
    assert not findings_in(source, "tenbaud/some.py")
