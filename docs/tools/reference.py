"""Writes the reference pages that follow from the code: `make reference`.

With `--check` nothing is written; the exit code is 1 if a page is not what the code says.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

TOP = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TOP))

from docs.tools.commands_page import commands_page  # noqa: E402
from docs.tools.configuration_page import configuration_page  # noqa: E402
from docs.tools.summary_page import summary_page  # noqa: E402
from docs.tools.wire_page import wire_page  # noqa: E402

PAGES: dict[str, Callable[[], str]] = {
    "docs/reference/commands.md": commands_page,
    "docs/reference/configuration.md": configuration_page,
    "docs/reference/summary.md": summary_page,
    "docs/reference/wire-format.md": wire_page,
}


def main(arguments: list[str]) -> int:
    """Write or check every page; return the exit code."""
    stale = 0
    for name, page in PAGES.items():
        path = TOP / name
        text = page()
        if path.is_file() and path.read_text(encoding="utf-8") == text:
            continue
        stale += 1
        if "--check" in arguments:
            print(f"{name} is not what the code says; run: make reference", file=sys.stderr)
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            print(f"written: {name}")
    return 1 if stale and "--check" in arguments else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
