"""A co-simulation FMU as the plant: the trajectories of the same plant in Python, and its errors."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plant_sim.plant import Plant, PlantContext
from tenbaud import fly
from tenbaud.build.parts import PartError
from tenbaud.config.load import load_config, nested
from tenbaud.config.outside_code import CodeNotAllowed, require_allowed
from tests.tenbaud.processes import run as run_command

pytest.importorskip("fmpy", reason="the extra fmu is not installed")
builder = pytest.importorskip("pythonfmu.builder", reason="pythonfmu is not installed")

TICK_S = 0.004

MOTION = """
def moved(angle, rate, gain, volts, step_s):
    rate += step_s * (53.6 * angle - 0.1 * rate + gain * volts)
    return angle + step_s * rate, rate
"""
"""A pendulum near upright; the FMU and the plant in Python both run this text."""

SLAVE = (
    """
from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Fmi2Variability, Real
"""
    + MOTION
    + """
class Pendulum(Fmi2Slave):
    def __init__(self, **values):
        super().__init__(**values)
        self.torque, self.angle, self.rate, self.gain, self.fails_at_s = 0.0, 0.01, 0.0, 4.0, 1e9
        self.upright = True
        tunable = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("torque", causality=Fmi2Causality.input))
        self.register_variable(Real("angle", causality=Fmi2Causality.output))
        self.register_variable(
            Boolean("upright", causality=Fmi2Causality.output, variability=Fmi2Variability.discrete))
        self.register_variable(Real("gain", **tunable))
        self.register_variable(Real("fails_at_s", **tunable))

    def do_step(self, time_s, step_s):
        self.angle, self.rate = moved(self.angle, self.rate, self.gain, self.torque, step_s)
        return time_s < self.fails_at_s - 1e-9
"""
)


class PythonPendulum:
    """The same plant without an FMU."""

    def __init__(self, gain: float) -> None:
        self._state = (0.01, 0.0)
        self._gain = gain
        found: dict[str, Any] = {}
        exec(MOTION, found)
        self._moved = found["moved"]

    @property
    def measured(self) -> tuple[float, ...]:
        return self._state[:1]

    def advance(self, volts: tuple[float, ...]) -> None:
        self._state = self._moved(*self._state, self._gain, volts[0], TICK_S)


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fmu")
    (folder / "pendulum.py").write_text(SLAVE)
    made: Path = builder.FmuBuilder.build_FMU(folder / "pendulum.py", dest=folder)
    return made


def settings(fmu: Path, **options: Any) -> dict[str, Any]:
    names = {"file": str(fmu), "inputs": {"motor": "torque"}, **options}
    return {
        "duration_s": 4.0,
        "transmitter.plant": {"kind": "fmu", "options": names, "initial": 0.0},
    }


def test_an_fmu_flies_as_the_same_plant_in_python_does(fmu: Path, tmp_path: Path) -> None:
    """Within 1e-12 rad at each of 999 ticks: both compute the same doubles."""
    changes = settings(fmu, start={"gain": 3.5})
    flown = fly("pendulum-30baud", settings=changes, out=tmp_path / "fmu")
    plant: Plant = PythonPendulum(3.5)
    alone = {name: value for name, value in changes.items() if name != "transmitter.plant"}
    same = fly("pendulum-30baud", settings=alone, plant=plant, out=tmp_path / "python")
    assert len(flown.angle) == 999
    assert np.ptp(flown.angle) > 1e-3
    np.testing.assert_allclose(flown.angle, same.angle, rtol=0.0, atol=1e-12)
    assert flown.summary["desyncs"] == 0


def test_two_processes_fly_an_fmu(fmu: Path, tmp_path: Path) -> None:
    (tmp_path / "flight.toml").write_text(
        f"""
preset = "pendulum-30baud"
duration_s = 2.0
[transmitter.plant]
kind = "fmu"
initial = 0.0
options = {{ file = "{fmu}", inputs = {{ motor = "torque" }} }}
"""
    )
    done = run_command("demo", "--config", "flight.toml", "--out", "flown", cwd=tmp_path)
    assert done.code == 0, done.err
    audited = run_command("audit", "flown", cwd=tmp_path)
    assert audited.code == 2
    assert f"would run the machine code in {fmu}" in audited.err


def test_machine_code_is_not_run_unless_it_is_allowed(fmu: Path) -> None:
    changes = nested(settings(fmu))
    with pytest.raises(CodeNotAllowed, match=rf"would run the machine code in {fmu}"):
        require_allowed(load_config("pendulum-30baud", None, changes))
    require_allowed(load_config("pendulum-30baud", None, changes, allow_code=True))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"inputs": {}},
            "has no input motor for the signal motor. Its inputs are torque; write inputs",
        ),
        ({"inputs": {"motor": "gain"}}, "has no input gain for the signal motor; gain is a parameter"),
        (
            {"outputs": {"angle": "torque"}},
            "has no output torque for the signal angle; torque is a input",
        ),
        ({"outputs": {"angle": "upright"}}, "upright is of the type Boolean; only real numbers can"),
        ({"outputs": {"pitch": "angle"}}, "outputs: the model has no output pitch, only angle"),
        ({"start": {"mass": 1.0}}, "has no variable mass"),
        ({"file": "nowhere.fmu"}, "there is no file nowhere.fmu"),
        ({"file": __file__}, "test_fmu.py is no FMU: File is not a zip file"),
    ],
)
def test_errors_name_the_variable(fmu: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(PartError) as error:
        fly("pendulum-30baud", settings=settings(fmu, **options))
    assert "transmitter.plant.kind = 'fmu': " in str(error.value)
    assert words in str(error.value)


def test_errors_name_the_platform(fmu: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.fmu"
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(other, "w") as target:
        for name in source.namelist():
            if "binaries" not in name or name.endswith("Pendulum.dll"):
                target.writestr(name, source.read(name))
    with pytest.raises(PartError, match=r"has no binary for .*, only for win"):
        fly("pendulum-30baud", settings=settings(other))


def test_a_refused_step_is_reported_with_its_tick_and_time(fmu: Path, tmp_path: Path) -> None:
    changes = settings(fmu, start={"fails_at_s": 1.0})
    with pytest.raises(Exception, match=r"refused the step from 1 s \(tick 250\) of 0.004 s"):
        fly("pendulum-30baud", settings=changes, out=tmp_path / "flown")


def test_settings_of_built_in_plants_are_refused(fmu: Path) -> None:
    with pytest.raises(PartError, match="mismatch, disturbance and initial outputs are of built-in"):
        fly("pendulum-30baud", settings={**settings(fmu), "transmitter.plant.mismatch": 0.1})


def test_unpacked_files_go_with_the_plant(fmu: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from plant_sim.fmu import FmuPlant

    removed: list[str] = []
    monkeypatch.setattr(shutil, "rmtree", lambda folder, **_: removed.append(folder))
    names = {"inputs": ("torque",), "outputs": ("angle",)}
    plant = FmuPlant(PlantContext(TICK_S, 0, (10.0,), 0.0, None, (), **names), str(fmu))
    plant.advance((1.0,))
    assert plant.measured != (0.01,)
    freed, free = [], plant._fmu.freeInstance

    def refuse() -> None:
        raise RuntimeError("after a step that was refused")

    monkeypatch.setattr(plant._fmu, "terminate", refuse)
    monkeypatch.setattr(plant._fmu, "freeInstance", lambda: freed.append(free()))
    del plant
    assert len(removed) == len(freed) == 1
