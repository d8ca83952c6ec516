"""Replaces every sentence by nonsense, in this process or, by a `sitecustomize`, in others."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from channel.protocol import bounds
from tenbaud.flight import outcome
from tenbaud.sentences import endings, events
from tests.tenbaud.processes import REPOSITORY

NONSENSE = "colourless green ideas sleep furiously"
SITE = """
from tests.tenbaud.endings.nonsense import replace
replace(setattr)
"""


def replace(put: Callable[[object, str, object], object]) -> None:
    """Replace the sentences of this process; `put` is `setattr`, or what a test can undo."""
    for module in (events, endings):
        for name in vars(module):
            if name.endswith("_text"):
                put(module, name, lambda *_: NONSENSE)
    # What peers and outcomes say comes through these.
    put(bounds, "shown", lambda *_: NONSENSE)
    kept = outcome.Outcome.__init__

    def said(self: outcome.Outcome, code: outcome.ExitCode, _text: str, *rest: object) -> None:
        kept(self, code, NONSENSE, *rest)  # type: ignore[arg-type]

    put(outcome.Outcome, "__init__", said)


def environment(folder: Path) -> dict[str, str]:
    """Return the environment of a process that says nothing but nonsense."""
    folder.mkdir(exist_ok=True)
    (folder / "sitecustomize.py").write_text(SITE, encoding="utf-8")
    return {"PYTHONPATH": os.pathsep.join([str(folder), str(REPOSITORY)])}
