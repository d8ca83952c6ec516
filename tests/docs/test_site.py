"""The site builds strictly, asks no other host for anything, and its links and equations are whole."""

from __future__ import annotations

import html.parser
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urldefrag

import pytest

from benchmarks.in_browser import served_folder
from tests.rules.sources import TOP

pytest.importorskip("mkdocs")
pytest.importorskip("material")

ENVIRONMENT = {**os.environ, "NO_MKDOCS_2_WARNING": "1", "PYTHONPATH": str(TOP)}
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
PAGES_LOOKED_AT = ("index.html", "theory/limits.html", "reference/python.html")


def build(target: Path, config: Path = TOP / "mkdocs.yml") -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"]
    command += ["--config-file", str(config), "--site-dir", str(target)]
    return subprocess.run(
        command, cwd=TOP, env=ENVIRONMENT, capture_output=True, text=True, timeout=300, check=False
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("site")
    result = build(target)
    assert result.returncode == 0, result.stderr
    assert not result.stdout + result.stderr, "a warning is an error here"
    return target


def pages(site: Path) -> list[Path]:
    return [page for page in sorted(site.rglob("*.html")) if page.name != "404.html"]


class References(html.parser.HTMLParser):
    """Collects what a page loads, where its links go, and its anchors."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = {name: value or "" for name, value in attrs}
        self.anchors |= {named[name] for name in ("id", "name") if name in named}
        if tag == "a" and "href" in named:
            self.links.append(named["href"])
        elif tag == "link" and named.get("rel") not in ("canonical", "next", "prev"):
            self.loads.append(named.get("href", ""))
        elif "src" in named:
            self.loads.append(named["src"])


@cache
def references(page: Path) -> References:
    return References(page)


def test_when_the_site_is_built_then_there_is_no_warning_and_every_page_is_there(site: Path) -> None:
    names = {page.relative_to(site).as_posix() for page in pages(site)}
    assert {"index.html", "faq.html", "rigs/index.html", "reference/python.html"} <= names
    for source in (TOP / "docs").rglob("*.md"):
        name = source.relative_to(TOP / "docs").with_suffix(".html").as_posix()
        if not name.startswith("tools/"):
            assert re.sub(r"README\.html$", "index.html", name) in names, (
                f"{source} is in no navigation"
            )


def test_when_a_page_is_loaded_then_everything_it_asks_for_is_in_the_site(site: Path) -> None:
    for page in pages(site):
        for target in references(page).loads:
            assert not re.match(r"(?:https?:)?//", target), f"{page}: {target}"
            if not target.startswith("data:"):
                assert (page.parent / unquote(target.split("?")[0])).is_file(), f"{page}: {target}"


def test_when_a_style_sheet_is_loaded_then_it_asks_no_other_host(site: Path) -> None:
    for sheet in site.rglob("*.css"):
        text = sheet.read_text(encoding="utf-8")
        assert not re.search(r"(?:@import|url\()\s*[\"']?(?:https?:)?//", text), sheet


def test_when_a_link_is_followed_then_page_and_anchor_are_there(site: Path) -> None:
    anchors = {page.resolve(): references(page).anchors for page in pages(site)}
    for page in pages(site):
        for link in references(page).links:
            if re.match(r"\w+:", link):
                continue
            path, fragment = urldefrag(unquote(link))
            target = (page.parent / path).resolve() if path else page.resolve()
            assert target.exists(), f"{page.relative_to(site)}: {link}"
            if fragment and target in anchors:
                assert fragment in anchors[target], f"{page.relative_to(site)}: {link}"


def test_when_an_equation_is_written_then_it_is_mathml_on_the_site(site: Path) -> None:
    for name, count in (("coding", 5), ("observer", 5), ("limits", 10)):
        text = (site / "theory" / f"{name}.html").read_text(encoding="utf-8")
        assert text.count("<math ") >= count
        assert "arithmatex" not in text
        assert not re.search(r"<m(?:text|i|o)>\\", text), "a command that was not understood"


def test_when_a_page_links_to_a_file_beside_the_docs_then_the_site_has_it(site: Path) -> None:
    assert "0.1.0" in (TOP / "pyproject.toml").read_text(encoding="utf-8")
    assert (site / "project" / "CONTRIBUTING.html").is_file()
    firmware = "examples/firmware/tenbaud_cobs/tenbaud_cobs.ino"
    assert (site / "source" / firmware).read_bytes() == (TOP / firmware).read_bytes()


@pytest.mark.parametrize(
    "corrupted", ["[there](nowhere.md)", "[there](faq.md#nowhere)", "[there](../NOWHERE.md)"]
)
@pytest.mark.soak
def test_when_a_link_is_broken_then_the_build_fails(corrupted: str, tmp_path: Path) -> None:
    ignored = shutil.ignore_patterns(".git", ".venv", "runs", "site", "__pycache__", ".*_cache")
    copy = tmp_path / "copy"
    shutil.copytree(TOP, copy, ignore=ignored)
    with (copy / "docs" / "index.md").open("a", encoding="utf-8") as page:
        page.write(f"\n{corrupted}\n")
    result = build(tmp_path / "site", copy / "mkdocs.yml")
    assert result.returncode != 0
    assert "there" in result.stderr or "nowhere" in result.stderr.lower()


@pytest.fixture
def address(site: Path) -> Iterator[str]:
    with served_folder(site) as found:
        yield found


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_when_a_browser_opens_the_site_then_it_asks_this_server_alone_and_draws_the_equations(
    address: str, site: Path
) -> None:
    sync_api = pytest.importorskip("playwright.sync_api")
    asked: list[str] = []
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        try:
            page = browser.new_page()
            page.on("request", lambda request: asked.append(request.url))
            for name in PAGES_LOOKED_AT:
                page.goto(f"{address}/{name}", wait_until="load", timeout=120_000)
                broken = "[...document.images].filter(image => !image.naturalWidth).length"
                assert page.evaluate(broken) == 0
            page.goto(f"{address}/theory/limits.html", wait_until="load", timeout=120_000)
            fraction = page.locator("math mfrac").first.bounding_box()
            assert fraction is not None
            assert fraction["height"] > 1.3 * page.locator("math mi").first.bounding_box()["height"]
            assert finds(page, "erasure"), "the search finds nothing"
        finally:
            browser.close()
    assert len(asked) > 10
    assert [url for url in asked if not url.startswith((address, "data:", "blob:"))] == []


def finds(page: Any, word: str) -> bool:
    """Type a word into the search until it answers: a slow machine may not be listening yet."""
    field = page.locator("[data-md-component=search-query]")
    for _ in range(30):
        field.fill("")
        field.press_sequentially(word)
        page.wait_for_timeout(2000)
        if page.locator(".md-search-result__link").count():
            return True
    return False
