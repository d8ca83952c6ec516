"""The data-rate theorem: an inverted pendulum held over fewer and fewer bits a second, until it falls.

python examples/pendulum.py
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from tenbaud import errors, fly
from tenbaud.bounds.linear import rate_needed
from tenbaud.config.load import load_config, merged_values
from tenbaud.design.complete import completed
from tenbaud.design.described import plant_of
from tenbaud.recording.figure import COLOURS
from tenbaud.recording.style import legend_above, new_figure, save

PRESETS = {20.0: "pendulum-20baud", 15.8: "pendulum-16baud", 12.7: "pendulum-13baud"}
RATES = (*PRESETS, 11.0, 10.0)  # bit/s


def settings_for(rate: float) -> dict[str, object]:
    """Return what the preset of 12.7 bit/s needs for another rate: times, and a coder designed anew."""
    values = merged_values("pendulum-13baud", None)
    ticks = math.ceil(250.0 / rate)  # of 4 ms at most
    tick_s = math.ceil(1e9 / rate / ticks) / 1e9
    values["timing"] = {"tick_s": tick_s, "symbol_period_s": round(tick_s * ticks, 9)}
    values["channel"]["rate_baud"] = rate
    designed = completed(values)
    return {name: designed[name] for name in ("timing", "channel", "coder")}


if __name__ == "__main__":
    config = load_config("pendulum-13baud")
    if (plant := plant_of(config.model, config.timing.tick_s)) is not None:
        print(f"No code of {rate_needed(plant.A):.2f} bit/s or less can hold this pendulum.")
    figure, (panel,) = new_figure(1, 4.0)
    for rate, colour in zip(RATES, COLOURS, strict=False):
        try:
            own = {} if rate in PRESETS else settings_for(rate)
            run = fly(PRESETS.get(rate, "pendulum-13baud"), settings={**own, "duration_s": 12.0})
            outcome = "stays up"
        except errors.FlightFailed as error:
            if (flown := error.run) is None or "the plant fell" not in flown.summary["not_flown"]:
                raise
            run, outcome = flown, "falls"
        except errors.ConfigError as error:
            print(f"{rate:4.1f} bit/s  refused: {error}")
            continue
        angle, rms = np.degrees(run.angle), np.degrees(np.sqrt(np.mean(run.error_live**2)))
        most = f"at most {abs(angle).max():.2f} deg from upright"
        print(f"{rate:4.1f} bit/s  {outcome:8}  estimate error {rms:.2f} deg rms, {most}")
        panel.plot(run.time_s, angle, color=colour, linewidth=0.9, label=f"{rate:g} bit/s: {outcome}")
    panel.set(xlabel="time, s", ylabel="angle, deg", ylim=(-6.0, 6.0))
    legend_above(panel)
    save(figure, [Path("pendulum.png")])
