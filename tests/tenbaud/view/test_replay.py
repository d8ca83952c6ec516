"""Recordings on the page, in a real browser: cursor, playing, events, two flights, a phone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from benchmarks.browser import Served, served, state_is, why_no_browser
from tenbaud import Run
from tests.tenbaud.flown import SECONDS, flown

pytestmark = pytest.mark.skipif(why_no_browser() is not None, reason=str(why_no_browser()))

BROKEN_AFTER = 60


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Run]:
    folder = tmp_path_factory.mktemp("runs")
    faults = {
        "link__impairments": "up:loss=0.2",
        "transmitter__sabotage": f"sample={BROKEN_AFTER},field=range",
    }
    return flown(folder / "ten", **faults), flown(folder / "usual", "usual-1000baud")


@pytest.fixture(scope="module")
def one_run(runs: tuple[Run, Run], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("one"), "view", str(runs[0].path), "--port", "0") as one:
        yield one


@pytest.fixture(scope="module")
def two_runs(runs: tuple[Run, Run], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    paths = [str(run.path) for run in runs]
    with served(tmp_path_factory.mktemp("two"), "view", *paths, "--port", "0") as one:
        yield one


PHONE = {"viewport": {"width": 360, "height": 740}, "has_touch": True, "is_mobile": True}
SCREEN = {"viewport": {"width": 1280, "height": 900}}


@pytest.fixture(scope="module")
def tabs(chromium: Any) -> Iterator[Callable[[bool], Any]]:
    """Return the tab of a screen, or of a phone: to load a page there takes less than in a new one."""

    @cache
    def tab(phone: bool) -> Any:
        page = chromium.new_context(**(PHONE if phone else SCREEN)).new_page()
        page.faults, page.asked = [], []
        page.on("pageerror", lambda error: page.faults.append(str(error)))
        page.on("console", lambda line: page.faults.append(line.text) if line.type == "error" else None)
        page.on("request", lambda request: page.asked.append(request.url))
        opened.append(page)
        return page

    opened: list[Any] = []
    yield tab
    for page in opened:
        page.context.close()


@pytest.fixture
def open_page(tabs: Callable[[bool], Any]) -> Iterator[Any]:
    opened = []

    def opening(one: Served, *, phone: bool = False, scheme: str = "light") -> Any:
        page = tabs(phone)
        page.emulate_media(color_scheme=scheme)
        page.context.clear_cookies()
        page.mouse.move(0.0, 0.0)
        page.faults.clear()
        page.asked.clear()
        page.goto(one.url)
        page.locator("#value-0").wait_for()
        opened.append(page)
        return page

    yield opening
    for page in opened:
        assert page.faults == []
        page.goto("about:blank")


def wait(page: Any, expression: str) -> None:
    page.wait_for_function(expression, timeout=60_000)


def cursor_is(page: Any, seconds: float) -> None:
    """Wait until the page shows this moment: its cursor, and the answer of the server."""
    wait(page, f"() => document.getElementById('f-time').textContent === '{seconds:.1f} s'")
    shown = page.get_by_role("slider", name="Flight time").get_attribute("aria-valuetext")
    assert float(shown.split()[0]) == pytest.approx(seconds)


def digest(run: Run, seconds: float, sample_s: float = 0.1) -> str:
    rows = run.table("transmitter", "sample").rows
    return str([one for one in rows if (one["sample"] + 1) * sample_s <= seconds + 1e-9][-1]["digest"])


def test_the_keyboard_moves_the_cursor_and_every_instrument_follows(
    open_page: Any, one_run: Served, runs: tuple[Run, Run]
) -> None:
    page, run = open_page(one_run), runs[0]
    cursor_is(page, SECONDS)
    page.keyboard.press("Home")
    cursor_is(page, 0.0)
    state_is(page, "waiting")
    page.keyboard.press("PageUp")
    cursor_is(page, 5.0)
    state_is(page, "lockstep")
    for _ in range(3):
        page.keyboard.press("ArrowLeft")
    cursor_is(page, 4.7)
    assert page.locator("#digest-up").inner_text() == digest(run, 4.7)
    assert page.locator("#digest-down").inner_text() == digest(run, 4.7)
    sign, degrees = re.findall(r"([+\u2212])([\d.]+)°", page.locator("#value").inner_text())[0]
    shown = float(degrees) * (1 if sign == "+" else -1)
    assert shown == pytest.approx(run.pitch[470] * 57.2958, abs=0.06)
    erased = sum(row["word"] is None for row in run.table("transmitter", "sample").rows[:47])
    wait(page, f"() => document.getElementById('f-erasures').textContent === '{erased}'")
    page.keyboard.press("End")
    cursor_is(page, SECONDS)
    page.get_by_text("The flight is over").first.wait_for()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    cursor_is(page, 0.1)
    host = urlsplit(one_run.url).netloc
    assert [url for url in page.asked if not url.startswith((f"http://{host}/", "data:"))] == []
    assert page.get_by_role("main").count() == 1
    assert page.locator(".controls").count() == 0, "a replay steers nothing"


def test_it_plays_at_any_speed_and_stops_at_the_end(open_page: Any, one_run: Served) -> None:
    page = open_page(one_run)
    cursor_is(page, SECONDS)
    play = page.locator("#play")
    page.keyboard.press("Space")
    assert play.inner_text() == "Pause"
    wait(page, "() => parseFloat(document.getElementById('f-time').textContent) > 0.5")
    page.keyboard.press("Space")
    assert play.inner_text() == "Play"
    page.wait_for_timeout(300.0)
    stood = page.locator("#cursor-text").inner_text()
    page.wait_for_timeout(300.0)
    assert page.locator("#cursor-text").inner_text() == stood
    page.get_by_role("button", name="25", exact=True).click()
    assert page.get_by_role("button", name="25", exact=True).get_attribute("aria-pressed") == "true"
    assert page.get_by_label("Speed, times real time").input_value() == "25"
    play.click()
    cursor_is(page, SECONDS)
    assert play.inner_text() == "Play"
    speed = page.get_by_label("Speed, times real time")
    speed.fill("-1000")
    page.locator("#cursor").focus()
    page.keyboard.press("PageDown")
    cursor_is(page, SECONDS - 5.0)
    play.click()
    page.wait_for_timeout(300.0)
    play.click()
    assert float(page.locator("#cursor-text").inner_text().split()[0]) >= SECONDS - 5.0
    speed.fill("1000")
    play.click()
    wait(page, "() => document.getElementById('play').textContent === 'Play'")
    cursor_is(page, SECONDS)


def test_events_are_listed_up_to_the_cursor_and_lead_to_their_moment(
    open_page: Any, one_run: Served
) -> None:
    page = open_page(one_run)
    cursor_is(page, SECONDS)
    page.keyboard.press("Home")
    cursor_is(page, 0.0)
    page.get_by_role("button", name="Next event").click()
    wait(page, "() => parseFloat(document.getElementById('f-time').textContent) > 5")
    state_is(page, "broken")
    assert f"differ after sample {BROKEN_AFTER}" in page.locator("#light-text").inner_text()
    assert page.locator("#digest-up").inner_text() != page.locator("#digest-down").inner_text()
    broken_s = page.locator("#f-time").inner_text()
    page.keyboard.press("End")
    cursor_is(page, SECONDS)
    page.locator("#events .event").filter(has_text="differ").first.click()
    wait(page, f"() => document.getElementById('f-time').textContent === '{broken_s}'")
    times = page.locator("#events time").all_inner_texts()
    assert max(float(one.split()[0]) for one in times) <= float(broken_s.split()[0]) + 0.05
    page.get_by_role("button", name="Previous event").click()
    cursor_is(page, 0.0)


def test_a_click_on_a_curve_jumps_there_and_curves_can_be_enlarged(
    open_page: Any, one_run: Served
) -> None:
    page = open_page(one_run)
    cursor_is(page, SECONDS)
    box = page.locator("#value-0").bounding_box()
    page.locator("#value-0").click(position={"x": 46 + (box["width"] - 50) / 2, "y": 40})
    wait(page, "() => Math.abs(parseFloat(document.getElementById('f-time').textContent) - 6) < 0.11")
    page.get_by_label("Curves show").select_option("3")
    page.get_by_text("3 s of 12 s").wait_for()
    page.locator("#value-0").click(position={"x": 47, "y": 40})
    wait(page, "() => Math.abs(parseFloat(document.getElementById('f-time').textContent) - 4.5) < 0.11")


def test_two_flights_are_laid_over_each_other_with_their_names_bits_and_digests(
    open_page: Any, two_runs: Served, runs: tuple[Run, Run]
) -> None:
    page = open_page(two_runs)
    legend = page.locator("#curves-legend").inner_text()
    assert "ten (tuned-10baud)" in legend
    assert "usual (usual-1000baud)" in legend
    cursor_is(page, SECONDS)
    page.keyboard.press("Home")
    page.keyboard.press("PageUp")
    cursor_is(page, 5.0)
    # The usual loop names no picture of its own.
    assert page.locator('[id="helicopter@1"]').is_visible()
    for suffix, run, sample_s in (("", runs[0], 0.1), ("@1", runs[1], 0.01)):
        for end in ("up", "down"):
            shown = page.locator(f'[id="digest-{end}{suffix}"]').inner_text()
            assert shown == digest(run, 5.0, sample_s)
        drawn = page.locator(f'[id="tape{suffix}"]').evaluate(
            "(c) => c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((v) => v > 0)"
        )
        assert drawn
    colours = """(names) => {
      const [canvas, style] = [document.getElementById("error-0"), getComputedStyle(document.body)];
      const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
      const found = new Set();
      for (let at = 0; at < data.length; at += 4)
        found.add("#" + [0, 1, 2].map((one) => data[at + one].toString(16).padStart(2, "0")).join(""));
      return names.map((name) => found.has(style.getPropertyValue(name).trim()));
    }"""
    assert page.evaluate(colours, ["--run-0", "--run-1", "--run-2"]) == [True, True, False]
    ids = "[...document.querySelectorAll('[id]')].map((one) => one.id)"
    found = page.evaluate(ids)
    assert len(found) == len(set(found))
    box = page.locator("#transport").bounding_box()
    assert box["y"] + box["height"] < 900.0


def test_flights_of_unlike_inputs_have_bars_and_pictures_of_their_own(
    open_page: Any, tmp_path: Path
) -> None:
    presets = ("integrator-10baud", "servo-10baud")
    runs = [str(flown(tmp_path / name, name, duration_s=1.0).path) for name in presets]
    with served(tmp_path, "view", *runs, "--port", "0") as one:
        page = open_page(one)
        page.keyboard.press("End")
        cursor_is(page, 1.0)
        for suffix, name, unit in (("", "acceleration", "rad/s^2"), ("@1", "voltage", "V")):
            bars = page.locator(f'[id="inputs{suffix}"]').inner_text().split("\n")
            assert (bars[0], bars[1].split()[1]) == (name, unit)
        assert page.locator('[id="dial"]').is_hidden()
        assert page.locator('[id="dial@1"]').is_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_shows_two_flights_without_scrolling_sideways(
    open_page: Any, two_runs: Served, scheme: str
) -> None:
    page = open_page(two_runs, phone=True, scheme=scheme)
    page.locator("#play").tap()
    wait(page, "() => parseFloat(document.getElementById('f-time').textContent) > 0.3")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    for element in ("#cursor", "#value-0", '[id="tape@1"]', "#figures"):
        box = page.locator(element).bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 360


CLOSED_AFTER = """([frame, isBinary]) => new Promise((go) => {
  const socket = new WebSocket(new URL("stream", location.href.replace("http", "ws")));
  socket.onopen = () => socket.send(isBinary ? new TextEncoder().encode(frame) : frame);
  socket.onclose = ({ code }) => go(code);
})"""


def test_the_stream_closes_on_what_is_no_question(open_page: Any, one_run: Served) -> None:
    page = open_page(one_run)
    frames = (('{"at_s":1}', True), ('{"at_s":1,"from_s":"-inf","to_s":"inf"}', False), ("[]", False))
    for frame in frames:
        assert page.evaluate(CLOSED_AFTER, list(frame)) == 1003, frame


def test_one_address_is_printed_and_nothing_is_served_without_its_secret(
    one_run: Served, tabs: Callable[[bool], Any]
) -> None:
    assert one_run.look_url == ""
    page = tabs(False)
    page.context.clear_cookies()
    answer = page.goto(one_run.url.partition("?")[0])
    assert answer.status == 403
    page.goto("about:blank")
