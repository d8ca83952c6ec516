"""Lines for terminals that are narrower than they are."""

from __future__ import annotations

import shutil
import sys
from textwrap import wrap

INDENT = 4
"""of what a line goes on with, beyond its own"""


def for_terminal(text: str) -> str:
    """Return lines broken between words where standard output is a terminal; others as they are."""
    if not sys.stdout.isatty():
        return text
    width = shutil.get_terminal_size().columns
    return "\n".join(one for line in text.split("\n") for one in broken(line, width))


def broken(line: str, width: int) -> list[str]:
    """Return a line in pieces of at most `width` characters; a longer word stays whole."""
    if len(line) <= width:
        return [line]
    indent = len(line) - len(line.lstrip()) + INDENT
    start, further = line[: indent - INDENT], " " * min(indent, width // 4)
    return wrap(
        line.strip(),
        width,
        initial_indent=start,
        subsequent_indent=further,
        break_long_words=False,
        break_on_hyphens=False,
        replace_whitespace=False,
    )
