"""The pages that are written from the code say what the code says."""

from __future__ import annotations

import re
from functools import cache

import pytest

from docs.tools import commands_page as commands
from docs.tools import configuration_page as configuration
from docs.tools.meanings import MEANINGS
from docs.tools.reference import PAGES
from tenbaud.cli.commands import app
from tenbaud.config.load import load_config, preset_names
from tenbaud.config.schema import FlightConfig
from tests.rules.sources import TOP

commands_page = cache(commands.commands_page)
configuration_page = cache(configuration.configuration_page)


@pytest.mark.parametrize("name", PAGES)
def test_when_the_code_changes_then_its_page_is_written_anew(name: str) -> None:
    written = (TOP / name).read_text(encoding="utf-8")
    assert written == PAGES[name](), f"{name} is not what the code says; run: make reference"


def section_of(page: str, title: str) -> str:
    return page.split(f"## {title}\n", 1)[1].split("\n## ", 1)[0]


@pytest.mark.parametrize(
    ("section", "row"),
    [
        ("`[timing]`", "| `tick_s` | s | `0.01` | number ≥ 1e-05, ≤ 1 | h: control tick |"),
        ("`[link]`", "| `best_effort` |  | `false` | `true`, `false` |"),
        ("`[transmitter.bridge.pitch]`", "| `counts_per_turn` | counts/turn | `4096` |"),
        ('`[coder]` with `kind = "zoom"`', "| `window_signs` | signs | `2` | whole number ≥ 1, ≤ 16 |"),
        ("`[transmitter]`", "| `ramp_s` | s | `1.0` | number ≥ 1e-09, ≤ 1000000000 |"),
    ],
)
def test_when_a_field_is_looked_up_then_unit_default_range_and_meaning_are_there(
    section: str, row: str
) -> None:
    assert row in section_of(configuration_page(), section)


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def test_every_field_has_a_meaning_and_the_unit_of_its_name() -> None:
    rows = [cells(line) for line in configuration_page().splitlines() if line.startswith("| `")]
    assert len(rows) > 200
    assert [field for field, *_, meaning in rows if not meaning] == []
    suffixes = {
        "_per_s2": "/s²",
        "_rad_s": "rad/s",
        "_per_s": "s",
        "_rad": "rad",
        "_s": "s",
        "_hz": "Hz",
    }
    for field, unit, *_ in rows:
        ending = next((one for one in suffixes if field.strip("`").endswith(one)), None)
        assert ending is None or unit.endswith(suffixes[ending]), (field, unit)
    assert not re.search(
        r"(?<!rad)/s$|^s$", dict(row[:2] for row in rows)["`rate_observer_bandwidth_rad_s`"]
    )


def test_no_meaning_is_kept_for_a_field_that_is_gone() -> None:
    page = configuration_page()
    assert [name for name, text in MEANINGS.items() if f"| {text} |" not in page] == []


def leaves(values: dict[str, object], name: str = "") -> list[tuple[str, str]]:
    """Return (section, field) of everything that a configuration holds."""
    found = []
    for field, value in values.items():
        if isinstance(value, dict) and not field.endswith(("_weights", "options", "inputs")):
            found += leaves(value, f"{name}.{field}" if name else field)
        else:
            found.append((name, field))
    return found


@pytest.mark.parametrize("preset", preset_names())
def test_when_a_preset_is_loaded_then_every_field_of_it_is_on_the_page(preset: str) -> None:
    page = configuration_page()
    for section, field in leaves(load_config(preset).model_dump()):
        if field == "kind" and section in ("model", "coder"):
            continue
        # A section of one signal stands on the page once, as NAME.
        headings = (f"## `[{section}]`", f"## `[{section.rpartition('.')[0]}.NAME]`")
        titles = [line for line in page.splitlines() if line.startswith(headings)]
        texts = [section_of(page, title[3:]) for title in titles or ["## Top level"]]
        assert any(f"| `{field}` |" in text for text in texts), (section, field)


def test_when_the_page_is_read_then_every_table_is_whole() -> None:
    for text in (configuration_page(), commands_page()):
        for block in re.findall(r"(?:^\|.*\n)+", text, re.MULTILINE):
            columns = {len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}
            assert len(columns) == 1, block
    assert "annotation=" not in configuration_page()
    assert FlightConfig.model_fields.keys() >= {"timing", "link"}


def test_when_a_command_is_looked_up_then_it_and_its_options_are_there() -> None:
    page = commands_page()
    names = [info.name or info.callback.__name__ for info in app.registered_commands if info.callback]
    for name in names:
        assert f"## `tenbaud {name.replace('_', '-')}`" in page
    demo = section_of(page, "`tenbaud demo`")
    assert "| `--set` TEXT, repeatable |" in demo
    assert "| `--clock` real\\|virtual | `virtual` |" in demo
    assert "--run-folder" not in page, "hidden options stay hidden"
