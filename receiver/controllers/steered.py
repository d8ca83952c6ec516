"""A set-point that a person may take over while the flight goes on."""

from __future__ import annotations

from receiver.controllers.references import Reference


class SteeredReference:
    """A `Reference` that is the configured one until somebody steers.

    To be steered between two samples only: every tick of a sample then sees the same hand.
    """

    def __init__(self, programme: Reference) -> None:
        self._programme = programme
        self.by_hand_rad: float | None = None
        """the angle given by hand; None: the configured reference is followed"""

    def steer(self, angle_rad: float | None) -> None:
        """Take the reference by hand; None gives it back to what is configured."""
        self.by_hand_rad = angle_rad

    def angle_rad(self, tick: int) -> float:
        """Return the reference angle (rad) at `tick`."""
        return self._programme.angle_rad(tick) if self.by_hand_rad is None else self.by_hand_rad
