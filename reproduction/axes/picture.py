"""The picture of docs/THREE-AXES.md and the README: a mission of `helicopter-10baud`."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from reproduction.axes.alone import OUTPUTS
from tenbaud.flight.fly import fly
from tenbaud.recording.figure import COLOURS
from tenbaud.recording.pose import draw_poses
from tenbaud.recording.run import Run
from tenbaud.recording.style import FAINT, LINE_A, LINE_B, decimated, legend_above, new_figure, save

MISSION = "two-boxes"
SHARE_SAMPLES = 20


def draw_mission(path: Path, seconds: float | None = None) -> None:
    """Fly the mission in this process, and draw it."""
    duration = {} if seconds is None else {"duration_s": seconds}
    with tempfile.TemporaryDirectory() as folder:
        settings = {"mission": MISSION, **duration}
        run = fly("helicopter-10baud", settings=settings, out=Path(folder) / "run")
        _draw(run, path)


def _draw(run: Run, path: Path) -> None:
    figure, panels = new_figure(5, 1.25, [1.5, 1.0, 1.0, 1.0, 0.8], width=9.0)
    true, estimated = (
        [(run.time_s, run.signals[f"{kind}{name}"].values) for name in OUTPUTS]
        for kind in ("", "estimate_")
    )
    draw_poses(panels[0], run.plant, true, estimated)
    legend_above(panels[0])
    for panel, name in zip(panels[1:4], OUTPUTS, strict=True):
        for signal, color, width in (
            (f"reference_{name}", FAINT, 1.0),
            (name, LINE_A, 2.0),
            (f"estimate_{name}", LINE_B, 0.8),
        ):
            if signal in run.signals and np.isfinite(run.signals[signal].values).any():
                curve = decimated(run.time_s, np.degrees(run.signals[signal].values))
                panel.plot(*curve, color=color, linewidth=width)
        panel.set_ylabel(f"{name}, °")
    about = run.table("transmitter", "sample")["about"][:, 0]
    shares = np.array([about == place for place in range(len(OUTPUTS))], dtype=float)
    count = len(about) // SHARE_SAMPLES * SHARE_SAMPLES
    means = shares[:, :count].reshape(len(OUTPUTS), -1, SHARE_SAMPLES).mean(axis=2)
    times_s = np.arange(means.shape[1]) * SHARE_SAMPLES * run.config.timing.symbol_period_s
    labels = [f"{name} {share.mean():.0%}" for name, share in zip(OUTPUTS, shares, strict=True)]
    panels[4].stackplot(times_s, means, colors=COLOURS[: len(OUTPUTS)], labels=labels, step="post")
    panels[4].set(ylim=(0.0, 1.0), ylabel="share of bits", xlabel="time, s")
    panels[4].set_xlim(0.0, float(run.time_s[-1]))
    legend_above(panels[4])
    figure.align_ylabels(panels)
    save(figure, [path])
