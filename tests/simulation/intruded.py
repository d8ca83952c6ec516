"""The world with company: an intruder on the line, and second receivers of the same flight.

Every receiver hears all that goes up, and the transmitter all that comes down, as on one Zenoh key. A
receiver that has ended (a second one is refused) is a process that has gone; the flight's own is
started again after a second, by its operator.
"""

from __future__ import annotations

import math
import random
from dataclasses import dataclass

from channel.line.impairments import ImpairedLine
from channel.protocol.bounds import COUNTER
from channel.protocol.sabotage import Sabotage, SabotagedCodec
from receiver.endpoint import ReceiverEndpoint
from receiver.session.session import Phase
from tests.simulation.faults import FAULTY_S, Plan
from tests.simulation.intruder import Intruder
from tests.simulation.world import World

START_AGAIN_NS = 1_000_000_000


@dataclass(frozen=True)
class Intrusion:
    """What a seed asks of the company, until the faults stop."""

    rate_hz: float = 0.0
    """messages injected, evenly distributed in time, into one direction or the other"""
    replayed_share: float = 0.5
    """of these; the others are forged"""
    seconds: tuple[tuple[int, int], ...] = ()
    """when second receivers are there: (start, end), true time, ns"""


def draw_intrusion(seed: int) -> Intrusion:
    """Return the company of a seed; most of them have some."""
    chance = random.Random(f"{seed} intrusion")
    seconds = []
    for _ in range(chance.choice((0, 1, 1, 2))):
        start_ns = round(chance.uniform(0.0, FAULTY_S) * 1e9)
        seconds.append((start_ns, start_ns + round(chance.uniform(0.5, 10.0) * 1e9)))
    rate_hz = chance.choice((0.0, 0.5, 2.0, 10.0, 50.0))
    return Intrusion(rate_hz, chance.choice((0.0, 0.5, 0.5, 1.0)), tuple(sorted(seconds)))


class IntrudedWorld(World):
    """One flight with company."""

    def __init__(self, plan: Plan, intrusion: Intrusion) -> None:
        super().__init__(plan)
        self.intrusion = intrusion
        self.intruder = Intruder(
            random.Random(f"{plan.seed} intruder"), self.codec, self.terms, self.identity
        )
        self._second: ReceiverEndpoint | None = None
        alphabet = self.codec.coder.alphabet
        self._second_down = ImpairedLine(plan.down, alphabet, f"{plan.seed} second down")

    @property
    def recovery_ns_max(self) -> int:
        """Return the bound of a flight that was alone, and what a forged answer costs beside it.

        The transmitter has taken an epoch for begun in which nobody flies. It learns of that when its
        watchdog has had enough, which counts from when the first command of that epoch was owed; then
        it asks as ever.
        """
        wasted_ticks = 2 * self.terms.lead_ticks + self.plan.watchdog_ticks
        wasted_ns = wasted_ticks * self.terms.tick_ns + self.plan.round_trip_ns
        return super().recovery_ns_max + wasted_ns

    @property
    def calm_rejoins_max(self) -> int:
        """Return how often the ends may rejoin after the last fault.

        Every forged request that is still on the line may begin an epoch, whose answer is taken.
        """
        on_line = self.intrusion.rate_hz * self.plan.round_trip_ns / 1e9
        return super().calm_rejoins_max + math.ceil(on_line)

    def fly(self) -> IntrudedWorld:
        """Fly as ever, in company until the faults stop."""
        chance = self.intruder.chance
        faulty_s = self.plan.faulty_s
        for _ in range(round(self.intrusion.rate_hz * faulty_s)):
            self.at(round(chance.uniform(0.0, faulty_s) * 1e9), self._inject)
        for start_ns, end_ns in self.intrusion.seconds:
            self.at(start_ns, self._start_second)
            self.at(end_ns, self._stop_second)
        super().fly()
        self.faults.update(self.intruder.counts)
        return self

    @property
    def out_of_bounds(self) -> int:
        """Return how many frames both ends have dropped for what they hold."""
        node, endpoint = self.node, self.endpoint
        counts = [end.session.counts for end in (node, endpoint) if end is not None]
        return sum(count[COUNTER] for count in counts)

    def _inject(self) -> None:
        chance, intruder = self.intruder.chance, self.intruder
        replay = chance.random() < self.intrusion.replayed_share
        data = intruder.replayed() if replay else intruder.forged()
        if data is None:
            return
        if chance.random() < 0.5:
            super()._receive(data)
            self._give_second(data)
        else:
            super()._take(data)

    # What goes over the line, heard by all

    def _receive(self, data: bytes | None) -> None:
        if data is not None:
            self.intruder.hear(data)
        super()._receive(data)
        self._give_second(data)
        if self.endpoint is not None and self.endpoint.session.phase is Phase.ENDED:
            self.faults["receivers that were refused"] += 1
            self.endpoint = None
            self.at(self.now_ns + START_AGAIN_NS, lambda: self._revive("receiver"))

    def _take(self, data: bytes) -> None:
        self.intruder.hear(data)
        super()._take(data)

    def _deadline_ns(self) -> int | None:
        own = super()._deadline_ns()
        second = None if self._second is None else self._second.session.next_deadline()
        return own if second is None else second if own is None else min(own, second)

    def _calm(self) -> None:
        super()._calm()
        self._stop_second()
        for end in (self.node, self.endpoint):
            codec = None if end is None else end.session.codec
            if isinstance(codec, SabotagedCodec):
                # Company puts samples off; what was to go wrong by now does so no more.
                codec.arm(Sabotage(-1, "model", 0))
        if self.endpoint is None:
            self.start_receiver()

    # The second receiver

    def _start_second(self) -> None:
        if self._second is not None or (self.calm_ns and self.now_ns >= self.calm_ns):
            return
        own, self.endpoint = self.endpoint, None
        self.start_receiver()
        self._second, self.endpoint = self.endpoint, own
        self.faults["second receivers"] += 1

    def _stop_second(self) -> None:
        self._second = None

    def _give_second(self, data: bytes | None) -> None:
        second = self._second
        if second is None:
            return
        messages = second.step(self.now_ns, data).frames
        second.session.flush_records()
        if second.session.phase is Phase.ENDED:
            self._second = None
        for message in messages:
            for arrival_ns, out in self._second_down.carry(message, self.now_ns):
                if out is not None:
                    self.at(arrival_ns, lambda out=out: self._take(out))
