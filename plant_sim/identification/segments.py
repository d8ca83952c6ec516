"""A record cut into segments, which are simulated side by side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plant_sim.identification.filters import Array
from plant_sim.identification.record import Record
from plant_sim.identification.structures import Structure

SEGMENT_S = 5.0
SEGMENTS_MIN = 4
SAMPLES_MAX = 400_000
"""samples that are simulated; of a longer record, segments all over it"""
MEMORY_S = 10.0
MEMORY_MAX = 5000
"""seconds and samples before a segment that its lag remembers, at most"""


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """All segments side by side: (samples, segments, signals)."""

    step_s: float
    outputs: Array
    inputs: Array
    before: Array
    """(inputs before each segment, segments, inputs): memory of the lag"""

    @property
    def scale(self) -> Array:
        """Return the usual size of each output's motion within a segment."""
        moved = self.outputs - self.outputs.mean(axis=0)
        return np.asarray(np.maximum(np.sqrt(np.mean(moved**2, axis=(0, 1))), 1e-12))


def cut(record: Record, structure: Structure, segment_s: float, *, rests: bool = False) -> Segments:
    """Return the segments of a record; before one that does not begin at rest its first input held."""
    steps = max(8, round(segment_s / record.step_s))
    count = len(record) // steps
    if count < SEGMENTS_MIN:
        steps, count = len(record) // SEGMENTS_MIN, SEGMENTS_MIN
    chosen = np.arange(count)
    if count * steps > SAMPLES_MAX:
        chosen = np.linspace(0, count - 1, max(SEGMENTS_MIN, SAMPLES_MAX // steps)).astype(int)
    rows = chosen[None, :] * steps + np.arange(steps)[:, None]
    inputs = structure.acting(record.inputs)
    memory = min(len(record), round(MEMORY_S / record.step_s), MEMORY_MAX)
    behind = chosen[None, :] * steps - np.arange(memory, 0, -1)[:, None]
    before = inputs[np.maximum(behind, 0)]
    if rests:
        before[behind < 0] = 0.0
    return Segments(record.step_s, record.outputs[rows], inputs[rows], before)


def every_other(segments: Segments, first: int) -> Segments:
    """Return every other segment."""
    outputs, inputs, before = (
        one[:, first::2] for one in (segments.outputs, segments.inputs, segments.before)
    )
    return Segments(segments.step_s, outputs, inputs, before)
