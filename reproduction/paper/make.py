"""`tenbaud figures`: fly what is asked for, draw it, and write the page when all of it is there."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from reproduction.paper import draw, plan, real
from reproduction.paper.flights import Flown, Job, Task, fly_all
from reproduction.paper.identified import (
    EXCITATIONS,
    SEEDS,
    Trials,
    clean_trial,
    largest_error,
    noisy_trial,
)
from tenbaud.build.rig import nominal_plant
from tenbaud.config.load import load_config
from tenbaud.files.whole import make_folder
from tenbaud.identification.figures import draw_estimates, draw_excitation

NUMBERS = ("3", "4", "5", "6", "7", "8")
OnProgress = Callable[[float, float, str], None]
"""(done, total, what): units of work."""


@dataclass(slots=True)
class Results:
    """Everything that the page tells about."""

    flown: dict[str, Flown] = field(default_factory=dict)
    trials: Trials | None = None
    first_half: real.FirstHalf | None = None
    ideal_largest_rad: float = 0.0
    """largest pitch with the ideal controller"""
    ideal_left_rad: float = 0.0
    """its mean distance from the reference in the last second before each jump"""
    seconds: float = 0.0


def make_figures(
    wanted: set[str], folder: Path, pictures: Path, data: Path | None, on_progress: OnProgress
) -> Results:
    """Draw the wanted figures: PNG into `pictures`, SVG and the flights' recordings into `folder`.

    With all six wanted everything for the page is flown, the recorded flights too if `data` is there.
    """
    started = time.perf_counter()
    whole = wanted == set(NUMBERS)
    results = Results()
    if whole and data is not None:
        results.first_half = real.identify_first_half(data)
    jobs = _jobs(wanted, whole, folder, data, results.first_half)
    tasks = _trials(wanted, whole)
    total = sum(job.weight for job in jobs) + sum(task.weight for task in tasks) + 5.0
    done = 0.0

    def on_done(name: str, weight: float) -> None:
        nonlocal done
        done += weight
        on_progress(done, total, name)

    on_progress(0.0, total, "flying")
    results.flown, others = fly_all(jobs, folder / "flights", tasks, on_done)
    if tasks:
        clean = [others[f"clean-{text}"] for text in EXCITATIONS]
        errors = [largest_error(one.found.regression) for one in clean]
        noisy = [pair for name, pair in others.items() if name.startswith("noisy-")]
        results.trials = Trials(clean, errors, noisy)
    on_progress(done, total, "drawing")
    _draw(wanted, results, folder, pictures)
    on_progress(total, total, "done")
    results.seconds = time.perf_counter() - started
    return results


def _trials(wanted: set[str], whole: bool) -> list[Task]:
    if not wanted & {"3", "4"}:
        return []
    tasks = [Task(f"clean-{text}", clean_trial, (text,)) for text in EXCITATIONS]
    if whole:
        tasks += [
            Task(f"noisy-{text}-{seed}", noisy_trial, (text, seed))
            for text in EXCITATIONS
            for seed in SEEDS
        ]
    return tasks


def _jobs(
    wanted: set[str],
    whole: bool,
    folder: Path,
    data: Path | None,
    first_half: real.FirstHalf | None,
) -> list[Job]:
    make_folder(folder / "flights")
    if whole:
        jobs = plan.pitch_jobs() + plan.unit_jobs() + plan.rate_jobs() + plan.zooming_jobs()
        if data is not None and first_half is not None:
            jobs += real.uiuc_jobs(data, first_half.model) + real.ntnu_jobs(data, folder)
        return jobs
    names: set[str] = set()
    for number, rate in (("6", 20), ("7", 10)):
        if number in wanted:
            names |= {plan.flight_name("paper", rate, percent) for percent in (0, 10)}
    jobs = [job for job in plan.pitch_jobs() if job.name in names]
    if "8" in wanted:
        jobs += [job for job in plan.rate_jobs() if job.name in ("rate-observer", "rate-usual")]
    return jobs


def _draw(wanted: set[str], results: Results, folder: Path, pictures: Path) -> None:
    def paths(name: str) -> list[Path]:
        return [pictures / f"{name}.png", folder / f"{name}.svg"]

    flown = results.flown
    if results.trials is not None:
        if "3" in wanted:
            draw_excitation(results.trials.clean, paths("paper-figure-3"))
        if "4" in wanted:
            true = nominal_plant(load_config("paper-10baud"))
            draw_estimates(
                results.trials.clean,
                paths("paper-figure-4"),
                (true.rate_damping_per_s, true.stiffness_per_s2, true.torque_gain_rad_per_v_s2),
            )
    if "5" in wanted:
        times, pitch, wanted_rad = draw.draw_ideal(paths("paper-figure-5"))
        results.ideal_largest_rad = float(abs(pitch).max())
        late = (times % (draw.PERIOD_S / 2)) >= draw.PERIOD_S / 2 - 1.0
        results.ideal_left_rad = float(abs(pitch - wanted_rad)[late].mean())
    for number, rate in (("6", 20), ("7", 10)):
        if number in wanted:
            draw.draw_transmission(
                flown[plan.flight_name("paper", rate, 10)],
                flown[plan.flight_name("paper", rate, 0)],
                paths(f"paper-figure-{number}"),
            )
    if "8" in wanted:
        draw.draw_rates(flown["rate-observer"], flown["rate-usual"], paths("paper-figure-8"))
    if "uiuc-tuned-10" in flown:
        draw.draw_recorded(flown["uiuc-tuned-10"], real.HALF_S, paths("recorded-flight"))
