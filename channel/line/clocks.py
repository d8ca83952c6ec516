"""A clock that runs fast, slow or in jumps, to test how the ends react."""

from __future__ import annotations

from channel.line.impairments import LineFaults
from channel.line.slots import Departure
from channel.line.virtual import Peer, Reply


class SkewedClock:
    """Maps true time to the time of a bad clock, and back. Times are in ns from `start_ns` on."""

    def __init__(self, faults: LineFaults, start_ns: int = 0) -> None:
        self._rate = 1.0 + faults.skew_ppm / 1e6
        self._steps = faults.clock_steps
        self._start_ns = start_ns

    def shown(self, true_ns: int) -> int:
        """Return the clock's time at a true time."""
        since_ns = true_ns - self._start_ns
        jumps = sum(jump for at, jump in self._steps if since_ns >= at)
        return self._start_ns + round(since_ns * self._rate) + jumps

    def reached(self, shown_ns: int, not_before_ns: int = -(2**62)) -> int:
        """Return the first true time, not before another, at which the clock shows `shown_ns`.

        A clock that jumped back shows it twice.
        """
        before_ns = not_before_ns
        jumps = 0
        for at, jump in (*self._steps, (2**62, 0)):
            wanted = round((shown_ns - self._start_ns - jumps) / self._rate) + self._start_ns
            wanted = max(wanted, before_ns)
            if wanted < at + self._start_ns:
                break
            before_ns = max(before_ns, at + self._start_ns)
            jumps += jump
        while self.shown(wanted) < shown_ns:
            wanted += 1
        return wanted


class SkewedPeer:
    """A receiver on the virtual clock whose own clock is a bad one."""

    def __init__(self, peer: Peer, clock: SkewedClock) -> None:
        self._peer = peer
        self._clock = clock

    def step(self, time_ns: int, data: bytes | None) -> Reply:
        """Do one step, in the time that the receiver's clock shows."""
        reached = self._clock.reached
        reply = self._peer.step(self._clock.shown(time_ns), data)
        later = tuple([Departure(reached(at_ns, time_ns), symbol) for at_ns, symbol in reply.later])
        deadline_ns = None if reply.deadline_ns is None else reached(reply.deadline_ns)
        return reply._replace(deadline_ns=deadline_ns, later=later)
