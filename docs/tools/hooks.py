"""What MkDocs does on top: equations as MathML, and links that leave docs/ for the repository.

The pages are read in two places, on the site and in the repository. They are written for the
repository (relative links, `$...$` for equations) and this makes them right on the site:

* an equation becomes MathML while the site is built, which browsers draw by themselves;
* the page on which both ends fly in the browser is added (`docs/tools/browser.py`);
* a link to a file outside docs/, such as `../CONTRIBUTING.md`, takes that file along: Markdown as a
  page of its own below `project/`, anything else as a plain file below `source/`.
"""

from __future__ import annotations

import html
import posixpath
import re
from collections.abc import Callable
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files, InclusionLevel
from mkdocs.structure.pages import Page

from docs.tools.browser import page_files

TOP = Path(__file__).resolve().parents[2]

LINK = re.compile(r"(?P<head>!?\[[^\]]*\]\()(?P<target>[^)\s#]+)(?P<anchor>#[^)\s]*)?(?P<tail>\))")
MATH = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\s*\\(?P<open>[(\[])(?P<tex>.*?)\\[)\]]\s*</(?P=tag)>',
    re.DOTALL,
)
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the flight in the browser, the files outside docs/ that pages link to, and theirs."""
    for uri, data in page_files().items():
        files.append(File.generated(config, uri, content=data, inclusion=InclusionLevel.INCLUDED))
    waiting = [
        (_place_of(file.src_uri), Path(file.abs_src_path or "").read_text(encoding="utf-8"))
        for file in files.documentation_pages()
    ]
    while waiting:
        place, text = waiting.pop()
        for target in _outside(place, text):
            source = TOP / target
            uri = _site_uri(target)
            if files.get_file_from_path(uri) is not None or not source.is_file():
                continue
            if source.suffix == ".md":
                content = source.read_text(encoding="utf-8")
                files.append(File.generated(config, uri, content=content))
                waiting.append((target, content))
            else:
                files.append(File.generated(config, uri, content=source.read_bytes()))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Point the links of a page at where their files are on the site."""
    place = _place_of(page.file.src_uri)

    def moved(match: re.Match[str]) -> str:
        target = _resolve(place, match["target"])
        if target is None:
            return match[0]
        uri = _site_uri(target)
        if files.get_file_from_path(uri) is None:
            return match[0]
        link = posixpath.relpath(uri, posixpath.dirname(page.file.src_uri) or ".")
        return match["head"] + link + (match["anchor"] or "") + match["tail"]

    return _outside_fences(markdown, lambda text: LINK.sub(moved, text))


def on_page_content(content: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turn every equation into MathML."""

    def drawn(match: re.Match[str]) -> str:
        display = "block" if match["open"] == "[" else "inline"
        return convert(html.unescape(match["tex"]).strip(), display=display)

    return MATH.sub(drawn, content)


def _place_of(uri: str) -> str:
    """Return where a page of the site is in the repository."""
    return uri.removeprefix("project/") if uri.startswith("project/") else f"docs/{uri}"


def _site_uri(target: str) -> str:
    """Return where a file of the repository is on the site."""
    if target.startswith("docs/"):
        return target.removeprefix("docs/")
    return f"project/{target}" if target.endswith(".md") else f"source/{target}"


def _resolve(place: str, target: str) -> str | None:
    """Return what a link of a file means in the repository, None for addresses and anchors."""
    if ":" in target or target.startswith(("/", "#")):
        return None
    return posixpath.normpath(posixpath.join(posixpath.dirname(place), target))


def _outside(place: str, text: str) -> set[str]:
    found: set[str] = set()

    def look(part: str) -> str:
        for match in LINK.finditer(part):
            target = _resolve(place, match["target"])
            if target is not None and not target.startswith(("docs/", "..")):
                found.add(target)
        return part

    _outside_fences(text, look)
    return found


def _outside_fences(text: str, change: Callable[[str], str]) -> str:
    """Apply `change` to the text between fenced blocks."""
    parts = []
    position = 0
    for fence in FENCE.finditer(text):
        parts += [change(text[position : fence.start()]), fence[0]]
        position = fence.end()
    return "".join([*parts, change(text[position:])])
