"""A plant that is not the model: the coder that learns it beside the one that does not.

    python -m reproduction.axes.mismatch [--seeds 16] [--coder direction] [NAME ...]

Flights of ten minutes in closed loop, compiled, the strength of the disturbance unknown, outputs read
exactly. The model is off by 10 % in every parameter that is no kinematics, each up or down by the
seed; with a force, a constant 0.03 rad/s^2 on every axis too. Given is the joint rms error of all
outputs over the least that any coder can reach (the floor of the model), from the first 20 s on. A
flight in which that is more than 20 has lost its plant, and is counted apart.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from tenbaud.bounds.floor import floor
from tenbaud.config.load import load_config
from tenbaud.config.schema import FlightConfig
from tenbaud.design.complete import completed
from tenbaud.design.described import corrected_part, linear_of, plant_of, plant_section
from tenbaud.studies.flights import CompiledPoint

OFF, FORCE = 0.1, 0.03
SCORED_FROM = 2000
LOST = 20.0
UNEQUAL, EQUAL = (2e-6, 2e-6, 2e-3), (2e-3, 2e-3, 2e-3)
REFERENCE = {"kind": "square", "amplitude": 0.1, "period_s": 20.0}


class Case(NamedTuple):
    """Flights of one kind."""

    plant: str
    densities: tuple[float, ...]
    rate: float


CASES = {
    "unequal": [Case("helicopter", UNEQUAL, rate) for rate in (10.0, 20.0, 30.0)],
    "equal": [Case("helicopter", EQUAL, rate) for rate in (10.0, 20.0, 30.0)],
    "nonlinear": [Case("nonlinear", UNEQUAL, 10.0), Case("nonlinear", UNEQUAL, 20.0)],
    "nonlinear-equal": [Case("nonlinear", EQUAL, 10.0)],
    "pitch": [Case("pitch", (2e-3,), 10.0), Case("pitch", (2e-3,), 20.0)],
    "integrator": [Case("integrator", (2e-3,), 10.0)],
}
CONDITIONS = {"exact": (0.0, 0.0), "10 % off": (OFF, 0.0), "and a force": (OFF, FORCE)}


def designed(case: Case, coder: str) -> dict[str, Any]:
    """Return timing, model and coder."""
    learns = {"learns": True} if coder == "learning" else {}
    if case.plant == "nonlinear":
        preset = load_config(f"helicopter-{case.rate:.0f}baud")
        given = preset.model_dump(mode="json", exclude_unset=True)
        model = {"kind": "helicopter", "densities": case.densities, **learns}
        return completed({**given, "model": model, "coder": {"kind": coder}})
    section = plant_section(case.plant).model_dump(mode="json", exclude_defaults=True)
    model = {**section, "kind": "linear", "densities": case.densities, **learns}
    timing = {"tick_s": 0.01, "symbol_period_s": 1.0 / case.rate}
    if case.rate == 30.0:
        timing = {"tick_s": 0.011111112, "symbol_period_s": 0.033333336}
    return completed(
        {
            "timing": timing,
            "channel": {"rate_baud": case.rate},
            "model": model,
            "coder": {"kind": coder},
        }
    )


def flown(case: Case, done: dict[str, Any], seed: int, off: float, force: float) -> FlightConfig:
    """Return the flight of a seed."""
    disturbance = "q=" + ":".join(f"{one:g}" for one in case.densities)
    if force:
        disturbance += ",step=" + ":".join([f"{force:g}"] * len(case.densities)) + "@0"
    plant: dict[str, Any] = {"kind": "linear", "disturbance": disturbance}
    more: dict[str, Any] = {}
    if case.plant == "nonlinear":
        signs = list(itertools.product((1.0, -1.0), repeat=3))[seed % 8]
        plant |= {"kind": "helicopter", "mismatch": [off * sign for sign in signs]}
        given = done["receiver"]["reference"]
        more["receiver"] = {**done["receiver"], "reference": {**given, **REFERENCE}}
    else:
        model = done["model"]
        A, B = (np.array(model[name], dtype=float) for name in "AB")
        chooser = np.random.default_rng(seed)
        A2 = np.where(A == 1.0, A, A * (1.0 + off * chooser.choice([-1, 1], A.shape)))
        B2 = B * (1.0 + off * chooser.choice([-1, 1], B.shape))
        G = model.get("G", model["B"])
        plant["options"] = {"A": A2.tolist(), "B": B2.tolist(), "C": model["C"], "G": G}
        weights = dict.fromkeys(model.get("inputs") or ["input_1"], 1e-2)
        more["limits"] = {"command_max": 30.0}
        more["receiver"] = {
            "controller": "state_feedback",
            "state_feedback": {"input_weights": weights},
            "reference": REFERENCE,
        }
        if case.plant == "helicopter":
            more["receiver"]["reference"] = {**REFERENCE, "elevation": REFERENCE}
    transmitter = {"plant": plant, "encoders": {"quantised": False}}
    values = {**done, **more, "transmitter": transmitter, "duration_s": 600.0, "seed": seed}
    return FlightConfig.model_validate(values)


def ratios(case: Case, coder: str, seeds: int, off: float, force: float) -> list[float]:
    """Return, for each seed, the joint rms error over the floor."""
    done = designed(case, coder)
    found = []
    for seed in range(seeds):
        config = flown(case, done, seed, off, force)
        plant, linear = plant_of(config.model, config.timing.tick_s), linear_of(config.model)
        assert plant is not None
        assert linear is not None
        least = floor(corrected_part(plant, linear.corrected).model(), case.rate)
        figures, _ = CompiledPoint(config, scored_from=SCORED_FROM).fly(seed)
        squares = sum(one.error_coded_rms**2 for one in figures.outputs)
        found.append(math.sqrt(squares / least))
    return found


def table(names: list[str], coder: str, seeds: int) -> Iterator[str]:
    """Yield the rows of a table in Markdown, each as soon as it is flown."""
    yield f"| plant | q | bit/s | coder | {' | '.join(CONDITIONS)} |"
    yield "|---|---|---|---|" + "---|" * len(CONDITIONS)
    for case in itertools.chain.from_iterable(CASES[name] for name in names):
        cells = []
        for off, force in CONDITIONS.values():
            every = ratios(case, coder, seeds, off, force)
            kept = [one for one in every if one < LOST]
            text = "none"
            if len(kept) > 1:
                half = 1.96 * float(np.std(kept, ddof=1)) / math.sqrt(len(kept))
                text = f"{np.mean(kept):.2f} ± {half:.2f}"
            lost = len(every) - len(kept)
            cells.append(text + (f", {lost} of {seeds} lost" if lost else ""))
        q = ", ".join(f"{one:g}" for one in case.densities)
        yield f"| {case.plant} | {q} | {case.rate:g} | `{coder}` | {' | '.join(cells)} |"


def main(arguments: list[str]) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="reproduction.axes.mismatch")
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(CASES))
    parser.add_argument("--seeds", type=int, default=16)
    parser.add_argument("--coder", choices=("learning", "direction"), default="learning")
    given = parser.parse_args(arguments)
    for row in table(given.names or list(CASES), given.coder, given.seeds):
        print(row, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
