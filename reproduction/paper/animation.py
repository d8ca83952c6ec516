"""The moving picture of the README: a flight at ten baud, broken twice: `tenbaud figures animation`.

Drawn from the recordings of a fresh flight: what is on the tape is what the receiver consumed.
"""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from reproduction.paper.curves import Curves, read_curves
from tenbaud.files.whole import whole_file
from tenbaud.recording.style import LINE_A, LINE_B

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from PIL.Image import Image

    from tenbaud.recording.reader import Recording

DURATION_S = 26.0
CORRUPTED_SAMPLE = 80
CUT = "cut=15s+2s"
SHOWN_S = 7.0
"""of the past, on the tape and above it"""
FRAME_S = 0.2
"""flight time from one picture to the next"""
FRAME_MS = 100
"""how long a picture stands: twice real time"""
CAPTION_S = 1.6
"""flight time for which an event stays on the screen"""
READ_S = 1.0
"""what it takes to read one"""
SHADES = 4
"""of each colour towards white, for smooth edges"""

REFERENCE_COLOUR = "#9a9a9a"
GOOD, BAD = "#2a8c4a", "#d01c1f"


@dataclass(frozen=True, slots=True)
class Story:
    """The flight that is shown."""

    curves: Curves
    words: list[float | None]
    """sign of each sample as the receiver consumed it; None: none came"""
    digests: list[bool]
    """whether the two digests of each sample were equal"""
    events: list[tuple[float, str, bool]]
    """(time in s, text, is it good news)"""


def draw_animation(path: Path) -> int:
    """Fly, draw every picture and write the GIF; return its size in bytes."""
    story = fly_story()
    times = np.arange(1.0, DURATION_S - FRAME_S, FRAME_S)
    pictures = [frame_at(story, float(time_s)) for time_s in times]
    _write(pictures, path)
    return path.stat().st_size


def fly_story() -> Story:
    """Fly with one codec corrupted in one bit, and later with the line cut for two seconds."""
    from tempfile import TemporaryDirectory

    from tenbaud.build.flight import agree
    from tenbaud.config.load import load_config
    from tenbaud.flight.ends import run_in_memory
    from tenbaud.recording.folder import RunFolder
    from tenbaud.recording.reader import Recording

    overrides: dict[str, Any] = {
        "duration_s": DURATION_S,
        "link": {"impairments": CUT},
        "receiver": {"reference": {"period_s": 16.0, "amplitude": 1.0, "kind": "sine"}},
        "transmitter": {
            "plant": {"mismatch": 0.1},
            "sabotage": f"sample={CORRUPTED_SAMPLE},field=range",
        },
    }
    agreement = agree(load_config("tuned-10baud", None, overrides), "virtual")
    with TemporaryDirectory(prefix="tenbaud-story-") as folder:
        run = RunFolder(Path(folder))
        run_in_memory(agreement, run, "none")
        curves = read_curves(run.transmitter, run.receiver)
        return _story(curves, Recording(run.transmitter))


def _story(curves: Curves, recording: Recording) -> Story:
    count = round(DURATION_S * 10.0)
    words: list[float | None] = [None] * count
    digests = [True] * count
    for _, row in recording.rows("sample"):
        if row["sample"] < count:
            words[row["sample"]] = None if row["word"] is None else float(row["word"][0])
            digests[row["sample"]] = row["peer_digest"] in (None, row["digest"])
    events = []
    for time_ns, row in recording.rows("event"):
        if row["kind"] == "desync":
            events.append((time_ns / 1e9, "one bit of one codec is wrong: found", False))
        elif row["kind"] == "rejoin":
            # Mended within two samples, which is too quick to read what was wrong.
            events.append((time_ns / 1e9 + READ_S, f"a common state again: epoch {row['epoch']}", True))
    start_s, length_s = (float(part) for part in CUT[4:].replace("s", "").split("+"))
    at = start_s
    while at < start_s + length_s:
        events.append((at, "line cut: nothing passes", False))
        at += 0.5
    return Story(curves, words, digests, sorted(events))


def frame_at(story: Story, now_s: float) -> Image:
    """Return the picture of one moment."""
    from matplotlib.figure import Figure
    from PIL import Image as Pillow

    figure = Figure(figsize=(8.0, 3.9), facecolor="white")
    body = figure.add_axes((0.0, 0.30, 0.34, 0.62))
    past = figure.add_axes((0.40, 0.36, 0.585, 0.50))
    tape = figure.add_axes((0.40, 0.10, 0.585, 0.15))
    said = [event for event in story.events if event[0] <= now_s < event[0] + CAPTION_S]
    _draw_body(body, story.curves, now_s)
    _draw_past(past, story.curves, now_s)
    _draw_tape(tape, story, now_s)
    sent = sum(1 for word in story.words[: int(now_s * 10)] if word is not None)
    figure.text(0.02, 0.17, f"{sent:3d} bits so far", fontsize=15, family="monospace")
    figure.text(0.02, 0.09, f"in {now_s:4.1f} s", fontsize=11, family="monospace", color="#555555")
    text, good = (said[-1][1], said[-1][2]) if said else ("both ends equal, bit for bit", True)
    figure.text(0.405, 0.925, "●", fontsize=15, color=GOOD if good else BAD, va="center")
    figure.text(0.435, 0.925, text, fontsize=11, color="#222222" if good else BAD, va="center")
    buffer = io.BytesIO()
    figure.savefig(buffer, dpi=90, format="png")
    return Pillow.open(buffer).convert("RGB")


def _draw_body(panel: Axes, curves: Curves, now_s: float) -> None:
    tick = min(int(now_s / (curves.times_s[1] - curves.times_s[0])), len(curves.times_s) - 1)
    for angle, colour, width, style in (
        (curves.reference_rad[tick], REFERENCE_COLOUR, 1.5, (0, (4, 3))),
        (curves.pitch_rad[tick], LINE_A, 6.0, "-"),
        (curves.live_rad[tick], LINE_B, 1.8, "-"),
    ):
        if not math.isnan(angle):
            x, y = math.cos(angle), math.sin(angle)
            panel.plot([-x, x], [-y, y], color=colour, linewidth=width, linestyle=style)
    angle = float(curves.pitch_rad[tick])
    x, y = math.cos(angle), math.sin(angle)
    for side in (-1.0, 1.0):
        middle = np.array([side * x - 0.16 * y, side * y + 0.16 * x])
        blade = 0.34 * np.array([x, y]) * math.cos(9.0 * now_s)
        ends = np.stack([middle - blade, middle + blade])
        panel.plot([side * x, middle[0]], [side * y, middle[1]], color=LINE_A, linewidth=2.5)
        panel.plot(ends[:, 0], ends[:, 1], color="#777777", linewidth=2.0)
    panel.plot([0.0, 0.0], [-1.35, 0.0], color="#bbbbbb", linewidth=5.0, zorder=0)
    panel.plot([0.0], [0.0], "o", color=LINE_A, markersize=9)
    panel.set_xlim(-1.45, 1.45)
    panel.set_ylim(-1.4, 1.4)
    panel.set_aspect("equal")
    panel.axis("off")


def _draw_past(panel: Axes, curves: Curves, now_s: float) -> None:
    shown = (curves.times_s > now_s - SHOWN_S) & (curves.times_s <= now_s)
    for values, colour, width, style, label in (
        (curves.reference_rad, REFERENCE_COLOUR, 1.2, "--", "reference"),
        (curves.pitch_rad, LINE_A, 2.6, "-", "pitch"),
        (curves.live_rad, LINE_B, 1.0, "-", "estimate"),
    ):
        panel.plot(
            curves.times_s[shown][::4],
            values[shown][::4],
            color=colour,
            linewidth=width,
            linestyle=style,
            label=label,
        )
    panel.set_xlim(now_s - SHOWN_S, now_s)
    panel.set_ylim(-2.1, 2.1)
    panel.set_xticks([])
    panel.set_yticks([-1.0, 0.0, 1.0])
    panel.set_ylabel("rad", fontsize=9)
    panel.tick_params(labelsize=8)
    panel.spines[["top", "right", "bottom"]].set_visible(False)
    panel.legend(loc="lower left", fontsize=8, frameon=False, ncols=3, bbox_to_anchor=(0.0, -0.06))


def _draw_tape(panel: Axes, story: Story, now_s: float) -> None:
    for sample in range(max(0, int((now_s - SHOWN_S) * 10)), int(now_s * 10)):
        word = story.words[sample]
        height, colour = (0.9, BAD) if word is None else (0.9 * word, LINE_A)
        if not story.digests[sample]:
            colour = BAD
        low = -0.9 if word is None else 0.0
        panel.bar(
            sample / 10.0 + 0.05,
            1.8 if word is None else height,
            width=0.075,
            bottom=low,
            color="none" if word is None else colour,
            edgecolor=colour,
            linewidth=0.8,
        )
    panel.set_xlim(now_s - SHOWN_S, now_s)
    panel.set_ylim(-1.05, 1.05)
    panel.set_xticks([])
    panel.set_yticks([])
    panel.set_ylabel("bits", fontsize=9)
    panel.spines[["top", "right", "bottom", "left"]].set_color("#bbbbbb")


def _write(pictures: list[Image], path: Path) -> None:
    """Write the pictures with one palette, so that what does not move costs nothing."""
    from PIL import Image as Pillow

    palette = Pillow.new("P", (1, 1))
    palette.putpalette(_shades())
    flat = [picture.quantize(palette=palette, dither=Pillow.Dither.NONE) for picture in pictures]
    with whole_file(path) as stream:
        flat[0].save(
            stream,
            format="GIF",
            save_all=True,
            append_images=flat[1:],
            duration=FRAME_MS,
            loop=0,
            optimize=True,
            disposal=1,
        )


def _shades() -> list[int]:
    """Return the palette: white, and every colour that is drawn in steps towards it."""
    from matplotlib.colors import to_rgb

    found = [255, 255, 255]
    for colour in (LINE_A, LINE_B, REFERENCE_COLOUR, GOOD, BAD):
        for step in range(SHADES):
            white = step / SHADES
            found += [round(255 * (white + (1.0 - white) * part)) for part in to_rgb(colour)]
    return found
