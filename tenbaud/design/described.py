"""Linear plants by name and by configuration: what `tenbaud floor` and `tenbaud design` are about."""

from __future__ import annotations

import tomllib
from importlib.resources import files

import numpy as np
from numpy.typing import ArrayLike

from channel.codec.codec import Codec
from channel.line.uplink import bits_per_symbol
from plant_sim.zero_order_hold import continuous, discretised
from tenbaud.bounds.floor import RateTooLow
from tenbaud.bounds.linear import rate_needed, unreached
from tenbaud.config.models import LinearModelSection, PendulumModelSection, PitchModelSection
from tenbaud.config.schema import FlightConfig
from tenbaud.config.section import KindSection
from tenbaud.design.plant import LinearPlant, linear_plant

PITCH_DENSITY = 2e-3
"""rad^2/s^3; of the torque that designs and floors of the pitch assume"""
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


def plant_of(section: KindSection, tick_s: float) -> LinearPlant | None:
    """Return the plant that a model describes, linearised at rest; None for a model that has none."""
    if isinstance(section, PitchModelSection):
        stiffness, damping = section.stiffness_per_s2, section.rate_damping_per_s
        a, b = [[0.0, 1.0], [-stiffness, -damping]], [[0.0], [1.0]]
        return linear_plant(a, b, [[1.0, 0.0]], densities=PITCH_DENSITY)
    if isinstance(section, PendulumModelSection):
        a = [[0.0, 1.0], [section.growth_per_s**2, -section.damping_per_s]]
        return linear_plant(a, [[0.0], [1.0]], [[1.0, 0.0]], densities=PITCH_DENSITY)
    if not isinstance(section, LinearModelSection):
        return None
    dynamics: ArrayLike
    drive: ArrayLike
    dynamics, drive = section.A, section.B
    if not section.A:
        dynamics, drive = continuous(section.F, section.E, tick_s)
    return linear_plant(
        dynamics, drive, section.C, section.G or None, section.densities, section.weights
    )


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
    alphabet = codec.coder.alphabet
    bits = alphabet.symbols_per_word * bits_per_symbol(alphabet)
    require_rate(plant, bits / (tick_s * codec.ticks_per_sample), section)


def require_rate(plant: LinearPlant, rate_bit_s: float, section: KindSection) -> None:
    """Raise RateTooLow, with rates and the state that grows fastest, where the bits are too few."""
    needed = rate_needed(plant.A)
    if rate_bit_s > needed:
        return
    values, vectors = np.linalg.eig(plant.A)
    fastest = int(np.argmax(values.real))
    name = state_names(section, plant)[int(np.argmax(np.abs(vectors[:, fastest])))]
    raise RateTooLow(
        f"{rate_bit_s:.4g} bit/s are too few: this plant grows by itself, {name} fastest by "
        f"{values[fastest].real:.4g} 1/s, and the data-rate theorem asks for more than {needed:.4g} "
        "bit/s; shorten timing.symbol_period_s and raise channel.rate_baud"
    )


def state_names(section: KindSection, plant: LinearPlant) -> list[str]:
    """Return what the states of a described plant are called."""
    if isinstance(section, LinearModelSection):
        return [one.name for one in section.signals(plant.B.shape[1]).states]
    return ["angle", "rate"]


def require_seen(plant: LinearPlant, section: KindSection) -> None:
    """Raise ValueError, with state and eigenvalue, unless noise and outputs reach every motion."""
    for reach, pair, found in (
        ("the disturbance does not reach", "(A, G)", unreached(plant.A, plant.noise)),
        ("the outputs do not show", "(A, C)", unreached(plant.A.T, plant.C.T * plant.weights)),
    ):
        if found is not None:
            value, place = found
            lost = f"{value.real:.4g}{f'{value.imag:+.4g}j' if value.imag else ''}"
            verb = "controllable (G is B where none is given)" if pair == "(A, G)" else "observable"
            raise ValueError(
                f"{reach} every state: the motion with the eigenvalue {lost} 1/s, mostly of "
                f"{state_names(section, plant)[place]}, is left out, as the pair {pair} is not {verb}; "
                "leave it out of the model, or put such states last, outside `corrected`"
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
    return LinearPlant(
        plant.A[kept, kept],
        plant.B[kept],
        plant.C[:, kept],
        plant.G[kept],
        plant.densities,
        plant.weights,
    )
