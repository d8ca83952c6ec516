"""A terminal view of a running flight: small enough for SSH.

Colours are rich's to decide, and it keeps to NO_COLOR; what is red or green also says so in words. A
terminal without Unicode gets the same in plain characters.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from tenbaud.flight.status import Status
from tenbaud.sentences import endings

GAUGE_DEGREES = 180
GAUGE_CELLS = 41
TAPE_CELLS = 48
SPARK_CELLS = 48
SPARKS = "▁▂▃▄▅▆▇█"
ASCII_SPARKS = " .:-=+*#"


class Screen:
    """Remembers the newest status of each end and a short past, and draws both."""

    def __init__(self, unicode: bool = True) -> None:
        self._newest: dict[str, Status] = {}
        self._errors: deque[float] = deque(maxlen=SPARK_CELLS)
        self._unicode = unicode

    def update(self, status: Status) -> None:
        """Take a status in."""
        self._newest[status["role"]] = status
        if status.get("error_rad") is not None:
            self._errors.append(abs(status["error_rad"]))

    def __rich__(self) -> RenderableType:
        """Return what is to be shown now."""
        if not self._newest:
            return Text("starting", style="dim")
        return Group(*(self._end(status) for status in self._newest.values()))

    def _end(self, status: Status) -> RenderableType:
        table = Table.grid(padding=(0, 1))
        table.add_column(justify="right", style="dim", min_width=9)
        table.add_column()
        style = "bold" if status["phase"] == "flying" else "yellow"
        head = Text(endings.phase_text(status["phase"]), style=style)
        head.append(_time_text(status))
        table.add_row(status["role"], head)
        if status.get("pitch_rad") is not None:
            angle = math.degrees(status["pitch_rad"])
            table.add_row("pitch", f"{angle:+7.1f} deg  {self._gauge(angle)}")
        if status.get("error_rad") is not None:
            error, width = math.degrees(status["error_rad"]), math.degrees(status["range_rad"])
            table.add_row("error", f"{error:+7.2f} deg  of M {width:.2f}  {self._sparks()}")
        if status.get("words"):
            table.add_row("bits", self._tape(status["words"]))
        if status.get("digest_checks") is not None:
            table.add_row("lockstep", _lockstep(status))
        if counts := _counts(status):
            table.add_row("line", counts)
        return table

    def _gauge(self, angle: float) -> str:
        share = min(1.0, max(-1.0, angle / GAUGE_DEGREES))
        place = round((share + 1.0) / 2.0 * (GAUGE_CELLS - 1))
        rail, middle, mark = "─┼●" if self._unicode else "-+o"
        cells = [rail] * GAUGE_CELLS
        cells[GAUGE_CELLS // 2] = middle
        cells[place] = mark
        return "".join(cells)

    def _sparks(self) -> str:
        marks = SPARKS if self._unicode else ASCII_SPARKS
        largest = max(self._errors) or 1.0
        last = len(marks) - 1
        return "".join(marks[round(error / largest * last)] for error in self._errors)

    def _tape(self, words: Sequence[Sequence[int] | None]) -> Text:
        high, low, none = "▀▄×" if self._unicode else "'.x"  # noqa: RUF001
        text = Text()
        for word in words[-TAPE_CELLS:]:
            if word is None:
                text.append(none, style="red")
            else:
                text.append(
                    high if sum(word) >= 0 else low, style="blue" if sum(word) >= 0 else "magenta"
                )
        return text


def unicode_fits(console: Console) -> bool:
    """Return whether the console takes more than ASCII."""
    return console.encoding.lower().startswith("utf")


def _time_text(status: Status) -> str:
    text = f"  {status['time_s']:.1f} s" if status.get("time_s") is not None else ""
    if status.get("of_ticks") and status.get("tick"):
        text += f"  {100.0 * status['tick'] / status['of_ticks']:.0f} %"
    return text


def _lockstep(status: Status) -> Text:
    desyncs = status["desyncs"]
    text = Text("equal" if status["phase"] == "flying" else "open", style="green")
    if status["phase"] != "flying":
        text.stylize("yellow")
    text.append(f"  {status['digest_checks']} digests", style="default")
    text.append(f", {desyncs} differed", style="red" if desyncs else "default")
    if status.get("rejoins"):
        text.append(f", {status['rejoins']} rejoins", style="yellow")
    return text


def _counts(status: Status) -> str:
    words = []
    for name, form in (
        ("baud", "{:.2f} baud"),
        ("erasures", "{} erased"),
        ("guard", "guard {}"),
    ):
        if status.get(name) is not None:
            words.append(form.format(status[name]))
    return "  ".join(words)
