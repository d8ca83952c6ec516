"""What flights side by side read, write and return: arrays with one more place, for the lane."""

from __future__ import annotations

from typing import Any, NamedTuple

from tenbaud.studies.bare import bare


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


def bare_lanes(work: LaneWork) -> LaneWork:
    """Return the same arrays, uncounted; see `bare`."""
    return LaneWork(
        bare(work.torque),
        bare(work.models),
        bare(work.coders),
        bare(work.sent),
        bare(work.model),
        bare(work.coder),
        bare(work.spare),
        bare(work.correction),
        bare(work.state),
        bare(work.held),
        bare(work.nothing),
        bare(work.plant),
        bare(work.integral),
        bare(work.counts),
        bare(work.still),
        bare(work.well),
        bare(work.commanded),
        bare(work.applied),
        bare(work.coded),
        bare(work.live),
        bare(work.squares),
        bare(work.largest),
    )
