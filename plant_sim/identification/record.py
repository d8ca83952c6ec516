"""A recorded motion: outputs and inputs, evenly sampled, checked."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from plant_sim.identification.errors import IdentificationError
from plant_sim.identification.filters import Array

STEPS_MIN = 100


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """Outputs and inputs, a row for each sample; the inputs of a sample are held until the next one."""

    step_s: float
    outputs: Array
    inputs: Array
    output_names: tuple[str, ...] = ()
    input_names: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    input_units: tuple[str, ...] = ()
    steps: tuple[float, ...] = ()
    """of each output, how far its values lie apart; 0: as fine as numbers are"""

    def __post_init__(self) -> None:
        """Refuse an invalid record; name the signals that have no names."""
        if not (math.isfinite(self.step_s) and self.step_s > 0.0):
            raise IdentificationError(f"the sampling time is {self.step_s} s; it must be above 0")
        if len(self.outputs) != len(self.inputs):
            raise IdentificationError(
                f"outputs and inputs have different lengths: {len(self.outputs)}, {len(self.inputs)}"
            )
        if len(self) < STEPS_MIN:
            raise IdentificationError(f"{len(self)} samples are too few; give at least {STEPS_MIN}")
        object.__setattr__(self, "steps", self.steps or (0.0,) * self.outputs.shape[1])
        for what in ("output", "input"):
            values = getattr(self, f"{what}s")
            count = values.shape[1]
            numbered = [f"{what}{index + 1}" for index in range(count)] if count > 1 else [what]
            names = getattr(self, f"{what}_names") or tuple(numbered[:count])
            object.__setattr__(self, f"{what}_names", names)
            units = getattr(self, f"{what}_units") or ("",) * count
            object.__setattr__(self, f"{what}_units", units)
            if not np.isfinite(values).all():
                row, column = np.argwhere(~np.isfinite(values))[0]
                raise IdentificationError(f"the {names[column]} of sample {row} is not finite")

    def __len__(self) -> int:
        return len(self.outputs)

    @property
    def duration_s(self) -> float:
        """Return the time from the first sample to the last."""
        return (len(self) - 1) * self.step_s

    def part(self, start_s: float, end_s: float) -> Record:
        """Return the samples in `start_s <= t < end_s`."""
        cut = slice(math.ceil(start_s / self.step_s - 1e-6), math.ceil(end_s / self.step_s - 1e-6))
        return replace(self, outputs=self.outputs[cut], inputs=self.inputs[cut])
