"""The compiled step of a plant that is written as equations."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numba
import pytest

from channel.codec.numerics import sin
from plant_sim.ode import ode_step
from plant_sim.servo import ServoPlant, servo_slopes
from tenbaud.studies import machine_code
from tenbaud.studies.compiled import compiled, part
from tenbaud.studies.plants import plant_step_of
from tests.plant_sim.test_ode import built


def test_a_step_of_equations_is_compiled_without_a_warning_and_has_the_bits_of_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(machine_code, "cache_folder", lambda: tmp_path)
    remembered: tuple[Any, ...] = (compiled, plant_step_of)
    try:
        for one in remembered:
            one.cache_clear()
        plant = built(ServoPlant, 1, initial=(0.5,))
        step, sine = plant_step_of(servo_slopes), part(sin)

        @numba.njit
        def outer(state: Any, command: Any, push: Any, constants: Any) -> Any:
            return step(state, command, push, constants, sine)

        given = (plant.state, tuple(plant.motors)), (3.0,), (0.1,), plant.step_constants
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert outer(*given) == ode_step(servo_slopes, *given, sin)
    finally:
        for one in remembered:
            one.cache_clear()
