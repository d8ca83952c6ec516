"""Figs. 3 and 4 of the paper: what excited the body, and how the estimates came about."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tenbaud.identify.run import Identified
from tenbaud.recording.style import LINE_A, LINE_B, decimated, legend_above, new_figure, save


def draw_excitation(runs: Sequence[Identified], paths: Sequence[Path]) -> None:
    """Fig. 3: pitch angle (solid) and filtered input mu_f (dash-dotted), a panel per experiment."""
    figure, panels = new_figure(len(runs), height=2.3)
    for panel, letter, one in zip(panels, "abcdef", runs, strict=False):
        times = one.result.times_s
        panel.plot(*decimated(times, one.record.angle_rad), color=LINE_A, label=r"pitch $\theta$, rad")
        panel.plot(
            *decimated(times, one.result.filtered_input_volts),
            color=LINE_B,
            linestyle="-.",
            label=r"input $\mu_f$, V",
        )
        panel.set_ylabel(r"$\theta$, rad; $\mu_f$, V")
        panel.set_title(f"({letter}) {one.name}", loc="left", fontsize=9)
        legend_above(panel)
    panels[-1].set_xlabel("time, s")
    save(figure, paths)


def draw_estimates(
    runs: Sequence[Identified], paths: Sequence[Path], true: Sequence[float] | None = None
) -> None:
    """Fig. 4: the estimates over time, one line style per experiment; `true` where it is known."""
    figure, panels = new_figure(3, height=1.9)
    labels = (r"$\hat a_\theta$, 1/s$^2$", r"$\hat k_v$, 1/(V s$^2$)", r"$\hat a_\omega$, 1/s")
    for panel, column, label in zip(panels, (1, 2, 0), labels, strict=True):
        if true is not None:
            panel.axhline(true[column], color="#999999", linewidth=0.8, label="true")
        lasting = 0.0
        for one, letter, style in zip(runs, "abcdef", ("-", "-.", "--", ":"), strict=False):
            values = one.result.history[:, column]
            colour = LINE_A if style == "-" else LINE_B
            panel.plot(
                *decimated(one.result.times_s, values), color=colour, linestyle=style, label=letter
            )
            lasting = max(lasting, abs(values[-1]))
        low = min(0.0, *(2.0 * min(0.0, one.result.history[-1, column]) for one in runs))
        panel.set_ylim(low - 0.1 * lasting, 2.0 * lasting + 1e-6)
        panel.set_ylabel(label)
    legend_above(panels[0])
    panels[-1].set_xlabel("time, s")
    save(figure, paths)
