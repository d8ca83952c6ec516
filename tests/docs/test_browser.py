"""The page on which both ends fly in the browser: in Chromium, and its file replayed by CPython."""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from benchmarks.browser import browser, state_is, why_no_browser
from benchmarks.in_browser import served_folder, write_page
from docs.browser.flight import BrowserFlight, FlightParts
from docs.tools import browser as page
from tenbaud.cli.commands import app
from tenbaud.replay.control import controller_of
from tenbaud.replay.refly import flown_again
from tenbaud.replay.symbols import unpack

WHY = why_no_browser() or page.why_no_pyodide()
needs_both = pytest.mark.skipif(WHY is not None, reason=str(WHY))
KEEP_DIGESTS = """
const Plain = Worker;
window.digests = {};
window.Worker = class extends Plain {
  constructor(...given) {
    super(...given);
    this.addEventListener("message", ({ data }) => {
      if (!data.news) return;
      for (const row of JSON.parse(data.news).samples) digests[row[0]] = [row[3], row[4]];
    });
  }
};
"""


@cache
def parts() -> bytes:
    return page.flight_parts()


def changed_parts(**changes: Any) -> bytes:
    found: FlightParts = pickle.loads(parts())
    file = io.BytesIO()
    page.PartsPickler(file, protocol=4).dump(replace(found, **changes))
    return file.getvalue()


@pytest.fixture
def address(tmp_path: Path) -> Iterator[str]:
    write_page(tmp_path)
    with served_folder(tmp_path) as found:
        yield f"{found}/browser/flight.html"


def set_slider(one: Any, name: str, value: int) -> None:
    one.fill(f"#{name}", str(value))
    one.dispatch_event(f"#{name}", "change")


@needs_both
def test_a_flight_in_the_browser_breaks_recovers_and_is_replayed_with_the_same_states(
    address: str, tmp_path: Path
) -> None:
    asked: list[str] = []
    top = address.rpartition("/browser")[0]
    with browser() as chromium:
        one = chromium.new_page()
        one.on("request", lambda request: asked.append(request.url))
        one.add_init_script(KEEP_DIGESTS)
        one.goto(address)
        state_is(one, "lockstep", 120.0)
        set_slider(one, "set-point", 30)
        set_slider(one, "loss", 30)
        set_slider(one, "flip", 5)
        for end in ("transmitter", "receiver"):
            one.click(f"#corrupt-{end}")
            state_is(one, "broken", 60.0)
            state_is(one, "lockstep", 60.0)
        one.click('[data-pace="20"]')
        one.wait_for_function("() => Object.keys(digests).length > 300", timeout=120_000)
        assert one.locator("#f-rejoins").inner_text() == "2, 2"
        assert int(one.locator("#f-erasures").inner_text()) > 20
        one.click("#pause")
        one.wait_for_function("() => document.querySelector('#speed').textContent === 'paused'")
        with one.expect_download() as download:
            one.click("#download")
        path = tmp_path / "flight.symbols"
        download.value.save_as(path)
        digests = {int(sample): pair for sample, pair in one.evaluate("digests").items()}
        one.click("#again")
        one.get_by_text("0, 0", exact=True).wait_for()
        state_is(one, "lockstep", 60.0)
        assert one.input_value("#loss") == "0"
    assert [url for url in asked if not url.startswith((top, "blob:"))] == []
    result = CliRunner().invoke(app, ["replay", str(path)])
    assert result.exit_code == 0, result.output
    assert "it is the state with which the flight ended" in result.output
    unpacked = unpack(path)
    assert len(unpacked.epochs) == 3
    assert any(value != 0.0 for _, value in unpacked.steps)
    controller = controller_of(unpacked.agreement.config, unpacked.steps)
    flown = flown_again(unpacked.agreement, controller, unpacked.epochs)
    again = {one.sample: one.digest for one in flown}
    assert len(digests) > 300
    # Only the corrupted end differs, at one sample each.
    assert len([pair for pair in digests.values() if pair[0] != pair[1]]) == 2
    assert [sample for sample, pair in digests.items() if again[sample] not in pair] == []


@needs_both
def test_when_the_parts_cannot_be_loaded_then_the_page_reports_it(address: str, tmp_path: Path) -> None:
    (tmp_path / "browser" / "parts.pickle").unlink()
    with browser() as chromium:
        one = chromium.new_page()
        one.goto(address)
        one.get_by_text("parts.pickle is missing: 404").wait_for(timeout=120_000)
        assert one.locator("fieldset:enabled").count() == 0


def test_when_a_machine_computes_otherwise_then_its_flight_is_refused() -> None:
    identity = replace(pickle.loads(parts()).identity, numerics_probe=bytes(8))
    with pytest.raises(RuntimeError, match="numerics"):
        BrowserFlight(changed_parts(identity=identity))


def test_when_its_time_is_over_then_the_flight_ends_and_its_file_has_every_word(tmp_path: Path) -> None:
    flight = BrowserFlight(changed_parts(flight_ticks=500))
    assert flight.advance(1e9, 600.0) == 5.0
    assert flight.over
    assert '"phase": "ended"' in flight.news(1.0, False)
    path = tmp_path / "flight.symbols"
    path.write_bytes(flight.symbols_file())
    (epoch,) = unpack(path).epochs
    assert len(epoch.words) == 50


def test_the_archive_has_no_module_that_needs_a_package() -> None:
    names = page.modules_of(parts())
    assert "channel/codec/codec.py" in names
    assert [name for name in names if name.startswith(("tenbaud/config", "tenbaud/build"))] == []


def test_without_pyodide_the_site_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(page, "PYODIDE", Path("nowhere"))
    assert "make pyodide" in str(page.why_no_pyodide())
    (content,) = page.page_files().values()
    assert b"make docs" in content
