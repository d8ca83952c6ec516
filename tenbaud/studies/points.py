"""The points of a study: which settings are swept, and the values that they take together."""

from __future__ import annotations

import itertools
import math

from tenbaud.config.load import flattened
from tenbaud.studies.settings import FIELDS, TEXTS, StudyError, check_name, check_value
from tenbaud.studies.study_file import Range, SampleSection, StudyFile, Value

FLIGHTS_MAX = 10_000_000

SAME = (("rate", "timing.symbol_period_s"), *FIELDS.items())
"""Short names and the fields that they replace."""


def names_of(file: StudyFile) -> list[str]:
    """Return the settings that are swept; StudyError where they contradict each other or the file."""
    names = [*file.grid, *(file.sample.settings if file.sample else ())]
    if not names:
        raise StudyError("nothing is swept: give a [grid], or a [sample] with settings")
    if file.sample is not None and not file.sample.settings:
        raise StudyError("sample.settings is empty: name what is to be sampled, within which range")
    for name in names:
        check_name(name)
        if name in ("seed", "preset", "link.kind"):
            raise StudyError(f"{name} cannot be swept" + ("; use seeds" if name == "seed" else ""))
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise StudyError(f"{', '.join(sorted(twice))}: on the grid and sampled at once")
    for one, other in (*SAME, *TEXTS.items()):
        if one in names and other in names:
            raise StudyError(f"{one} and {other} set the same thing: sweep one of them")
    _check_fixed(names, {name for name, _ in flattened(file.set)})
    return names


def _check_fixed(names: list[str], fixed: set[str]) -> None:
    if "seed" in fixed:
        raise StudyError("set.seed has no effect: the flights have the seeds of the study; use seeds")
    for one, other in (*((name, name) for name in names), *SAME):
        if one in names and other in fixed:
            raise StudyError(f"{one} is swept, and set.{other} says what it is: leave one of them out")


def points_of(file: StudyFile) -> list[dict[str, Value]]:
    """Return the settings of each point; StudyError for invalid axes."""
    axes: list[list[Value]] = []
    for name, values in file.grid.items():
        if isinstance(values, Range):
            if values.steps is None:
                raise StudyError(f"grid.{name}: a range on a grid needs steps")
            last = values.steps - 1
            axes.append([values.at(step / last) for step in range(values.steps)])
        elif not values:
            raise StudyError(f"grid.{name} is an empty list: no flight comes of it")
        elif len(set(values)) < len(values):
            raise StudyError(f"grid.{name} names a value twice")
        else:
            axes.append(list(values))
    count = math.prod(len(axis) for axis in axes) * (file.sample.points if file.sample else 1)
    if count > FLIGHTS_MAX:
        raise StudyError(f"{count} points; at most {FLIGHTS_MAX} flights make one study")
    grid = [dict(zip(file.grid, values, strict=True)) for values in itertools.product(*axes)]
    points = [{**one, **other} for one, other in itertools.product(grid, _sampled(file.sample))]
    for point in points:
        for name, value in point.items():
            check_value(name, value)
    return points


def _sampled(sample: SampleSection | None) -> list[dict[str, Value]]:
    if sample is None:
        return [{}]
    import numpy as np
    from scipy.stats import qmc

    for name, one in sample.settings.items():
        if one.steps is not None:
            raise StudyError(f"sample.settings.{name}: steps are of a grid; give points instead")
    size = len(sample.settings)
    if sample.method == "sobol":
        engine = qmc.Sobol(size, rng=np.random.default_rng(sample.seed))
        bits = max(0, (sample.points - 1).bit_length())
        # A whole power of two is what balances a Sobol sequence; what is left over is not flown.
        shares = engine.random_base2(bits)[: sample.points]
    else:
        shares = np.random.default_rng(sample.seed).random((sample.points, size))
    return [
        {
            name: one.at(float(share))
            for (name, one), share in zip(sample.settings.items(), row, strict=True)
        }
        for row in shares
    ]
