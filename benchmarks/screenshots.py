"""Makes the pictures of the live page in `docs/figures`: `python -m benchmarks.screenshots`."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.browser import browser, served, state_is, why_no_browser

DESK = {"width": 1200, "height": 900}
PHONE = {"width": 390, "height": 844}
FLIGHT = ("--preset", "tuned-10baud", "--mismatch", "0.1", "--disturbance", "q=2e-3")
LOOK_S = 26.0


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
    return made


if __name__ == "__main__":
    problem = why_no_browser()
    if problem:
        sys.exit(problem)
    target = Path(__file__).parents[1] / "docs" / "figures"
    for picture in make(target):
        print(f"{picture.name}  {picture.stat().st_size / 1000:.0f} kB")
