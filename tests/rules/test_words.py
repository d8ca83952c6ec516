"""The pages and the command line use the words of the field, and none of a private vocabulary."""

from __future__ import annotations

import re

import pytest

from docs.tools.commands_page import commands_page
from tests.rules.sources import TOP

PRIVATE = re.compile(
    r"\b(spoil(?:s|t|ed|ing)?|mend(?:s|ed|ing)?|strangers?|sparing(?:ly)?|knock(?:s|ed|ing)?|as lived"
    r"|what becomes of|in so many words|none the wiser|find together|rig that is none)\b",
    re.IGNORECASE,
)
"""Say: corrupt, resynchronise or correct, unknown, rate-limited, attempt, live ..."""
ALLOWED: dict[str, tuple[str, ...]] = {}
"""Texts that quote something else: here the caption of a button."""
PAGES = sorted(
    str(path.relative_to(TOP)) for path in (TOP / "README.md", *(TOP / "docs").rglob("*.md"))
)


def private_words(text: str, allowed: tuple[str, ...] = ()) -> list[str]:
    for quoted in allowed:
        text = text.replace(quoted, "")
    return PRIVATE.findall(" ".join(text.split()))


@pytest.mark.parametrize("page", PAGES)
def test_when_a_page_is_read_then_it_has_no_private_words(page: str) -> None:
    assert not private_words((TOP / page).read_text(encoding="utf-8"), ALLOWED.get(page, ()))


def test_when_the_help_is_printed_then_it_has_no_private_words() -> None:
    assert not private_words(commands_page())


@pytest.mark.parametrize(
    "text",
    ["One codec is spoilt.", "A rejoin\nmends it.", "A stranger knocked.", "what\nbecomes of it"],
)
def test_when_a_text_has_a_private_word_then_the_rule_finds_it(text: str) -> None:
    assert private_words(text)


def test_when_an_exception_is_no_longer_needed_then_it_has_to_go() -> None:
    for page, quotes in ALLOWED.items():
        text = (TOP / page).read_text(encoding="utf-8")
        assert all(quoted in text and private_words(quoted) for quoted in quotes)
