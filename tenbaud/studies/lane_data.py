"""What flights side by side read, write and return: arrays with one more place, for the lane."""

from __future__ import annotations

from typing import Any, NamedTuple


class LaneWork(NamedTuple):
    """Arrays of flights side by side.

    Where loops run over lanes the lane is the last index, where a coder is called it is the one before.
    """

    torque: Any
    """tick, lane; one row of zeros for none"""
    models: Any
    """sample, lane, state: the codec's model before each sample"""
    coders: Any
    """sample, lane, number: its coder before each sample"""
    sent: Any
    """sample, lane, symbol"""
    model: Any
    coder: Any
    spare: Any
    """lane, number: states of the provisional copy"""
    correction: Any
    """of one lane"""
    state: Any
    """state, lane: the model between ticks"""
    held: Any
    nothing: Any
    """axis, lane: corrections that are held"""
    plant: Any
    """state, lane"""
    integral: Any
    counts: Any
    still: Any
    """ticks since the counts changed"""
    well: Any
    """whether the lane keeps the ordinary course"""
    commanded: Any
    """tick + 1, motor, lane; row 0 is what the line starts with"""
    applied: Any
    """tick + 1, motor, lane; row 0 is safe"""
    coded: Any
    live: Any
    """tick, lane"""
    squares: Any
    largest: Any
    """of the errors coded and live, and of tracking and the angle: kind, lane"""
