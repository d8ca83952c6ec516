"""The end of a flight on a real rig: the voltages go down along the guard's ramp, tick by tick.

A body that hovers and loses its lift at once drops by as much as its stand allows.
"""

from __future__ import annotations

import sys

from transmitter.guard import GuardCause, GuardReason
from transmitter.node import TransmitterNode


class RampDown:
    """Takes a node's motors to their safe voltage; for a rig that does not ask for it, nothing.

    `tick` is the first one that was not flown.
    """

    def __init__(self, node: TransmitterNode, tick: int) -> None:
        self._node = node
        self._tick = tick
        self._tick_ns = node.session.terms.tick_ns
        self.over = not node.rig.ramps_down or node.latched
        if not self.over:
            node.guard.trip(GuardReason(GuardCause.FLIGHT_OVER))

    @property
    def next_ns(self) -> int:
        """Return the flight time at which `step` has something to do."""
        return sys.maxsize if self.over else self._tick * self._tick_ns

    def step(self, now_ns: int) -> None:
        """Write the voltages of a tick that is due."""
        if self.over or now_ns < self.next_ns:
            return
        self._node.rig.write(self._tick, self._node.guard.apply(self._tick, None))
        self._tick = max(self._tick, now_ns // self._tick_ns) + 1
        self.over = self._node.latched
