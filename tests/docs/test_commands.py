"""Every command block of every page is typed in, in order, in a copy of the repository.

What is not run says why above it, and is reported as skipped with that reason: `pytest -rs tests/docs`.
"""

from __future__ import annotations

import re
import time
from pathlib import Path

import pytest

from docs.tools.commands_page import commands_page
from tests import warm
from tests.docs.blocks import COMMAND, Block, NoteError, blocks_of, needed, pages, parse, stray_commands
from tests.docs.sandbox import BlockFailed, Sandbox

ELSEWHERE = ("README.md",)
"""Walked by `test_newcomer.py`, which looks at what comes of it as well."""
ON_MACHINES = ("docs/two-machines.md", "docs/router.md")
"""Walked by `tests/network/test_pages.py`, each block on the machine that its title names."""
RUN = {page: [block for block in blocks_of(page) if block.runs] for page in pages()}
NORMAL = [
    page
    for page, blocks in sorted(RUN.items(), key=lambda item: -len(item[1]))  # the longest first
    if page not in (*ELSEWHERE, *ON_MACHINES) and any(not (one.skip or one.soak) for one in blocks)
]
LONG = [
    page
    for page, blocks in RUN.items()
    if page not in ON_MACHINES and any(one.soak and not one.skip for one in blocks)
]
NOT_RUN = [block for blocks in RUN.values() for block in blocks if block.skip]


def type_in(blocks: list[Block], folder: Path, timeout_s: float, copies: bool) -> None:
    with Sandbox(folder, timeout_s, copies) as sandbox:
        for block in blocks:
            sandbox.run(block)
        sandbox.end()


@pytest.mark.parametrize("page", NORMAL)
def test_when_a_page_is_typed_in_then_every_command_does_what_it_says(
    page: str, tmp_path: Path
) -> None:
    type_in([block for block in RUN[page] if not (block.skip or block.soak)], tmp_path, 150.0, True)


@pytest.mark.soak
@pytest.mark.parametrize("page", LONG)
def test_when_a_page_is_typed_in_whole_then_its_long_commands_work_too(
    page: str, tmp_path: Path
) -> None:
    type_in([block for block in RUN[page] if not block.skip], tmp_path, 3600.0, False)


@pytest.mark.parametrize("block", NOT_RUN, ids=lambda block: block.name)
def test_when_a_block_cannot_be_run_here_then_its_options_exist_and_it_is_reported(
    block: Block,
) -> None:
    problems = unknown_words(block)
    assert not problems, problems
    pytest.skip(f"{block.name}: {block.skip}")


@pytest.mark.parametrize("page", pages())
def test_when_a_page_shows_a_command_then_it_is_in_a_block_that_is_run(page: str) -> None:
    found = stray_commands(needed(page).read_text(encoding="utf-8"), page)
    assert not found, "fence these as sh or console:\n" + "\n".join(found)


def test_when_the_pages_are_collected_then_the_readme_and_the_docs_are_among_them() -> None:
    assert {"README.md", "CONTRIBUTING.md", "docs/serial.md", "docs/rigs/emulator.md"} <= set(RUN)
    assert sum(len(blocks) for blocks in RUN.values()) > 30


def test_when_a_block_has_a_title_then_its_page_is_one_that_is_walked_on_machines() -> None:
    titled = {page for page, blocks in RUN.items() if any(one.title for one in blocks)}
    assert titled == set(ON_MACHINES)
    for page in ON_MACHINES:
        assert all(block.title for block in RUN[page]), f"{page}: a block that names no machine"
        assert not any(block.soak for block in RUN[page]), (
            f"{page}: nothing runs a block for soak there"
        )


def unknown_words(block: Block) -> list[str]:
    """Return the verbs and options of a block that `tenbaud` does not know."""
    page = commands_page()
    problems = []
    for line in re.sub(r"\\\n", " ", block.script).splitlines():
        words = line.split("#")[0].split()
        if not words or words[0] != "tenbaud" or len(words) == 1:
            continue
        verbs = [verb for verb in (" ".join(words[:3]), " ".join(words[:2])) if f"## `{verb}`" in page]
        if not verbs:
            problems.append(f"{block.name}: no such command: {line.strip()}")
            continue
        section = page.split(f"## `{verbs[0]}`", 1)[1].split("\n## ", 1)[0]
        problems += [
            f"{block.name}: {verbs[0]} has no {word}: {line.strip()}"
            for word in words
            if word.startswith("--") and f"`{word.partition('=')[0]}`" not in section
        ]
    return problems


def block_of(text: str) -> Block:
    (block,) = parse(text, "a.md")
    return block


@pytest.mark.parametrize(
    ("text", "settings"),
    [
        ("```sh\ntrue\n```", {}),
        ("<!-- test: skip, needs a rig -->\n```sh\ntrue\n```", {"skip": "needs a rig"}),
        ("<!-- test: soak, an hour -->\n\n```sh\ntrue\n```", {"soak": "an hour"}),
        ("<!-- test: background; exit=5 -->\n```sh\ntrue\n```", {"background": True, "exit_code": 5}),
        ('<!-- test: background -->\n```sh title="a: b"\ntrue\n```', {"title": "a: b", "machine": "a"}),
    ],
)
def test_when_a_note_stands_above_a_block_then_it_is_understood(
    text: str, settings: dict[str, object]
) -> None:
    block = block_of(text)
    assert {name: getattr(block, name) for name in settings} == settings


@pytest.mark.parametrize(
    "text",
    [
        "<!-- test: skip -->\n```sh\ntrue\n```",
        "<!-- test: sometimes -->\n```sh\ntrue\n```",
        "<!-- test: soak, long -->\n\nSome text.\n\n```sh\ntrue\n```",
        "```sh\ntrue\n",
        "```sh hl_lines=1\ntrue\n```",
        "~~~sh\ntrue\n~~~",
    ],
)
def test_when_a_note_or_a_fence_is_wrong_then_it_is_reported(text: str) -> None:
    with pytest.raises(NoteError):
        parse(text, "a.md")


@pytest.mark.parametrize(
    "text",
    [
        '```text title="desk"\ntenbaud demo\n```',
        "```\ntenbaud demo\n```",
        "Text:\n\n    tenbaud demo\n",
        "```text\nmake test\n```",
    ],
)
def test_when_a_command_stands_where_nobody_runs_it_then_it_is_reported(text: str) -> None:
    assert stray_commands(text, "a.md")
    assert COMMAND.match(text.splitlines()[1]) or "demo" in text


@pytest.mark.parametrize("script", ["tenbaud fly", "tenbaud demo --fly", "tenbaud demo \\\n  --fly=1"])
def test_when_a_command_that_is_not_run_has_an_unknown_word_then_it_is_reported(script: str) -> None:
    assert unknown_words(block_of(f"```sh\n{script}\n```"))


@pytest.mark.parametrize("copies", [False, True])
def test_when_a_block_fails_or_says_something_else_then_the_page_fails(
    copies: bool, tmp_path: Path
) -> None:
    with Sandbox(tmp_path, copies=copies) as sandbox:
        sandbox.run(block_of("```console\n$ echo one; echo two\n...\ntwo\n```"))
        assert sandbox.run(block_of("```python\nprint(\"a\", 'b')\n```")) == "a b\n"
        for text in (
            "```python\nraise SystemExit(1)\n```",
            "```sh\nfalse\ntrue\n```",
            "<!-- test: exit=3 -->\n```sh\ntrue\n```",
            "```console\n$ echo one\ntwo\n```",
        ):
            with pytest.raises(BlockFailed):
                sandbox.run(block_of(text))
        sandbox.run(block_of("<!-- test: background -->\n```sh\necho here; sleep 60\n```"))
        sandbox.end()


@pytest.mark.skipif(warm.CLONE is None, reason="copies are made on Linux alone")
def test_when_a_copied_command_is_interrupted_or_killed_then_so_is_its_copy(tmp_path: Path) -> None:
    code = "import os, time; open('pid', 'w').write(str(os.getpid())); time.sleep(60)"
    until_it_runs = "until test -s pid; do sleep 0.1; done"
    with Sandbox(tmp_path, copies=True) as sandbox:
        for name, ended in (("INT", 130), ("TERM", 143), ("KILL", 137)):
            kill = f'python -c "{code}" & {until_it_runs}; kill -{name} $!; wait $!'
            sandbox.run(block_of(f"<!-- test: exit={ended} -->\n```sh\n{kill}\n```"))
            copy = Path("/proc") / (sandbox.top / "pid").read_text()
            until = time.monotonic() + 60.0
            while copy.exists() and time.monotonic() < until:
                time.sleep(0.05)
            assert not copy.exists()
            (sandbox.top / "pid").unlink()
        said = sandbox.run(block_of("<!-- test: exit=2 -->\n```sh\ntenbaud inspect nothing\n```"))
        assert "nothing does not exist" in said


def test_when_a_block_takes_too_long_then_it_is_ended(tmp_path: Path) -> None:
    with (
        Sandbox(tmp_path, timeout_s=0.5) as sandbox,
        pytest.raises(BlockFailed, match=r"longer than 0\.5 s"),
    ):
        sandbox.run(block_of("```sh\nsleep 60\n```"))
