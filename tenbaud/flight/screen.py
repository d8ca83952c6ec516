"""A terminal view of a running flight: small enough for SSH.

Colours are rich's to decide, and it keeps to NO_COLOR; what is red or green also says so in words. A
terminal without Unicode gets the same in plain characters.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.table import Table
from rich.text import Text

from tenbaud.flight.status import Status
from tenbaud.sentences import endings
from tenbaud.sentences.quantities import in_degrees

GAUGE_DEGREES = 180
GAUGE_CELLS = 41
TAPE_CELLS = 48
SPARK_CELLS = 48
CELLS_MIN = 5
LABEL_CELLS = 13
"""What stands before a value, or most labels."""
VALUE_CELLS = 15
RANGE_CELLS = 12
TAPE_STYLES = ("blue", "green", "magenta", "yellow", "cyan", "white")
"""Of bits about the first output, the second, ...: red is what is erased."""
SPARKS = "▁▂▃▄▅▆▇█"
ASCII_SPARKS = " .:-=+*#"


class Screen:
    """Remembers the newest status of each end and a short past, and draws both."""

    def __init__(self, unicode: bool = True) -> None:
        self._newest: dict[str, Status] = {}
        self._errors: dict[str, deque[float]] = {}
        self._largest: dict[str, float] = {}
        self._unicode = unicode
        self._room = TAPE_CELLS

    def update(self, status: Status) -> None:
        self._newest[status["role"]] = status
        for one in status.get("outputs", ()):
            if one["error"] is not None:
                errors = self._errors.setdefault(one["name"], deque(maxlen=SPARK_CELLS))
                errors.append(abs(one["error"]))

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        self._room = options.max_width - LABEL_CELLS
        if not self._newest:
            yield Text("starting", style="dim")
        yield Group(*(self._end(status) for status in self._newest.values()))

    def _cells(self, most: int, beside: int = 0) -> int:
        """Return how many cells of a picture have room beside a text."""
        return max(CELLS_MIN, min(most, self._room - beside))

    def _end(self, status: Status) -> RenderableType:
        table = Table.grid(padding=(0, 1))
        table.add_column(justify="right", style="dim", min_width=9)
        table.add_column(no_wrap=True, overflow="crop")
        style = "bold" if status["phase"] == "flying" else "yellow"
        head = Text(endings.phase_text(status["phase"]), style=style)
        head.append(_time_text(status))
        table.add_row(status["role"], head)
        for one in status.get("outputs", ()):
            self._output(table, one)
        if status.get("words"):
            outputs = [one["name"] for one in status.get("outputs", ())]
            table.add_row("bits", self._tape(status["words"], status.get("about", ()), outputs))
        if status.get("digest_checks") is not None:
            table.add_row("lockstep", _lockstep(status))
        if counts := _counts(status):
            table.add_row("line", counts)
        for place, line in enumerate(_down(status["narrow"]) if status.get("narrow") else ()):
            table.add_row("" if place else "down", line)
        return table

    def _output(self, table: Table, one: Status) -> None:
        name = one["name"]
        if one["value"] is not None:
            value, unit = in_degrees(one["value"], one["unit"])
            largest = max(abs(value), self._largest.get(name, 0.0))
            self._largest[name] = GAUGE_DEGREES if unit == "deg" else largest
            gauge = self._gauge(value / (self._largest[name] or 1.0))
            shown = f"{value:+7.1f}" if unit == "deg" else f"{value:+9.4g}"
            table.add_row(Text(name), Text(f"{shown} {unit}  {gauge}"))
        if one["error"] is not None:
            error, unit = in_degrees(one["error"], one["unit"])
            width, _ = in_degrees(one["range"] or 0.0, one["unit"])
            shown = f"{error:+7.2f}" if unit == "deg" else f"{error:+9.3g}"
            sparks = self._sparks(self._errors[name])
            table.add_row("error", Text(f"{shown} {unit}  of M {width:.3g}  {sparks}"))

    def _gauge(self, share: float) -> str:
        share = min(1.0, max(-1.0, share))
        count = (self._cells(GAUGE_CELLS, VALUE_CELLS) - 1) // 2 * 2 + 1
        place = round((share + 1.0) / 2.0 * (count - 1))
        rail, middle, mark = "─┼●" if self._unicode else "-+o"
        cells = [rail] * count
        cells[count // 2] = middle
        cells[place] = mark
        return "".join(cells)

    def _sparks(self, errors: Sequence[float]) -> str:
        marks = SPARKS if self._unicode else ASCII_SPARKS
        largest = max(errors) or 1.0
        last = len(marks) - 1
        shown = list(errors)[-self._cells(SPARK_CELLS, VALUE_CELLS + RANGE_CELLS) :]
        return "".join(marks[round(error / largest * last)] for error in shown)

    def _tape(
        self,
        words: Sequence[Sequence[int] | None],
        about: Sequence[Sequence[int] | None],
        outputs: Sequence[str],
    ) -> Text:
        """Return the last words, of several outputs each in the colour of that it was about."""
        high, low, none = "▀▄×" if self._unicode else "'.x"  # noqa: RUF001
        is_coloured = len(outputs) > 1 and len(about) == len(words)
        text = Text()
        for at in range(max(0, len(words) - self._cells(TAPE_CELLS)), len(words)):
            word = words[at]
            if word is None:
                text.append(none, style="red")
                continue
            is_high = sum(word) >= 0
            style = "blue" if is_high else "magenta"
            if is_coloured and (places := about[at]):
                style = TAPE_STYLES[max(places, key=list(places).count) % len(TAPE_STYLES)]
            text.append(high if is_high else low, style=style)
        if is_coloured:
            for place, name in enumerate(outputs):
                text.append(f"  {name}", style=TAPE_STYLES[place % len(TAPE_STYLES)])
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
    if narrow := status.get("narrow"):
        text = Text(f"certain before sample {narrow['confirmed_to']}", style=text.style)
        behind = f", {narrow['unconfirmed']} behind; {narrow['hypotheses']} hypotheses"
        text.append(f"{behind}, rest {narrow['rest']:.0e}", style="default")
    else:
        text.append(f"  {status['digest_checks']} digests", style="default")
        text.append(f", {desyncs} differed", style="red" if desyncs else "default")
    if status.get("rejoins"):
        text.append(f", {status['rejoins']} rejoins", style="yellow")
    return text


def _down(narrow: Status) -> Iterator[str]:
    """Yield what is to be known of a narrow downlink, line by line."""
    if bits := narrow["hash_bits_per_sample"]:
        yield f"a difference stays unseen for n samples with probability 2^(-{bits:.2g} n)"
    rate = "" if narrow["baud"] is None else f"{narrow['baud']:.2f} symbols/s"
    law = "the law runs beside the plant too" if narrow["scheme"] == "mirrored" else ""
    yield "; ".join(filter(None, (rate, law)))


def _counts(status: Status) -> str:
    words = []
    for name, form in (("baud", "{:.2f} baud"), ("erasures", "{} erased"), ("guard", "guard {}")):
        if status.get(name) is not None:
            words.append(form.format(status[name]))
    return "  ".join(words)
