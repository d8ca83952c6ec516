"""A recorded flight, as both ends and the studies take it. `tenbaud/log` reads the files."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    Floats = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
    Whole = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


@dataclass(frozen=True, slots=True, eq=False)
class FlightLog:
    """Row `k` holds what was measured and applied at step `k`, evenly sampled."""

    tick_s: float
    measured: Floats
    """(rows, outputs), in the units of the model's outputs"""
    commands: Floats
    """(rows, inputs), in the units of the model's inputs; (rows, 0): the file has none"""
    counts: Whole
    """(rows, outputs): what an encoder read; the file's own counts, or those of `measured`"""
    start_s: float = 0.0
    """the file's clock at row 0"""
    notes: tuple[str, ...] = ()
    """changes made to the file, for people"""
    steps: tuple[float, ...] = ()
    """of each output, how far its values lie apart; 0: as fine as numbers are"""

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.counts)
