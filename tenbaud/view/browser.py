"""Opens an address in this machine's browser without naming it to the other users of the machine.

The words that start a browser can be read by everybody (`ps`). So it is given a file that only this
user can read, and that leads on to the address.
"""

from __future__ import annotations

import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

LEAD_ON = '<!doctype html><meta http-equiv="refresh" content="0; url={}"><title>tenbaud</title>'

STATIC = Path(__file__).parent / "static"
"""What a browser gets as it is: the page's instruments, its script and its style."""


@contextmanager
def open_privately() -> Iterator[Callable[[str], None]]:
    """Within the `with`, the function opens addresses; at its end the file is gone."""
    with TemporaryDirectory(prefix="tenbaud-open-") as folder:  # of mode 0700

        def show(address: str) -> None:
            file = Path(folder) / "page.html"
            file.write_text(LEAD_ON.format(escape(address)), encoding="utf-8")
            webbrowser.open(file.as_uri())

        yield show
