"""The page: instruments drawn by its own script, and controls that send commands to the flight."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from functools import partial
from html import escape
from typing import Any

from nicegui import ui

from channel.line.impairments import parse_impairments
from tenbaud.view.board import Board
from tenbaud.view.browser import STATIC
from tenbaud.view.feed import Feed

REFRESH_S = 0.25
SET_POINT_STEP_DEG = 5
REPORT_S = 2.0
"""A command shows in the telemetry by then."""
SET_POINT_STEPS = 40
DEGREE = {"rad": math.radians(1.0), "mrad": 1000.0 * math.radians(1.0), "deg": 1.0, "°": 1.0}
"""One degree in the units of angles; `static/units.js` has the same."""
PACES = {0.25: "¼", 1.0: "1", 5.0: "5", 25.0: "25"}

LOOK_ONLY = "This address is view-only: it has no controls."

Send = Callable[..., None]
Moved = Callable[[float], None]
Spread = tuple[float, float, float]
"""least, most and step"""


def build_page(board: Board, feed: Feed, *, steers: bool) -> None:
    """Build the page for one browser; `steers`: whether its visitor may send commands."""
    # Relative: the page is served below a path of its visitor.
    ui.add_head_html('<link rel="stylesheet" href="view/view.css">')
    ui.add_body_html((STATIC / "instruments.html").read_text(encoding="utf-8"))
    ui.dark_mode(value=None)
    # The page has a main landmark of its own.
    ui.query(".q-page").props('role="none"')
    if steers:
        _add_controls(board, feed)
    else:
        with ui.element("section").classes("controls").props('aria-label="Controls"'):
            ui.label(LOOK_ONLY).classes("controls-note").props('role="status"')


def _add_controls(board: Board, feed: Feed) -> None:
    def send(**command: object) -> None:
        head = board.heads.get("transmitter") or board.heads.get("receiver")
        if head is not None and head["takes_commands"]:
            feed.send(head["session"], command)

    with ui.element("section").classes("controls").props('aria-label="Controls"'):
        note = ui.label().classes("controls-note").props('role="status"')
        with ui.element("div").classes("controls-grid"):
            panels = [_SetPoint(send), _Clock(send), _Line(send), _Break(send)]

    def refresh() -> None:
        upper, lower = board.heads.get("transmitter"), board.heads.get("receiver")
        note.set_text(_why_not(upper or lower))
        note.set_visibility(bool(note.text))
        allowed = not note.text
        for panel in panels:
            panel.refresh(allowed, upper or {}, lower or {})

    refresh()
    ui.timer(REFRESH_S, refresh)


def _why_not(head: dict[str, Any] | None) -> str:
    if head is None:
        return "Waiting for a flight."
    if head["phase"] == "ended":
        return "The flight is over."
    if not head["takes_commands"]:
        return "This flight takes no commands: start both its ends with --allow-control to steer it."
    return ""


class _Panel:
    """A titled group of controls."""

    def __init__(self, title: str, text: str) -> None:
        self.box = ui.element("fieldset").classes("panel")
        self._enabled: bool | None = None
        self.controls: list[Any] = []
        with self.box:
            ui.element("legend").add_slot("default", f"{title}")
            ui.label(text).classes("hint")

    def enable(self, enabled: bool) -> None:
        if enabled is not self._enabled:
            self._enabled = enabled
            # The browser disables its own sliders with their group, NiceGUI's buttons it does not.
            self.box.props(remove="disabled") if enabled else self.box.props("disabled")
            for control in self.controls:
                control.set_enabled(enabled)

    def refresh(self, allowed: bool, upper: dict[str, Any], lower: dict[str, Any]) -> None:
        """Follow the newest messages of both ends; `allowed`: the flight may be steered."""
        self.enable(allowed)

    def button(self, text: str, act: Callable[[], None], label: str = "") -> Any:
        button = ui.button(text, on_click=act, color=None).props("unelevated no-caps")
        if label:
            button.props(f'aria-label="{label}"')
        self.controls.append(button)
        return button


class _Slider:
    """The browser's own slider, which every keyboard and screen reader knows how to use.

    It is plain HTML whose value the visitor and the page's script change: one that the server renders
    again would jump back during a quick movement. The script reads the attributes `data`, of which
    `output` makes it follow the set-point of that output. `moved` is called on release, or at each key.
    """

    def __init__(self, name: str, spread: Spread, unit: str, moved: Moved, **data: float) -> None:
        self.value = 0.0
        self._moved = moved
        least, most, step = spread
        name, unit = escape(name), escape(unit)
        attributes = " ".join(f'data-{key}="{value}"' for key, value in data.items())
        self._element = ui.html(
            f'<span>{name}</span><span class="slider-value" aria-hidden="true">0{unit}</span>'
            f'<input type="range" min="{least}" max="{most}" step="{step}" value="0" '
            f'aria-label="{name}" aria-valuetext="0{unit}" data-unit="{unit}" {attributes}>',
            sanitize=False,
            tag="label",
        ).classes("slider")
        number = "(event) => emit(Number(event.target.value))"
        self._element.on("change", lambda event: self._take(event.args), js_handler=number)

    def show(self, value: float) -> None:
        """Show what there is at present, without a command."""
        self.value = value
        ui.run_javascript(
            f"document.querySelector('#c{self._element.id} input').dataset.present = {value:g};"
        )

    def _take(self, value: float) -> None:
        self.value = value
        self._moved(value)


class _SetPoint(_Panel):
    def __init__(self, send: Send) -> None:
        super().__init__("Set-point", "What the controller aims for.")
        self._send = send
        self._outputs: list[dict[str, Any]] = []
        with self.box:
            self._sliders = ui.element("div")
            self.button("Follow the reference", self._follow)

    def _follow(self) -> None:
        for place in range(len(self._outputs)):
            self._send(kind="set_point", value=None, output=place)

    def _build(self, outputs: list[dict[str, Any]], steerable: list[bool]) -> None:
        """Make a slider for each output that can be steered."""
        self._outputs = outputs
        self._sliders.clear()
        with self._sliders:
            for place, (output, can) in enumerate(zip(outputs, steerable, strict=False)):
                if not can:
                    continue
                spread, unit, factor = slider_spread(output)
                words = str(output["name"]).replace("_", " ")
                name = "Set-point" if len(outputs) == 1 else f"Set-point of {words}"
                _Slider(
                    name, spread, unit, partial(self._moved, place, factor), output=place, factor=factor
                )

    def _moved(self, place: int, factor: float, value: float) -> None:
        self._send(kind="set_point", value=value * factor, output=place)

    def refresh(self, allowed: bool, upper: dict[str, Any], lower: dict[str, Any]) -> None:
        outputs = lower["plant"]["outputs"] if lower else []
        if outputs != self._outputs:
            self._build(outputs, lower["steerable"])
        self.enable(allowed and any(lower.get("steerable", ())))


def slider_spread(output: dict[str, Any]) -> tuple[Spread, str, float]:
    """Return least, most and step of a slider, its unit, and what its value is multiplied by.

    Angles are in degrees. Without a range in the plant's description: 90 degrees, or 1.
    """
    low, high, unit = output["low"], output["high"], str(output["unit"])
    known = low is not None and high is not None
    if unit in DEGREE:
        degree = DEGREE[unit]
        ends = (math.ceil(low / degree), math.floor(high / degree)) if known else (-90, 90)
        return (*ends, SET_POINT_STEP_DEG), "°", degree
    low, high = (low, high) if known else (-1.0, 1.0)
    return (low, high, (high - low) / SET_POINT_STEPS), f" {unit}" if unit else "", 1.0


class _Clock(_Panel):
    def __init__(self, send: Send) -> None:
        super().__init__("Clock", "The virtual clock can pause, step, or run faster.")
        self._paused = False
        with self.box:
            with ui.element("div").classes("row-of-buttons"):
                self.pause = self.button("Pause", lambda: send(kind="pause", paused=not self._paused))
                self.step = self.button(
                    "One bit", lambda: send(kind="step", samples=1), "Step: let one bit pass"
                )
            ui.label("Times real time")
            self.pace = ui.toggle(PACES, on_change=lambda event: self._asked(send, event.value)).props(
                'unelevated no-caps aria-label="Pace: times real time"'
            )
            self.controls.append(self.pace)

    def _asked(self, send: Send, pace: float | None) -> None:
        if pace is not None and pace != self._sent:
            self._sent = pace
            send(kind="pace", factor=pace)

    _sent: float | None = None

    def refresh(self, allowed: bool, upper: dict[str, Any], lower: dict[str, Any]) -> None:
        self.enable(allowed and upper.get("clock") == "virtual")
        paused = bool(upper.get("paused"))
        if paused is not self._paused:
            self._paused = paused
            self.pause.set_text("Resume" if paused else "Pause")
        pace = upper.get("pace")
        if pace in PACES and pace != self._sent:
            self._sent = pace
            self.pace.set_value(pace)


class _Line(_Panel):
    def __init__(self, send: Send) -> None:
        super().__init__("The line", "Simulated impairments between the two ends.")
        self._send = send
        self._reported, self._sent, self._sent_s = "", "", -REPORT_S
        with self.box:
            self.loss = _Slider("Bits lost", (0, 90, 5), " %", self._changed)
            self.flips = _Slider("Bits flipped", (0, 50, 1), " %", self._changed)
            self.delay = _Slider("Delay each way", (0, 300, 10), " ms", self._changed)
            self.button("Repair the line", self._repair)

    def _changed(self, _value: float = 0.0) -> None:
        parts = []
        if self.loss.value:
            parts.append(f"up:loss={self.loss.value / 100:g}")
        if self.flips.value:
            parts.append(f"up:flip={self.flips.value / 100:g}")
        if self.delay.value:
            parts.append(f"delay={self.delay.value:g}ms")
        self._sent, self._sent_s = ",".join(parts), time.monotonic()
        self._send(kind="impair", text=self._sent)

    def _repair(self) -> None:
        for slider in (self.loss, self.flips, self.delay):
            slider.show(0.0)
        self._changed()

    def refresh(self, allowed: bool, upper: dict[str, Any], lower: dict[str, Any]) -> None:
        """Show the line as the flight reports it: as it started, or as another visitor made it."""
        self.enable(allowed)
        text = upper.get("impairments", "")
        under_way = text != self._sent and time.monotonic() - self._sent_s < REPORT_S
        if under_way or text == self._reported:
            return
        self._reported = text
        up = parse_impairments(text).up
        self.loss.show(round(100.0 * up.loss))
        self.flips.show(round(100.0 * up.flip))
        self.delay.show(round(up.delay_ns / 1e6))


class _Break(_Panel):
    def __init__(self, send: Send) -> None:
        super().__init__("Break it", "Flip one bit in one end's codec: they notice and resynchronise.")
        with self.box, ui.element("div").classes("row-of-buttons"):
            for end in ("transmitter", "receiver"):
                self.button(
                    f"Corrupt the {end}'s codec",
                    lambda end=end: send(kind="corrupt", end=end, field="range"),  # type: ignore[misc]
                ).classes("danger")

    def refresh(self, allowed: bool, upper: dict[str, Any], lower: dict[str, Any]) -> None:
        self.enable(allowed and upper.get("phase") == "flying")
