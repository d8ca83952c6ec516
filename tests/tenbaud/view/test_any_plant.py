"""The page shows plants of any outputs with their names, units and pictures."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.browser import served, state_is, why_no_browser
from tenbaud.recording.pose import helicopter_lines
from tenbaud.telemetry.schema import TELEMETRY
from tests.tenbaud.view.viewers import number, wait

pytestmark = pytest.mark.skipif(why_no_browser() is not None, reason=str(why_no_browser()))

PICTURES = {
    "pendulum": ["160 132"],
    "dial": ["160 100"],
    "rotary pendulum": ["84 70", "238 112"],
}
"""Pictures, and what their parts turn about."""


def test_without_a_flight_it_says_so_and_then_shows_a_plant_of_any_outputs_with_names_and_units(
    chromium: Any, tmp_path: Path
) -> None:
    from channel.links.zenoh.telemetry import TelemetryPort

    place = f"unixsock-stream/{tmp_path}/t.sock"
    signals = [
        {"name": name, "unit": unit, "low": None, "high": None}
        for name, unit in (("arm", "rad"), ("cart_place", "m"), ("torque", "N m"))
    ]
    point = {"time_s": 0.9, "measured": [0.5, 1.5], "true": None, "live": None}
    message = {
        "role": "transmitter", "version": 3, "session": "lab",
        "plant": {"model": "mine:Model", "picture": "", "outputs": signals[:2], "inputs": signals[2:]},
        "flight": 5, "number": 1,
        "phase": "flying", "clock": "real", "takes_commands": False, "time_s": 1.0, "epoch": 0,
        "impairments": "", "counts": {"erasures": 0, "desyncs": 0, "rejoins": 0, "digest_checks": 1},
        "events": [], "dropped": 0, "preset": "x", "tick_s": 0.01, "symbol_period_s": 0.1,
        "baud_configured": 10.0, "duration_s": 100.0,
        "samples": [{"sample": number, "word_sent": [1], "word": [1], "about": [int(number > 2)],
                     "digest": "aa", "peer_digest": "aa"} for number in range(4)],
        "points": [{**point, "coded": [0.25, 1.25], "range": [0.1, 0.5]}],
        "guard": "running", "applied": [-0.25], "paused": False, "pace": None,
        "lateness": {"p50_ms": 0.1, "p99_ms": 0.25, "max_ms": 1.0}, "gap_to_floor": 1.42,
    }  # fmt: skip
    TELEMETRY.validate_python(message)
    with served(tmp_path, "view", "--port", "0", "--connect", place) as one:
        page = chromium.new_page()
        page.goto(one.url)
        check_without_a_flight(page)
        port = TelemetryPort("transmitter", "lab", place)
        for _ in range(100):
            port.publish(json.dumps(message).encode())
            page.wait_for_timeout(100.0)
            if page.locator("#f-gap").is_visible():
                break
        assert (number(page, "#f-gap"), number(page, "#f-late")) == (1.42, 0.25)
        for canvas in ("#value-0", "#error-0", "#value-1", "#error-1"):
            assert page.locator(canvas).is_visible()
        assert "Cart place m, last 30 s of flight" in page.locator("#curves").inner_text()
        assert page.locator("#outputs").inner_text().split("\n") == [
            *("arm", "+28.6°", "cart place", "+1.50 m")
        ]
        assert page.locator("#inputs").inner_text().split("\n") == ["torque", "\u22120.250 N m"]
        assert page.locator("#f-error").inner_text() == "+14.32°, +0.250 m"
        assert page.locator(".plant:visible").count() == 0
        assert page.locator("#bit-keys").inner_text() == "arm 75 %cart place 25 %"
        colour = "(name) => getComputedStyle(document.body).getPropertyValue(name).trim()"
        pixels = "getElementById('tape').getContext('2d').getImageData(x, y, 1, 1).data"
        tape = f"([x, y]) => [...document.{pixels}]"
        width = page.locator("#tape").bounding_box()["width"]
        for place, cell in ((1, 0), (0, 1)):
            found = page.evaluate(tape, [int(width - 18 * cell - 9), 15])
            shown = page.evaluate(colour, f"--output-{place}")
            assert "#{:02x}{:02x}{:02x}".format(*found[:3]) == shown
        check_pictures(page, port, message, signals)
        check_pose(page, port, message)
        check_digests(page, port, message)
        page.get_by_text("takes no commands").wait_for()
        page.close()
    port.close()


def check_without_a_flight(page: Any) -> None:
    """Check that a page before any flight says so, and steers nothing."""
    page.get_by_text("No flight found. Start one").wait_for()
    assert page.get_by_role("button", name="Corrupt the transmitter's codec").is_disabled()
    state_is(page, "waiting")


def check_pictures(
    page: Any, port: Any, message: dict[str, Any], signals: list[dict[str, Any]]
) -> None:
    """Check that angles in radians and in degrees turn the parts of each picture by as much."""
    point = {"time_s": message["time_s"], "true": None, "live": None}
    for picture, turned in PICTURES.items():
        count = len(turned)
        message["plant"] = {**message["plant"], "picture": picture, "outputs": signals[:count]}
        message["points"] = [{**point, "time_s": message["time_s"], "measured": [0.5] * count,
                              "coded": [0.25] * count, "range": [0.1] * count}]  # fmt: skip
        port.publish(json.dumps(message).encode())
        page.locator(f"#{picture.replace(' ', '-')}").wait_for()
        assert page.locator(".plant:visible").count() == 1
        bodies = page.locator(".plant:visible .body").all()
        assert [one.get_attribute("transform") for one in bodies] == [
            f"rotate(-28.65 {centre})" for centre in turned
        ]
    degrees = {"name": "tilt", "unit": "deg", "low": -45.0, "high": 45.0}
    message["plant"] = {**message["plant"], "picture": "pendulum", "outputs": [degrees]}
    message["points"] = [{**point, "time_s": message["time_s"], "measured": [30.0],
                          "coded": [29.0], "range": [2.0]}]  # fmt: skip
    port.publish(json.dumps(message).encode())
    wait(page, "() => document.getElementById('value').textContent === '+30.0°'")
    turned_by = page.locator("#pendulum .body").get_attribute("transform")
    assert turned_by == "rotate(-30.00 160 132)", "an angle in degrees is turned once"


@pytest.mark.parametrize(
    ("unit", "high", "factor"),
    [("rad", np.pi / 4.0, np.pi / 180.0), ("mrad", 250.0 * np.pi, np.pi / 0.18), ("deg", 45.0, 1.0)],
)
def test_a_set_point_slider_is_in_degrees_whatever_the_unit_of_the_angle(
    unit: str, high: float, factor: float
) -> None:
    from tenbaud.view.page import slider_spread

    spread, shown, found = slider_spread({"low": -high * 1.0001, "high": high * 1.0001, "unit": unit})
    assert (spread, shown, found) == ((-45, 45, 5), "°", pytest.approx(factor))


def check_digests(page: Any, port: Any, message: dict[str, Any]) -> None:
    """Check that the digits of a digest that came are compared, and that none are no difference."""
    own = "0123456789abcdef"
    cases = [("…cdef", "lockstep", {4: "cdef"}), ("…cdee", "broken", {5: "cdee"}),
             (own, "lockstep", {6: own, 7: ""})]  # fmt: skip
    for shown, state, came in cases:
        one = {"word_sent": [1], "word": [1], "about": [0], "digest": own}
        message["samples"] = [one | {"sample": sample, "peer_digest": came[sample]} for sample in came]
        TELEMETRY.validate_python(message)
        port.publish(json.dumps(message).encode())
        wait(page, "(text) => document.getElementById('digest-down').textContent === text", shown)
        state_is(page, state)


def check_pose(page: Any, port: Any, message: dict[str, Any]) -> None:
    """Check that the helicopter of three axes is drawn by the same lines as in figures."""
    poses = {"body": (0.3, 0.2, -0.4), "estimate": (0.0, 0.0, 0.0)}
    point = {"time_s": message["time_s"], "true": None, "live": None, "range": [0.1] * 3}
    message["points"] = [{**point, "measured": poses["body"], "coded": poses["estimate"]}]
    axes = [{"name": name, "unit": "rad", "low": None, "high": None} for name in ("a", "b", "c")]
    message["plant"] = {**message["plant"], "picture": "helicopter", "outputs": axes}
    port.publish(json.dumps(message).encode())
    page.locator("#helicopter-3").wait_for()
    for part, pose in poses.items():
        drawn = page.locator(f"#helicopter-3 .{part} path").first.get_attribute("d")
        found = [float(one) for one in re.findall(r"[-.\d]+", drawn)]
        arm = np.array([138.0, 122.0]) + helicopter_lines(*pose)[0] * [118.0, -118.0]
        assert found[:4] == pytest.approx(arm.ravel().tolist(), abs=0.06), part
