"""The page in a real browser, beside a real flight: what a visitor sees and does."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from benchmarks.browser import Served, served, state_is, why_no_browser
from tests.tenbaud.view.viewers import number, wait

pytestmark = pytest.mark.skipif(why_no_browser() is not None, reason=str(why_no_browser()))

FLIGHT = ("--preset", "tuned-10baud", "--mismatch", "0.1")


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("flight")
    with served(folder, "demo", "--view", "--view-port", "0", *FLIGHT, "--out", "run") as one:
        yield one


@pytest.fixture(scope="module")
def tab(chromium: Any) -> Iterator[Any]:
    """One tab for all tests: to load the page in it takes a third of what a new one takes."""
    page = chromium.new_context(viewport={"width": 1200, "height": 900}).new_page()
    page.told = []
    page.asked = []
    page.on("pageerror", lambda error: page.told.append(str(error)))
    page.on("console", lambda line: page.told.append(line.text) if line.type == "error" else None)
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("websocket", lambda socket: page.asked.append(socket.url))
    yield page
    page.context.close()


@pytest.fixture
def page(tab: Any, flight: Served) -> Iterator[Any]:
    """The page as a visitor finds it who comes with the printed address."""
    tab.context.clear_cookies()
    tab.set_viewport_size({"width": 1200, "height": 900})
    tab.mouse.move(0.0, 0.0)
    tab.told.clear()
    tab.asked.clear()
    tab.goto(flight.url)
    state_is(tab, "lockstep")
    tab.get_by_role("button", name="Corrupt the transmitter's codec").wait_for()
    yield tab
    assert tab.told == []


TEXT_IS_NOT = "([id, old]) => document.getElementById(id).textContent !== old"
NUMBER = "parseFloat(document.getElementById('{}').textContent.replace('\\u2212', '-'))"


def test_it_loads_and_goes_on_by_itself_without_any_request_beyond_loopback(
    page: Any, flight: Served
) -> None:
    for element in ("f-time", "value", "digest-up"):
        old = page.locator(f"#{element}").inner_text()
        wait(page, TEXT_IS_NOT, [element, old])
    picture = page.locator("#helicopter .body").get_attribute("transform")
    wait(
        page,
        "(old) => document.querySelector('#helicopter .body').getAttribute('transform') !== old",
        picture,
    )
    assert page.locator("#digest-up").inner_text() != "\u2013"
    # Symbols that a busy machine misses lower it.
    wait(page, "() => /^[\\d.]+ of 10$/.test(document.getElementById('f-baud').textContent)")
    assert 0.0 < number(page, "#f-baud") < 10.5
    for canvas in ("#value-0", "#error-0", "#tape"):
        drawn = page.locator(canvas).evaluate(
            "(c) => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0)"
        )
        assert drawn, canvas
    assert page.locator("#banner").is_hidden()
    host = urlsplit(flight.url).netloc
    own = (f"http://{host}/", f"ws://{host}/", "data:")
    assert [url for url in page.asked if not url.startswith(own)] == []
    assert len(page.asked) > 5


def test_the_set_point_steers_the_flight_from_the_keyboard_alone(page: Any) -> None:
    page.keyboard.press("Tab")
    for _ in range(10):
        if page.evaluate("document.activeElement.getAttribute('aria-label')") == "Set-point":
            break
        page.keyboard.press("Tab")
    else:
        raise AssertionError("the set-point is not reached by Tab")
    slider = page.get_by_role("slider", name="Set-point")
    # It shows the reference that is followed, a square wave of 90 degrees, until the visitor moves it.
    wait(page, "() => [90, -90].includes(Number(document.activeElement.value))")
    assert slider.get_attribute("aria-valuetext") in ("90°", "\u221290°")
    page.keyboard.press("Home")
    for _ in range(60):
        place = int(slider.input_value())
        if place == 20:
            break
        page.keyboard.press("ArrowRight" if place < 20 else "ArrowLeft")
    assert slider.get_attribute("aria-valuetext") == "20°"
    page.get_by_text("set-point 20.0 deg").first.wait_for()
    page.get_by_role("button", name="25", exact=True).click()
    wait(page, f"() => Math.abs({NUMBER.format('value')} - 20) < 4")
    page.get_by_role("button", name="1", exact=True).click()
    page.get_by_role("button", name="Follow the reference").click()
    page.get_by_text("follow the reference").first.wait_for()


def test_a_slider_in_use_is_not_put_back_before_the_flight_could_follow(page: Any) -> None:
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Resume").wait_for()
    slider = page.get_by_role("slider", name="Set-point")
    slider.focus()
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    moved = slider.get_attribute("aria-valuetext")
    page.wait_for_timeout(2500.0)
    assert slider.get_attribute("aria-valuetext") == moved
    page.get_by_role("button", name="Resume").click()
    page.get_by_role("button", name="Follow the reference").click()
    wait(page, "() => [90, -90].includes(Number(document.querySelector('.slider input').value))")


LIVE_CHANGES = """async () => {
  const changed = [];
  const seen = new MutationObserver((all) => all.forEach((one) => changed.push(one.target.id)));
  for (const one of document.querySelectorAll("[aria-live], [role=status], [role=alert], output"))
    seen.observe(one, { subtree: true, childList: true, characterData: true });
  const time = () => parseFloat(document.getElementById("f-time").textContent), from = time();
  while (time() < from + 2) await new Promise((go) => setTimeout(go, 100));
  return [...changed, document.getElementById("announcement").textContent];
}"""


def test_a_screen_reader_hears_changes_of_state_alone_and_finds_one_main_part(page: Any) -> None:
    # A busy machine may lose sight of the flight for a while; what counts up would change every time.
    spans = (page.evaluate(LIVE_CHANGES) for _ in range(10))
    assert any(heard == ["In lockstep"] for heard in spans)
    assert page.get_by_role("main").count() == 1
    sliders = page.get_by_role("slider").all()
    assert [one.get_attribute("aria-valuetext") for one in sliders[1:]] == ["0 %", "0 %", "0 ms"]


def test_all_controls_are_in_the_first_view_of_a_small_screen(page: Any) -> None:
    page.set_viewport_size({"width": 1280, "height": 900})
    page.evaluate("scrollTo(0, 0)")
    bottoms = page.locator(".controls :is(button, input)").evaluate_all(
        "(all) => all.map((one) => one.getBoundingClientRect().bottom)"
    )
    assert len(bottoms) > 10
    assert max(bottoms) <= 900.0


def test_a_figure_is_explained_on_hover_and_on_focus(page: Any) -> None:
    term, tip = page.get_by_role("button", name="Range M"), page.get_by_role("tooltip")
    assert tip.count() == 0
    term.focus()
    page.keyboard.press("Shift+Tab")
    page.keyboard.press("Tab")
    assert "between \u2212M and +M" in tip.inner_text()
    page.keyboard.press("Escape")
    assert tip.count() == 0
    term.hover()
    assert "between \u2212M and +M" in tip.inner_text()


BROKEN = """() => document.getElementById("light").dataset.state === "broken"
  && ["digest-up", "digest-down", "light-text"].map((id) => document.getElementById(id).textContent)"""


def test_a_corrupted_end_turns_the_light_and_the_flight_recovers(page: Any) -> None:
    before = page.locator("#f-rejoins").inner_text()
    for name in ("Corrupt the transmitter's codec", "Corrupt the receiver's codec"):
        page.get_by_role("button", name=name).click()
        up, down, text = page.wait_for_function(BROKEN, timeout=60_000.0).json_value()
        assert up != down
        assert "differ after sample" in text
        state_is(page, "lockstep")
        page.get_by_text("equal again from sample").wait_for()
    wait(page, TEXT_IS_NOT, ["f-rejoins", before])
    (desyncs, rejoins), (desyncs_then, rejoins_then) = (
        map(int, text.split(", ")) for text in (before, page.locator("#f-rejoins").inner_text())
    )
    assert desyncs_then == desyncs + 2
    assert rejoins_then >= rejoins + 2, "a busy machine may add some of its own"


def test_the_clock_stands_still_steps_and_goes_on(page: Any) -> None:
    page.get_by_role("button", name="Pause").click()
    page.get_by_role("button", name="Resume").wait_for()
    wait(page, "() => document.getElementById('light-title').textContent === 'In lockstep, paused'")
    stood = None
    while stood != (stood := number(page, "#f-time")):
        page.wait_for_timeout(500.0)  # what was sent before may still be on its way
    page.wait_for_timeout(1200.0)
    assert number(page, "#f-time") == stood
    assert page.locator("#banner").is_hidden()
    page.get_by_role("button", name="Step: let one bit pass").click()
    wait(page, f"(old) => {NUMBER.format('f-time')} > old", stood)
    assert number(page, "#f-time") == pytest.approx(stood + 0.1)
    page.get_by_role("button", name="Resume").click()
    wait(page, f"(old) => {NUMBER.format('f-time')} > old + 0.5", stood)


def test_a_bad_wire_is_seen_and_repaired_by_every_visitor(page: Any, flight: Served) -> None:
    erased = number(page, "#f-erasures")
    other = page.context.new_page()
    other.goto(flight.url)
    other.get_by_role("slider", name="Bits lost").wait_for()
    slider = page.get_by_role("slider", name="Bits lost")
    slider.focus()
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    wait(page, "() => document.getElementById('flight').textContent.includes('up:loss=0.5')")
    wait(page, f"(old) => {NUMBER.format('f-erasures')} > old + 2", erased)
    value_is = "(value) => document.querySelector('[aria-label=\"Bits lost\"]').value === value"
    wait(other, value_is, "50")
    page.get_by_role("button", name="Repair the line").click()
    wait(other, value_is, "0")
    wait(page, "() => !document.getElementById('flight').textContent.includes('impaired')")
    wait(page, "() => document.querySelector('[aria-label=\"Bits lost\"]').value === '0'")
    assert slider.get_attribute("aria-valuetext") == "0 %"
    other.close()


@pytest.fixture(scope="module")
def phone(chromium: Any) -> Iterator[Any]:
    size = {"width": 360, "height": 740}
    page = chromium.new_context(viewport=size, has_touch=True, is_mobile=True).new_page()
    # Each visit begins without the colours that were chosen in the one before.
    page.add_init_script("try { localStorage.clear(); } catch {}")
    yield page
    page.context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_narrow_screen_shows_everything_without_scrolling_sideways(
    phone: Any, flight: Served, scheme: str
) -> None:
    phone.emulate_media(color_scheme=scheme)
    phone.goto(flight.url)
    state_is(phone, "lockstep")
    phone.get_by_role("button", name="Repair the line").wait_for()
    assert phone.evaluate("document.documentElement.scrollWidth") <= 360
    for element in ("#helicopter", "#value-0", "#tape", "#figures", ".panel >> nth=3"):
        box = phone.locator(element).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 360
    paper = phone.evaluate("getComputedStyle(document.body).backgroundColor")
    light = sum(int(part) for part in re.findall(r"\d+", paper)[:3]) > 384
    assert light is (scheme == "light")
    phone.get_by_role("button", name="Colours").click()
    phone.wait_for_timeout(200.0)
    assert phone.evaluate("document.body.classList.contains('body--dark')")
    phone.goto("about:blank")


def test_when_the_flight_falls_silent_or_ends_then_it_says_so(tab: Any, tmp_path: Path) -> None:
    arguments = ("demo", "--view", "--view-port", "0", "--duration", "600", "--out", "run")
    page = tab
    with served(tmp_path, *arguments) as one:
        page.goto(one.url)
        state_is(page, "lockstep")
        ends = _children(one.process.pid, "transmit", "receive")
        for pid in ends:
            _signal(pid, signal.SIGSTOP)
        page.get_by_text("the page shows old values").wait_for()
        state_is(page, "silent")
        for pid in ends:
            _signal(pid, signal.SIGCONT)
        state_is(page, "lockstep")
        one.process.send_signal(signal.SIGINT)
        page.get_by_text("The flight is over").first.wait_for()
        one.process.wait(240.0)
        page.goto("about:blank")
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["outcome"] == "stopped by the user"
    assert summary["duration_s"] > 0.0


def _children(parent: int, *verbs: str) -> list[int]:
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
            words = (path.parent / "cmdline").read_text().split("\0")
        except OSError:
            continue
        if int(fields[1]) == parent and set(words) & set(verbs):
            found.append(int(path.parent.name))
    assert len(found) == len(verbs)
    return found


def _signal(pid: int, number: int) -> None:
    import os

    os.kill(pid, number)
