"""A co-simulation FMU (FMI 2.0 or 3.0) as the plant; it needs the extra `fmu` (fmpy).

An FMU holds machine code and loading it runs that: `tenbaud.config.outside_code` treats a configuration
that names one like one that names a class from outside.
"""

from __future__ import annotations

import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any
from weakref import finalize

from plant_sim.plant import PlantContext, held_command

Names = Mapping[str, str]


class FmuPlant:
    """A `Plant` whose steps an FMU computes.

    `inputs` and `outputs` give for a signal of the model the variable of the FMU; a signal that is not
    in them has the variable of its own name. `start` gives the start values of parameters and
    other variables by their names in the FMU. ValueError names the file or variable that does not fit.
    """

    def __init__(
        self,
        context: PlantContext,
        file: str,
        inputs: Names | None = None,
        outputs: Names | None = None,
        start: Mapping[str, float] | None = None,
    ) -> None:
        if context.mismatch != 0.0 or context.disturbance_text or any(context.initial):
            raise ValueError(
                "mismatch, disturbance and initial outputs are of built-in plants; give the FMU's own "
                "variables as start = { variable = value }"
            )
        fmpy, description = _described(file)
        variables = {one.name: one for one in description.modelVariables}

        def references(causality: str, signals: Sequence[str], names: Names | None) -> list[int]:
            return _references(file, variables, causality, signals, names or {})

        self._inputs = references("input", context.inputs, inputs)
        self._outputs = references("output", context.outputs, outputs)
        values = {_number(file, variables, name): value for name, value in (start or {}).items()}
        self._largest = context.command_max
        self._step_s = context.step_s
        self._steps = 0
        self._is_fmi3 = description.fmiVersion.startswith("3")
        folder = fmpy.extract(file)
        # Also for a plant that is never closed: the folder holds the FMU's unpacked files.
        finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self._fmu = fmpy.instantiate_fmu(folder, description, "CoSimulation")
        finalize(self, _end, self._fmu)
        if not self._is_fmi3:
            self._fmu.setupExperiment(startTime=0.0)
        self._write(list(values), list(values.values()))
        self._fmu.enterInitializationMode()
        self._fmu.exitInitializationMode()
        self._measured = self._read()

    @property
    def measured(self) -> tuple[float, ...]:
        return self._measured

    def advance(self, volts: tuple[float, ...]) -> None:
        """Hold a command, clamped, for one step; ValueError where the FMU refuses it."""
        self._write(self._inputs, list(held_command(volts, self._largest)))
        at_s = self._steps * self._step_s
        try:
            self._fmu.doStep(at_s, self._step_s)
        except Exception as error:  # fmpy has no class of its own for every failure
            raise ValueError(
                f"the FMU refused the step from {at_s:g} s (tick {self._steps}) of {self._step_s:g} s: "
                f"{error}"
            ) from error
        self._steps += 1
        self._measured = self._read()

    def _read(self) -> tuple[float, ...]:
        get = self._fmu.getFloat64 if self._is_fmi3 else self._fmu.getReal
        return tuple(get(self._outputs))

    def _write(self, references: list[int], values: list[float]) -> None:
        if references:
            put = self._fmu.setFloat64 if self._is_fmi3 else self._fmu.setReal
            put(references, values)


def _described(file: str) -> tuple[Any, Any]:
    """Return fmpy, and the description of an FMU that it can run here."""
    try:
        fmpy = import_module("fmpy")
    except ModuleNotFoundError as error:
        raise ValueError(f"it needs {error.name}: pip install 'tenbaud[fmu]'") from error
    if not Path(file).is_file():
        raise ValueError(f"there is no file {file}")
    try:
        description = fmpy.read_model_description(file)
    except Exception as error:  # of zip, of XML, or of what the description says
        raise ValueError(f"{file} is no FMU: {error}") from error
    if description.fmiVersion.startswith("1") or description.coSimulation is None:
        raise ValueError(
            f"{file} (FMI {description.fmiVersion}) is for model exchange only or of FMI 1; export it "
            "for co-simulation with FMI 2 or 3"
        )
    platforms = fmpy.supported_platforms(file)
    if fmpy.platform not in platforms and fmpy.platform_tuple not in platforms:
        raise ValueError(
            f"{file} has no binary for {fmpy.platform_tuple}, only for {', '.join(platforms) or 'none'}"
        )
    return fmpy, description


def _references(
    file: str, variables: Mapping[str, Any], causality: str, signals: Sequence[str], names: Names
) -> list[int]:
    """Return the value reference of each signal's variable."""
    if unknown := [name for name in names if name not in signals]:
        raise ValueError(
            f"{causality}s: the model has no {causality} {unknown[0]}, only {', '.join(signals)}"
        )
    found = []
    for signal in signals:
        name = names.get(signal, signal)
        if name not in variables or variables[name].causality != causality:
            is_there = f"; {name} is a {variables[name].causality}" if name in variables else ""
            there = [one.name for one in variables.values() if one.causality == causality]
            raise ValueError(
                f"{file} has no {causality} {name} for the signal {signal}{is_there}. Its {causality}s "
                f'are {", ".join(there) or "none"}; write {causality}s = {{ {signal} = "NAME" }}'
            )
        found.append(_number(file, variables, name))
    return found


def _number(file: str, variables: Mapping[str, Any], name: str) -> int:
    """Return the value reference of a variable that is a real number."""
    if name not in variables:
        raise ValueError(f"{file} has no variable {name}")
    if (kind := variables[name].type) not in ("Real", "Float64"):
        raise ValueError(f"{file}: {name} is of the type {kind}; only real numbers can be used")
    reference: int = variables[name].valueReference
    return reference


def _end(fmu: Any) -> None:
    with suppress(Exception):  # one that refused a step may refuse this too
        fmu.terminate()
    with suppress(Exception):
        fmu.freeInstance()
