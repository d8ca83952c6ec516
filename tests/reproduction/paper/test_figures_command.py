"""`tenbaud figures` as its user runs it, and the page that is in the repository."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from reproduction.paper import plan
from tenbaud.cli.commands import app
from tests.reproduction.paper.recorded_data import FOLDER, needs_data
from tests.rules.sources import TOP

PAGE = TOP / "docs" / "REPRODUCTION.md"
PICTURES_BYTES_MAX = 3_000_000


def run(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["figures", *arguments])
    assert result.exit_code == 0, result.output
    return result.output


def is_png(path: Path) -> bool:
    return path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and path.stat().st_size > 10_000


def test_when_figure_7_is_asked_for_then_two_processes_fly_twice_and_it_is_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(plan, "DURATION_S", 30.0)
    out = tmp_path / "out"
    said = run("7", "--out", str(out))
    assert "2 flights" in said
    assert is_png(out / "figures" / "paper-figure-7.png")
    assert (out / "paper-figure-7.svg").read_text().startswith("<?xml")
    flights = sorted(path.name for path in (out / "flights").iterdir())
    assert flights == ["paper-10baud-0percent", "paper-10baud-10percent"]
    for name in flights:
        assert (out / "flights" / name / "receiver.mcap").stat().st_size > 10_000
    assert not (out / "REPRODUCTION.md").exists(), "one figure does not make the page"


@pytest.mark.filterwarnings("error::FutureWarning")  # of old names in a configuration
def test_when_figures_3_4_and_5_are_asked_for_then_nothing_is_flown(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert "0 flights" in run("3", "4", "5", "--out", str(out))
    for number in (3, 4, 5):
        assert is_png(out / "figures" / f"paper-figure-{number}.png")


@pytest.mark.parametrize("name", ["2", "9", "alll"])
def test_when_a_figure_is_unknown_then_the_known_ones_are_listed(name: str) -> None:
    result = CliRunner().invoke(app, ["figures", name])
    assert result.exit_code == 2
    assert "known are 3, 4, 5, 6, 7, 8 and all" in re.sub(r"[\s│]+", " ", result.output)


def test_when_the_page_is_looked_at_then_its_pictures_are_there_and_small() -> None:
    text = PAGE.read_text(encoding="utf-8")
    pictures = [PAGE.parent / name for name in re.findall(r"!\[.*?\]\((.+?)\)", text)]
    assert len(pictures) == 7
    assert all(is_png(picture) for picture in pictures)
    assert sum(path.stat().st_size for path in (TOP / "docs").rglob("*.png")) < PICTURES_BYTES_MAX


def test_when_the_page_is_looked_at_then_its_tables_are_whole() -> None:
    blocks = re.findall(r"(?:^\|.*\n)+", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(blocks) >= 8
    for block in blocks:
        assert len({line.count("|") for line in block.splitlines()}) == 1, block


def test_when_the_readme_is_read_then_it_links_the_page() -> None:
    assert "](docs/REPRODUCTION.md)" in (TOP / "README.md").read_text(encoding="utf-8")


@needs_data
@pytest.mark.soak
def test_when_all_figures_are_made_then_the_page_is_written_with_every_section(tmp_path: Path) -> None:
    docs = tmp_path / "docs"
    run("all", "--docs", str(docs), "--data", str(FOLDER), "--out", str(tmp_path / "out"))
    written = (docs / "REPRODUCTION.md").read_text(encoding="utf-8")
    assert re.findall(r"^## .*", written, re.MULTILINE) == re.findall(
        r"^## .*", PAGE.read_text(encoding="utf-8"), re.MULTILINE
    )
    assert len(list((docs / "figures").glob("*.png"))) == 7
