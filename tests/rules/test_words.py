"""Pages, help, docstrings and test names use the words of the field, and no private vocabulary."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator

import pytest

from docs.tools.commands_page import commands_page
from tests.rules.sources import OUTSIDE, PACKAGES, TOP, files_below, report

PRIVATE = re.compile(
    r"\b(spoil(?:s|t|ed|ing)?|mend(?:s|ed|ing)?|strangers?|sparing(?:ly)?|knock(?:s|ed|ing)?|as lived"
    r"|what becomes of|in so many words|none the wiser|find together|that is none|entrants?|landing"
    r"|whoever|told|believed|affair|in sight|swing|so many|it is said|(?:process|thread) of its own)\b",
    re.IGNORECASE,
)
"""Say: corrupt, repair or correct, unknown, rate-limited, attempt, emulated, candidate, ramp down,
anyone who, reported or known, predicted or accepted, visible, rate times T, a number of, separate."""
PAGES = sorted(
    str(path.relative_to(TOP))
    for path in (*TOP.glob("*.md"), *(TOP / "docs").rglob("*.md"))
    if path.name != "CHANGELOG.md"
)
"""All but the changes, which name what there was."""
Texts = Callable[[str], Iterator[tuple[int, str]]]
CODE_FOLDERS = (*PACKAGES, *OUTSIDE, "tests", "benchmarks")


def private_words(text: str) -> list[str]:
    return PRIVATE.findall(" ".join(text.split()))


def names_of(source: str) -> Iterator[tuple[int, str]]:
    """Yield (line, words) of each name of a value, argument, function or class."""
    for node in ast.walk(ast.parse(source)):
        name = ""
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.arg(arg=name):
                pass
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name):
                pass
        if name:
            yield node.lineno, re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).replace("_", " ")


def prose_of(source: str) -> Iterator[tuple[int, str]]:
    """Yield (line, text) of each docstring, attribute docstrings included, and of each test's name."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            if isinstance(node.value.value, str):
                yield node.lineno, node.value.value
        elif isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
            yield node.lineno, node.name.replace("_", " ")


def findings(source: str, name: str, of: Texts = prose_of) -> list[str]:
    return [
        f"{name}:{line}: {', '.join(found)}"
        for line, text in sorted(of(source))
        if (found := private_words(text))
    ]


@pytest.mark.parametrize("page", PAGES)
def test_when_a_page_is_read_then_it_has_no_private_words(page: str) -> None:
    assert not private_words((TOP / page).read_text(encoding="utf-8"))


def test_when_the_help_is_printed_then_it_has_no_private_words() -> None:
    assert not private_words(commands_page())


def test_when_docstrings_and_test_names_are_read_then_they_have_no_private_words() -> None:
    found = [line for name, source in files_below(*CODE_FOLDERS) for line in findings(source, name)]
    assert not found, report(found)


def test_when_names_of_the_product_are_read_then_they_have_no_private_words() -> None:
    files = files_below(*PACKAGES, *OUTSIDE, "benchmarks")
    found = [line for name, source in files for line in findings(source, name, names_of)]
    assert not found, report(found)


@pytest.mark.parametrize(
    "text",
    ["One codec is spoilt.", "A rejoin\nmends it.", "A stranger knocked.", "what\nbecomes of it"],
)
def test_when_a_text_has_a_private_word_then_the_rule_finds_it(text: str) -> None:
    assert private_words(text)


def test_when_code_has_private_words_then_they_are_found_in_its_prose_alone() -> None:
    source = (
        '"""A rig that is none."""\n'
        "told = 1  # told\n"
        "class Rig:\n"
        "    volts: float\n"
        '    """for whoever asks"""\n'
        "def test_when_a_state_is_mended_then_it_flies() -> None:\n"
        "    told()\n"
    )
    assert [line.split(":")[1] for line in findings(source, "rig.py")] == ["1", "5", "6"]


def test_when_a_name_has_a_private_word_then_it_is_found() -> None:
    source = "told_s = 1\nclass Told: pass\ndef f(was_told): self.told = was_told\nuntold = 1\n"
    assert [line.split(":")[1] for line in findings(source, "rig.py", names_of)] == list("12333")
