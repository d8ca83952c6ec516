"""The names that `tenbaud` exports: loaded when used, each in `help(tenbaud)` and in the manual."""

from __future__ import annotations

import pydoc
import re
import subprocess
import sys
from importlib import import_module

import pytest

import tenbaud
from tests.docs.blocks import blocks_of
from tests.tenbaud.processes import REPOSITORY

PAGE = "docs/reference/python.md"
MODULES = ("coders", "controllers", "errors", "models", "plants")
EXAMPLES = "\n".join(block.text for block in blocks_of(PAGE) if block.language == "python")


def test_when_tenbaud_is_imported_then_nothing_else_is_loaded() -> None:
    program = (
        "import sys; before = set(sys.modules); import tenbaud\n"
        "loaded = {name.partition('.')[0] for name in set(sys.modules) - before}\n"
        "print(*sorted(loaded - sys.stdlib_module_names))\n"
        "print(*sorted(name for name in sys.modules if name.startswith('tenbaud.')))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=REPOSITORY, capture_output=True, text=True, check=True
    )
    assert done.stdout == "tenbaud\n\n"


def test_when_help_is_asked_for_then_its_page_has_every_name() -> None:
    assert 15 <= len(tenbaud.__all__) <= 25
    page = pydoc.render_doc(tenbaud, renderer=pydoc.plaintext)
    head = page.partition("PACKAGE CONTENTS")[0]
    for name in tenbaud.__all__:
        assert re.search(rf"\b{name}\b", head), name
        assert getattr(tenbaud, name) is not None
        assert name in dir(tenbaud)


@pytest.mark.parametrize("name", tenbaud.__all__)
def test_when_a_name_is_public_then_it_is_documented_and_has_an_example(name: str) -> None:
    found = getattr(tenbaud, name)
    assert (found.__doc__ or "").strip(), f"{name} has no docstring"
    assert re.search(rf"\b{name}\b", EXAMPLES), f"no example in {PAGE} uses {name}"


@pytest.mark.parametrize("module", MODULES)
def test_when_a_module_is_public_then_all_of_its_names_are_in_the_manual(module: str) -> None:
    text = (REPOSITORY / PAGE).read_text(encoding="utf-8")
    for name in import_module(f"tenbaud.{module}").__all__:
        assert f"{module}.{name}" in text, f"{PAGE} does not mention {module}.{name}"


def test_when_a_name_is_unknown_then_the_known_ones_are_said() -> None:
    with pytest.raises(AttributeError, match=r"has no attribute 'Codek'; it has Codec, .*preset_names"):
        _ = tenbaud.Codek
