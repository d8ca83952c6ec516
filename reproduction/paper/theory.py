"""The pictures of the theory pages, from flights and codecs of this moment: `tenbaud figures theory`.

Every flight here runs both sessions in this process, on the virtual clock.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from channel.errors import TenbaudError
from reproduction.paper.copies import CopiesApart, fly_copies
from reproduction.paper.curves import Curves, read_curves
from tenbaud.bounds.closed import DOUBLE_INTEGRATOR
from tenbaud.build.flight import agree
from tenbaud.config.load import load_config
from tenbaud.recording.envelope import Series
from tenbaud.recording.style import FAINT, LINE_A, LINE_B, LINE_C, legend_above, new_figure, save

TORQUE_DENSITY = 2e-3
"""q of the white torque in rad^2/s^3, where a figure has one."""
TORQUE = f"q={TORQUE_DENSITY:g}"

RATES_BAUD = (4, 5, 10, 20, 25, 50)
LEADS_TICKS = (0, 3, 5, 10, 20, 30, 50, 70, 100)

Overrides = dict[str, Any]


class Errors(NamedTuple):
    """Root-mean-square errors of one flight, rad."""

    coded_rad: float
    live_rad: float


def draw_theory(pictures: Path, on_start: Callable[[str], None]) -> list[Path]:
    """Draw every picture of the theory pages as PNG into a folder; return the files."""
    drawn = []
    parts = (
        ("theory-coding", draw_coding),
        ("theory-observer", draw_observer),
        ("theory-lockstep", draw_lockstep),
        ("theory-limits", draw_limits),
    )
    for name, draw in parts:
        on_start(name)
        path = pictures / f"{name}.png"
        draw(path)
        drawn.append(path)
    return drawn


def draw_coding(path: Path) -> None:
    """The range and the signs, with a window of two signs and of three, exact plant."""
    two, signs_of_two = recorded("paper-10baud", {})
    three, signs_of_three = recorded("paper-10baud", {"coder": {"window_signs": 3}})
    figure, panels = new_figure(4, height=1.3, ratios=(1.6, 1.6, 0.7, 0.7))
    for curves, colour, label in ((two, LINE_C, "window of two signs"), (three, LINE_B, "of three")):
        error = curves.pitch_rad - curves.coded_rad
        panels[0].plot(curves.times_s, error, color=colour, linewidth=0.9, label=label)
        panels[1].step(
            curves.range_times_s, curves.range_rad, where="post", color=colour, linewidth=0.9
        )
    for panel, signs, colour, text in (
        (panels[2], signs_of_two, LINE_C, "signs,\nof two"),
        (panels[3], signs_of_three, LINE_B, "signs,\nof three"),
    ):
        panel.bar(two.range_times_s + 0.05, signs, width=0.085, color=colour, linewidth=0)
        panel.set_yticks([])
        panel.set_ylabel(text, fontsize=8)
    panels[0].set_ylabel("error, rad")
    panels[0].set_ylim(-0.25, 0.25)
    panels[1].set_ylabel("range $M_k$, rad")
    panels[1].set_yscale("log")
    panels[1].set_yticks((0.05, 0.1, 0.2, 0.4), ("0.05", "0.1", "0.2", "0.4"))
    panels[1].minorticks_off()
    panels[-1].set_xlim(30.0, 38.0)
    panels[-1].set_xlabel("time, s")
    legend_above(panels[0])
    save(figure, [path])


def draw_observer(path: Path) -> None:
    """The effect of a correction within a sample, and the cost of prediction over the lead."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    for preset, overrides, colour, label in (
        ("paper-10baud", {"coder": {"window_signs": 3}}, LINE_C, "held over the sample"),
        ("tuned-10baud", {}, LINE_B, "as an impulse"),
    ):
        curves, _ = recorded(preset, with_torque(overrides))
        error = curves.pitch_rad - curves.coded_rad
        left.plot(curves.times_s, 1e3 * error, color=colour, linewidth=0.9, label=label)
    left.set_xlim(40.0, 42.5)
    left.set_ylim(-32, 32)
    left.set_xlabel("time, s")
    left.set_ylabel("error, mrad")
    errors = [
        errors_of("tuned-10baud", with_torque({"timing": {"lead_ticks": lead}})) for lead in LEADS_TICKS
    ]
    leads_s = [lead * 0.01 for lead in LEADS_TICKS]
    right.plot(leads_s, [1e3 * one.coded_rad for one in errors], "o-", color=LINE_A, label="coded")
    right.plot(leads_s, [1e3 * one.live_rad for one in errors], "s-", color=LINE_B, label="live")
    blind = [
        1e3 * math.sqrt(errors[0].coded_rad ** 2 + TORQUE_DENSITY * lead_s**3 / 3) for lead_s in leads_s
    ]
    right.plot(leads_s, blind, "--", color=FAINT, label="if only the torque were new")
    right.set_xlabel("command lead, s")
    right.set_ylabel("rms error, mrad")
    right.set_ylim(bottom=0.0)
    for panel in (left, right):
        panel.grid(visible=True, color="#e6e6e6", linewidth=0.6)
        panel.spines[["top", "right"]].set_visible(False)
    left.legend(loc="upper right", fontsize=8, frameon=False, ncols=2)
    right.legend(loc="upper left", fontsize=8, frameon=False)
    save(figure, [path])


def draw_lockstep(path: Path) -> None:
    """Two copies over a line that flips bits, with the echo and without."""
    apart, together = fly_copies(echo=False), fly_copies(echo=True)
    figure, panels = new_figure(2, height=1.9)
    for one, colour, label in (
        (apart, LINE_C, "each consumes its own: sent here, received there"),
        (together, LINE_B, "both consume the echo"),
    ):
        panels[0].plot(one.times_s, one.error_rad, color=colour, linewidth=0.9, label=label)
        panels[1].plot(one.times_s, one.apart_rad, color=colour, linewidth=1.2)
    _mark_flips(panels[0], together)
    panels[0].set_ylabel("error at the\nreceiver, rad")
    panels[1].set_ylabel("distance of the\ntwo copies, rad")
    panels[1].set_yscale("symlog", linthresh=1e-3)
    panels[1].set_ylim(bottom=-1e-4)
    panels[1].set_xlabel("time, s")
    panels[1].set_xlim(0.0, together.times_s[-1])
    legend_above(panels[0])
    save(figure, [path])


def draw_limits(path: Path) -> None:
    """Error over rate: the floor, the paper's constants, and constants that follow the rate."""
    paper = [errors_of(*paper_at(rate)).coded_rad for rate in RATES_BAUD]
    scaled = [errors_of(*scaled_at(rate)).coded_rad for rate in RATES_BAUD]
    figure, (panel,) = new_figure(1, height=3.6)
    rates = np.geomspace(RATES_BAUD[0], RATES_BAUD[-1], 50)
    floor = np.sqrt(DOUBLE_INTEGRATOR * TORQUE_DENSITY / rates**3)
    panel.fill_between(rates, 1e3 * floor, 1e-2, color=FAINT, alpha=0.25, linewidth=0)
    panel.loglog(
        rates, 1e3 * floor, color=FAINT, label=r"double integrator, any code: $\sqrt{0.890\,q/R^3}$"
    )
    panel.loglog(
        RATES_BAUD, [1e3 * one for one in paper], "o-", color=LINE_C, label="paper, window of three"
    )
    panel.loglog(
        RATES_BAUD, [1e3 * one for one in scaled], "s-", color=LINE_B, label="tuned, scaled with $R$"
    )
    panel.set_xticks(RATES_BAUD, [str(rate) for rate in RATES_BAUD])
    panel.minorticks_off()
    panel.set_ylim(0.1, 60)
    panel.set_xlabel("rate $R$, bit/s")
    panel.set_ylabel("rms error, mrad")
    panel.legend(loc="lower left", fontsize=8, frameon=False)
    save(figure, [path])


def paper_at(rate_baud: float) -> tuple[str, Overrides]:
    """Return the paper's coder with a window of three at another rate, under the torque."""
    overrides: Overrides = {
        "timing": {"symbol_period_s": 1.0 / rate_baud},
        "channel": {"rate_baud": float(rate_baud)},
        "coder": {"window_signs": 3},
    }
    return "paper-10baud", with_torque(overrides)


def scaled_at(rate_baud: float) -> tuple[str, Overrides]:
    """Return the tuned coder with its constants carried from 10 bit/s to another rate.

    Torque alone makes an error that goes with R^-3/2, and a rate of change that goes with R.
    """
    coder = load_config("tuned-10baud").coder
    factor = rate_baud / 10.0
    shrink = 1.0 / (factor * math.sqrt(factor))
    gains = getattr(coder, "gains", (0.0, 0.0))
    overrides: Overrides = {
        "timing": {"symbol_period_s": 1.0 / rate_baud},
        "channel": {"rate_baud": float(rate_baud)},
        "coder": {
            "initial_range_rad": getattr(coder, "initial_range_rad", 0.0) * shrink,
            "minimum_range_rad": getattr(coder, "minimum_range_rad", 0.0) * shrink,
            "gains": (gains[0], gains[1] * factor),
        },
    }
    return "tuned-10baud", with_torque(overrides)


def with_torque(overrides: Overrides) -> Overrides:
    """Return settings with white torque on the plant and a long flight."""
    transmitter = {"plant": {"disturbance": TORQUE}, "encoders": {"counts_per_turn": 1_000_000}}
    return {"duration_s": 200.0, "transmitter": transmitter, **overrides}


def errors_of(preset: str, overrides: Overrides) -> Errors:
    """Fly once and return the errors after the first period of the reference."""
    from channel.protocol.wire import DATAGRAM
    from tenbaud.build.ends import build_receiver
    from tenbaud.flight import transmit

    agreement = agree(load_config(preset, None, overrides), "virtual")
    run = transmit.prepare(agreement, None, DATAGRAM)
    outcome = transmit.fly_virtual(run, build_receiver(agreement, None, DATAGRAM), lambda: False)
    if outcome.code:
        raise TenbaudError(f"{preset} {overrides}: {outcome.text}")
    scores = run.node.scores
    return Errors(scores.first.coded.rms or 0.0, scores.first.live.rms or 0.0)


def recorded(preset: str, overrides: Overrides) -> tuple[Curves, Series]:
    """Fly once with recordings and return its curves, and the sign of each sample (0: erased)."""
    from tenbaud.flight.ends import run_in_memory
    from tenbaud.recording.folder import RunFolder
    from tenbaud.recording.reader import Recording

    agreement = agree(load_config(preset, None, {"duration_s": 60.0, **overrides}), "virtual")
    with TemporaryDirectory(prefix="tenbaud-theory-") as folder:
        run = RunFolder(Path(folder))
        outcome, _, _ = run_in_memory(agreement, run, "none")
        if outcome.code:
            raise TenbaudError(f"{preset} {overrides}: {outcome.text}")
        words = [row["word"] for _, row in Recording(run.transmitter).rows("sample")]
        signs = np.array([0.0 if word is None else float(word[0]) for word in words])
        return read_curves(run.transmitter, run.receiver), signs


def _mark_flips(panel: Any, copies: CopiesApart) -> None:
    across = panel.get_xaxis_transform()
    times = copies.flipped_s
    panel.plot(times, [0.03] * len(times), "|", color=LINE_A, transform=across, label="flipped bit")
