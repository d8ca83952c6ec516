"""Figs. 5 to 8 of the paper, and the recorded flight beside them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from plant_sim.pitch import PitchParameters, PitchPlant
from receiver.controllers.pid import PAPER_GAINS, Pid
from receiver.controllers.references import Square
from reproduction.paper.curves import Curves, true_rate
from reproduction.paper.flights import Flown
from tenbaud.recording.envelope import Series
from tenbaud.recording.style import (
    FAINT,
    LINE_A,
    LINE_B,
    LINE_C,
    decimated,
    legend_above,
    new_figure,
    save,
)

TICK_S = 0.01
PERIOD_S = 25.0


def ideal_loop(duration_s: float) -> tuple[Series, Series, Series]:
    """Return times, pitch and reference of the loop whose controller sees the true state.

    There is no channel in it, so nothing of ours is between controller and plant.
    """
    reference = Square(math.pi / 2, PERIOD_S, TICK_S)
    controller = Pid(PAPER_GAINS, reference, TICK_S)
    plant = PitchPlant(PitchParameters(), TICK_S)
    count = round(duration_s / TICK_S)
    pitch, wanted = np.empty(count), np.empty(count)
    for tick in range(count):
        pitch[tick] = plant.angle_rad
        wanted[tick] = reference.value(tick)
        plant.advance(controller.command(tick, (plant.angle_rad, plant.rate_rad_s)))
    return np.arange(count, dtype=np.float64) * np.float64(TICK_S), pitch, wanted


def draw_ideal(paths: Sequence[Path]) -> tuple[Series, Series, Series]:
    """Fig. 5: pitch (solid) and reference (dash-dotted) with the ideal controller."""
    times, pitch, wanted = ideal_loop(75.0)
    figure, (panel,) = new_figure(1, height=2.6)
    panel.plot(*decimated(times, pitch), color=LINE_A, label=r"$\theta$")
    panel.plot(*decimated(times, wanted), color=FAINT, linestyle="-.", label=r"$\theta_*$")
    panel.set_ylabel("pitch, rad")
    panel.set_xlabel("time, s")
    legend_above(panel)
    save(figure, paths)
    return times, pitch, wanted


def draw_transmission(off: Flown, exact: Flown, paths: Sequence[Path]) -> None:
    """Figs. 6 and 7: (a1), (a2) pitch, estimate and error, (b1), (b2) range M_k of both plants."""
    figure, panels = new_figure(4, height=1.75)
    curves, model = _curves(off), _curves(exact)
    upper, error, lower, lower_exact = panels
    upper.plot(*decimated(curves.times_s, curves.pitch_rad), color=LINE_A, lw=2.0, label=r"$\theta$")
    upper.plot(
        *decimated(curves.times_s, curves.coded_rad), color=LINE_C, lw=0.9, label=r"$\hat\theta$"
    )
    upper.plot(
        *decimated(curves.times_s, curves.reference_rad),
        color=FAINT,
        ls="-.",
        lw=0.9,
        label=r"$\theta_*$",
    )
    upper.set_ylabel("rad")
    upper.set_title("(a1) pitch and estimate, plant 10 % off the model", loc="left", fontsize=9)
    legend_above(upper)
    for one, colour, label in ((model, FAINT, "exact plant"), (curves, LINE_B, "plant 10 % off")):
        error.plot(
            *decimated(one.times_s, one.pitch_rad - one.coded_rad), color=colour, lw=0.8, label=label
        )
    error.set_ylabel("rad")
    error.set_title(r"(a2) error $e=\theta-\hat\theta$", loc="left", fontsize=9)
    legend_above(error)
    for panel, one, label in (
        (lower, curves, "(b1) range $M_k$, plant 10 % off"),
        (lower_exact, model, "(b2) range $M_k$, exact plant"),
    ):
        panel.plot(
            *decimated(one.range_times_s, one.range_rad), color=LINE_B, lw=0.8, drawstyle="steps-post"
        )
        panel.set_ylim(bottom=0.0)
        panel.set_ylabel("rad")
        panel.set_title(label, loc="left", fontsize=9)
    panels[-1].set_xlabel("time, s")
    save(figure, paths)


def draw_rates(
    observer: Flown, usual: Flown, paths: Sequence[Path], span_s: tuple[float, float] = (12.5, 22.5)
) -> None:
    """Fig. 8: pitch rate by differences at 1000 bit/s (dotted) and by the observer at 10 (solid)."""
    figure, panels = new_figure(2, height=2.4)
    for panel, flown, colour, style, label in (
        (panels[0], usual, LINE_C, ":", r"$\dot\theta_d$: differences, 1000 bit/s"),
        (panels[1], observer, LINE_B, "-", r"$\dot\theta_{est}$: observer, 10 bit/s"),
    ):
        curves = _curves(flown)
        shown = (curves.times_s >= span_s[0]) & (curves.times_s <= span_s[1])
        times = curves.times_s[shown]
        panel.plot(times, curves.coded_rate[shown], color=colour, ls=style, lw=1.0, label=label)
        panel.plot(times, true_rate(curves)[shown], color=LINE_A, lw=1.0, label="true rate")
        panel.set_ylabel("rad/s")
        legend_above(panel)
    low, high = panels[0].get_ylim()
    panels[1].set_ylim(low, high)
    panels[-1].set_xlabel("time, s")
    save(figure, paths)


def draw_recorded(flown: Flown, split_s: float, paths: Sequence[Path]) -> None:
    """Draw the recorded flight and its estimate at 10 bit/s, the split between the halves marked."""
    curves = _curves(flown)
    figure, panels = new_figure(2, height=2.1)
    panels[0].plot(*decimated(curves.times_s, curves.pitch_rad), color=LINE_A, lw=1.6, label="recorded")
    panels[0].plot(
        *decimated(curves.times_s, curves.coded_rad), color=LINE_C, lw=0.8, label="estimate, 10 bit/s"
    )
    legend_above(panels[0])
    panels[1].plot(
        *decimated(curves.times_s, curves.pitch_rad - curves.coded_rad), color=LINE_B, lw=0.8
    )
    for panel, label in zip(panels, ("pitch, rad", "error, rad"), strict=True):
        panel.axvline(split_s, color="#d01c1f", lw=0.9, ls="--")
        panel.set_ylabel(label)
    panels[0].set_title(
        "left of the line the presets were tuned, right of it they are judged",
        loc="left",
        fontsize=9,
    )
    panels[-1].set_xlabel("time, s")
    save(figure, paths)


def rate_error(flown: Flown, filter_s: float = 0.0) -> float:
    """Return the rms error of a flight's rate estimate against its true rate, rad/s.

    `filter_s` is the time constant of a low-pass behind the estimate, as `coder.rate_filter_s` is.
    """
    curves = _curves(flown)
    rate = curves.coded_rate
    if filter_s > 0.0:
        share = TICK_S / (TICK_S + filter_s)
        rate = np.asarray(lfilter([share], [1.0, share - 1.0], np.nan_to_num(rate)))
    used = ~np.isnan(curves.coded_rate)
    return float(np.sqrt(np.mean((rate - true_rate(curves))[used] ** 2)))


def _curves(flown: Flown) -> Curves:
    if flown.curves is None:
        raise ValueError(f"the curves of {flown.name} were not kept")
    return flown.curves
