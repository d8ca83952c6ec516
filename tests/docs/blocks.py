"""Finds the command blocks of the Markdown pages, and what is written above them for the tests.

A block of commands is fenced as `sh` (every line is a command) or as `console` (lines after `$ ` are
commands, the others what they say); one fenced as `python` is run by a fresh interpreter. A comment
right above the fence may say how it is run:

    <!-- test: skip, needs a serial port -->      not here, for this reason
    <!-- test: soak, ten minutes of flights -->   with the long tests only
    <!-- test: background -->                     goes on while the next blocks run, in another terminal
    <!-- test: exit=5 -->                         is to end with this exit code

Several may be given, between semicolons. `skip` and `soak` need a reason.

A fence with a title, such as `sh title="desk"`, is typed in on the machine that the title names. Every
block of such a page has one; `tests/network/test_pages.py` runs them, on machines made of namespaces.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from tests.rules.sources import TOP

RUN_LANGUAGES = ("sh", "console", "python")
NOTE = re.compile(r"^\s*<!--\s*test:\s*(.*?)\s*-->\s*$")
FENCE = re.compile(r'^(?P<indent>\s*)```(?P<language>[\w-]*)(?:\s+title="(?P<title>[^"]*)")?\s*$')
ANY_FENCE = re.compile(r"^\s*(?:```|~~~)")
COMMAND = re.compile(r"^\s*(?:\$ )?(?:tenbaud|make|python3? -m|pip|uvx?|pytest|sudo)(?:\s+[\w.'\"-]|$)")
"""What looks like a command, wherever it stands."""


class NoteError(ValueError):
    """A note above a block that cannot be understood."""


@dataclass(frozen=True, slots=True)
class Block:
    """One fenced block."""

    page: str
    line: int
    """of its first line of content"""
    language: str
    text: str
    skip: str = ""
    """why it is not run; empty: it is"""
    soak: str = ""
    """why it runs with the long tests only"""
    background: bool = False
    exit_code: int = 0
    title: str = ""
    """the machine that it is typed in on, and after a colon how; empty: this one"""

    @property
    def machine(self) -> str:
        """Return the name of the machine in its title."""
        return self.title.partition(":")[0]

    @property
    def name(self) -> str:
        return f"{self.page}:{self.line}"

    @property
    def runs(self) -> bool:
        return self.language in RUN_LANGUAGES

    @property
    def script(self) -> str:
        """Return its commands."""
        if self.language != "console":
            return self.text
        return "\n".join(line[2:] for line in self.text.splitlines() if line.startswith("$ "))

    @property
    def promised(self) -> list[str]:
        """Return the lines of output that it shows, without those that are left out by `...`."""
        if self.language != "console":
            return []
        lines = [line for line in self.text.splitlines() if not line.startswith("$ ")]
        return [line for line in lines if line.strip() not in ("", "...")]


def pages() -> list[str]:
    """Return every Markdown page that people read, from the top folder."""
    found = sorted(TOP.glob("*.md"))
    for folder in ("docs", "examples"):
        found += sorted((TOP / folder).rglob("*.md"))
    names = [path.relative_to(TOP).as_posix() for path in found]
    return [name for name in names if not name.startswith("docs/tools/")]


def blocks_of(page: str) -> list[Block]:
    """Return the fenced blocks of a page, in order; NoteError for a note that says nothing known."""
    return parse((TOP / page).read_text(encoding="utf-8"), page)


def parse(text: str, page: str) -> list[Block]:
    """Return the fenced blocks of a text."""
    found = []
    lines = text.splitlines()
    note = ""
    index = 0
    while index < len(lines):
        line = lines[index]
        if (noted := NOTE.match(line)) is not None:
            note = noted[1]
        elif (fence := FENCE.match(line)) is not None:
            end = _end(lines, index, page)
            indent = len(fence["indent"])
            content = [
                one[indent:] if one[:indent].isspace() else one for one in lines[index + 1 : end]
            ]
            settings = _settings(note, page) | {"title": fence["title"] or ""}
            found.append(
                Block(page, index + 2, fence["language"], "\n".join(content), **settings)  # type: ignore[arg-type]
            )
            note, index = "", end
        elif ANY_FENCE.match(line):
            raise NoteError(f"{page}:{index + 1}: a fence of a form that the tests do not read: {line}")
        elif line.strip():
            note = _unused(note, page, index)
        index += 1
    _unused(note, page, index)
    return found


def stray_commands(text: str, page: str) -> list[str]:
    """Return the commands that stand where nobody runs them: indented, or in a fence of no language."""
    found = []
    inside: str | None = None
    for number, line in enumerate(text.splitlines(), start=1):
        fence = FENCE.match(line)
        if fence is not None or line.strip() == "```":
            inside = (fence["language"] if fence else "") if inside is None else None
        elif inside in (*RUN_LANGUAGES, "toml", "yaml") or "      " in line.split("#")[0].strip():
            continue  # what is run, what is no shell, and drawings
        elif COMMAND.match(line) and (inside is not None or line.startswith("    ")):
            found.append(f"{page}:{number}: {line.strip()}")
    return found


def _end(lines: list[str], start: int, page: str) -> int:
    for index in range(start + 1, len(lines)):
        if lines[index].strip() == "```":
            return index
    raise NoteError(f"{page}:{start + 1}: the fence is not closed")


def _settings(note: str, page: str) -> dict[str, object]:
    settings: dict[str, object] = {}
    for part in filter(None, (one.strip() for one in note.split(";"))):
        word, _, reason = (one.strip() for one in part.partition(","))
        if word in ("skip", "soak") and reason:
            settings[word] = reason
        elif word == "background":
            settings["background"] = True
        elif re.fullmatch(r"exit=\d+", word):
            settings["exit_code"] = int(word[5:])
        else:
            raise NoteError(f"{page}: `test: {part}` says nothing known, or lacks its reason")
    return settings


def _unused(note: str, page: str, index: int) -> str:
    if note:
        raise NoteError(f"{page}:{index + 1}: `test: {note}` stands above no block")
    return ""


def needed(page: str) -> Path:
    """Return the page's path."""
    return TOP / page
