"""Makes the pictures of the live page in `docs/figures`: `python -m benchmarks.screenshots`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.browser import browser, served, state_is, why_no_browser
from tenbaud import fly

DESK = {"width": 1280, "height": 900}
PHONE = {"width": 390, "height": 844}
FLIGHT = ("--preset", "tuned-10baud", "--mismatch", "0.1", "--disturbance", "q=2e-3")
LOOK_S = 26.0
_MISMATCH = {"duration_s": 60.0, "transmitter.plant.mismatch": 0.1}
_FAULTS = {"link.impairments": "up:loss=0.1", "transmitter.sabotage": "sample=240,field=range"}
REPLAYED: tuple[tuple[str, str, dict[str, Any]], ...] = (
    ("lossy", "tuned-10baud", _MISMATCH | _FAULTS),
    ("at-10", "tuned-10baud", _MISMATCH),
    ("at-1000", "usual-1000baud", _MISMATCH),
)
"""Name, preset and settings of the runs that are replayed."""


def make(folder: Path) -> list[Path]:
    """Fly once with the page, and make every picture; return them."""
    made: list[Path] = []

    def take(page: Any, name: str) -> None:
        # The pointer away from buttons: what it hovers over looks different.
        page.mouse.move(1, 1)
        path = folder / f"page-{name}.png"
        page.screenshot(path=path, full_page=True)
        made.append(path)

    with (
        tempfile.TemporaryDirectory() as runs,
        served(Path(runs), "demo", "--view", "--view-port", "0", *FLIGHT) as one,
        browser() as chromium,
    ):
        light = chromium.new_page(viewport=DESK, color_scheme="light")
        dark = chromium.new_page(viewport=DESK, color_scheme="dark")
        phone = chromium.new_page(viewport=PHONE, color_scheme="light")
        for page in (light, dark, phone):
            page.goto(one.url)
            state_is(page, "lockstep")
        light.wait_for_timeout(LOOK_S * 1000.0)
        take(light, "flight")
        take(phone, "phone")
        light.get_by_role("slider", name="Bits lost").focus()
        for _ in range(6):
            light.keyboard.press("ArrowRight")
        light.wait_for_timeout(4000.0)
        light.get_by_role("button", name="Corrupt the receiver's codec").click()
        state_is(light, "broken")
        take(light, "broken")
        light.get_by_role("button", name="Repair the line").click()
        state_is(light, "lockstep")
        light.wait_for_timeout(3000.0)
        take(light, "recovered")
        take(dark, "dark")
    with tempfile.TemporaryDirectory() as runs, browser() as chromium:
        made += _replays(Path(runs), folder, chromium)
    return made


def _replays(runs: Path, folder: Path, chromium: Any) -> list[Path]:
    """Make the pictures of a replay of one run, and of two: 10 and 1000 bit/s."""
    made = []
    for name, preset, settings in REPLAYED:
        fly(preset, settings=settings, out=runs / name)
    for picture, names in (("replay", ["lossy"]), ("overlay", ["at-10", "at-1000"])):
        with served(runs, "view", *names, "--port", "0") as one:
            page = chromium.new_page(viewport=DESK, color_scheme="light")
            page.goto(one.url)
            page.locator("#value-0").wait_for()
            if picture == "replay":
                page.get_by_label("Curves show").select_option("30")
                page.get_by_role("button", name="Next event").click()
            else:
                for _ in range(4):
                    page.keyboard.press("PageUp")
            page.wait_for_timeout(1000.0)
            page.mouse.move(1, 1)
            made.append(folder / f"page-{picture}.png")
            page.screenshot(path=made[-1], full_page=True)
    return made


if __name__ == "__main__":
    problem = why_no_browser()
    if problem:
        sys.exit(problem)
    target = Path(__file__).parents[1] / "docs" / "figures"
    for picture in make(target):
        print(f"{picture.name}  {picture.stat().st_size / 1000:.0f} kB")
