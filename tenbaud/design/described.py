"""Linear plants by name and by configuration, for `tenbaud floor` and `tenbaud design`."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from importlib.resources import files

import numpy as np
from numpy.typing import ArrayLike

from channel.codec.codec import Codec
from channel.line.line import bit_rate
from plant_sim.zero_order_hold import continuous, discretised
from tenbaud.bounds import floor
from tenbaud.bounds.linear import unreached
from tenbaud.config.kinds import model_kind
from tenbaud.config.models import LinearModelSection
from tenbaud.config.schema import FlightConfig
from tenbaud.config.section import KindSection
from tenbaud.design.plant import LinearPlant, linear_plant

GROWTH = 1e-6
"""1/s; a motion that grows more slowly is one that stays, found with errors of rounding"""
FOLDER = files("tenbaud") / "presets" / "plants"


def plant_names() -> list[str]:
    """Return the linear plants that come with the package."""
    return sorted(item.name[:-5] for item in FOLDER.iterdir() if item.name.endswith(".toml"))


def plant_section(name: str) -> LinearModelSection:
    """Return the model of a plant of the package; ValueError where there is none of that name."""
    if name not in plant_names():
        raise ValueError(f"there is no linear plant {name!r}; known are {', '.join(plant_names())}")
    values = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    return LinearModelSection.model_validate(values["model"])


def linear_of(section: KindSection) -> LinearModelSection | None:
    """Return the linear model at rest of the plant that a model describes; None without a plant."""
    kind = model_kind(section)
    return None if kind is None or kind.linear is None else kind.linear(section)


def plant_of(section: KindSection, tick_s: float) -> LinearPlant | None:
    """Return the plant that a model describes, linearised at rest; None for a model that has none."""
    linear = linear_of(section)
    if linear is None:
        return None
    dynamics: ArrayLike
    drive: ArrayLike
    dynamics, drive = linear.A, linear.B
    if not linear.A:
        dynamics, drive = continuous(linear.F, linear.E, tick_s)
    return linear_plant(dynamics, drive, linear.C, linear.G or None, linear.densities, linear.weights)


def check_plant(config: FlightConfig, codec: Codec) -> None:
    """Raise ValueError where the bits are too few for a plant, or its matrices are not of one plant."""
    section, tick_s = config.model, config.timing.tick_s
    if isinstance(section, LinearModelSection) and section.A and section.F:
        for name, expected in zip("FE", discretised(section.A, section.B, tick_s), strict=True):
            if not np.allclose(getattr(section, name), expected, rtol=1e-9, atol=1e-12):
                raise ValueError(
                    f"model.{name} is not that of A and B for ticks of {tick_s:g} s: run `tenbaud "
                    "design` again after a change of the plant or of timing.tick_s"
                )
    plant = plant_of(section, tick_s)
    if plant is None:
        return
    require_rate(plant, bit_rate(codec, tick_s), section)
    seen = unreached(plant.A.T, plant.C.T * plant.weights, growth=GROWTH)
    if seen is not None:
        raise ValueError(_unseen(plant, section, *seen))


def require_rate(plant: LinearPlant, rate_bit_s: float, section: KindSection) -> None:
    """Raise RateTooLow, with the state that grows fastest and advice, where the bits are too few."""
    floor.require_rate(
        plant.A,
        rate_bit_s,
        states=state_names(section, plant),
        advice="; shorten timing.symbol_period_s and raise channel.rate_baud",
    )


def state_names(section: KindSection, plant: LinearPlant) -> list[str]:
    """Return the names of the states of a described plant."""
    linear = linear_of(section)
    return [] if linear is None else [one.name for one in linear.signals(plant.B.shape[1]).states]


def require_seen(plant: LinearPlant, section: KindSection) -> None:
    """Raise ValueError, with state and eigenvalue, unless noise and outputs reach every motion."""
    if (found := unreached(plant.A, plant.noise)) is not None:
        raise ValueError(
            f"the disturbance does not reach every state: {_motion(plant, section, *found)} is left "
            "out, as the pair (A, G) is not controllable (G is B where none is given); leave it out of "
            "the model, or put such states last, outside `corrected`"
        )
    if (found := unreached(plant.A.T, plant.C.T * plant.weights)) is not None:
        raise ValueError(_unseen(plant, section, *found))


def _motion(plant: LinearPlant, section: KindSection, value: complex, place: int) -> str:
    lost = f"{value.real:.4g}{f'{value.imag:+.4g}j' if value.imag else ''}"
    return f"the motion with the eigenvalue {lost} 1/s, mostly of {state_names(section, plant)[place]},"


def _unseen(plant: LinearPlant, section: KindSection, value: complex, place: int) -> str:
    """Return what a motion lacks that no output of some weight shows."""
    linear = linear_of(section)
    assert linear is not None
    names = [one.name for one in linear.signals(plant.B.shape[1]).outputs]
    alone = (unreached(plant.A.T, row[:, None], growth=value.real - GROWTH) for row in plant.C)
    shows = [name for name, found in zip(names, alone, strict=True) if found is None]
    advice = (
        f"give {' or '.join(shows)}, which shows it, a weight above 0 (model.weights)"
        if shows
        else "add an output that shows it to C"
    )
    grows = " It grows by itself." if value.real > GROWTH else ""
    return (
        f"the outputs do not show every state: {_motion(plant, section, value, place)} is left out, as "
        f"the pair (A, C), by the weights, is not observable.{grows} Put it last, outside `corrected`, "
        f"if the commands alone move it; otherwise {advice}"
    )


def corrected_part(plant: LinearPlant, states: int) -> LinearPlant:
    """Return the plant of the first states, which take corrections; the others are known."""
    if states in (0, len(plant.A)):
        return plant
    kept = slice(states)
    if np.any(plant.G[states:]) or np.any(plant.A[states:, kept]):
        raise ValueError(
            f"only the first {states} of {len(plant.A)} states take corrections, so the others must "
            "follow from the commands alone; the disturbance or the first states reach them"
        )
    own = {"A": plant.A[kept, kept], "B": plant.B[kept], "C": plant.C[:, kept], "G": plant.G[kept]}
    return replace(plant, **own)
