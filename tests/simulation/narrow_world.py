"""The whole system with the narrow downlink: the law mirrored, two symbols down a sample."""

from __future__ import annotations

from dataclasses import replace

from channel.codec.codec import Codec
from channel.codec.downlink.layout import Layout
from channel.codec.downlink.machine import TwoWay
from channel.codec.downlink.mirrored import MirroredLaw, SetPointRange
from channel.line.impairments import LineFaults
from tenbaud.build.liveness import round_trip, watchdog_ticks
from tests.simulation.faults import Plan
from tests.simulation.narrow import LIMITS, NO_SLEW, START, paper_law
from tests.simulation.world import World

LAYOUT = Layout(2, 1, 4)
WORD_SAMPLES = 15
FORGOTTEN_SAMPLES = 4
CONFIRMATION_SAMPLES_MAX = 40
"""How long the first confirmation of an epoch may take."""


def narrowed(plan: Plan) -> Plan:
    """Return the plan with the narrow downlink and a mirrored law, which needs no command lead."""
    count = LAYOUT.symbols_per_sample
    baud = count * 1e9 / plan.terms.sample_ns
    terms = replace(plan.terms, lead_ticks=0).narrowed(baud, count, is_mirrored=True)
    trip = round_trip(terms, LineFaults(plan.up, plan.down), "real")
    return replace(plan, terms=terms, watchdog_ticks=max(60, watchdog_ticks(None, terms, trip)))


class NarrowWorld(World):
    """Confirmation takes longer than an echo does."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(plan)
        for _, sabotage in plan.sabotage:
            # The motors' lag forgets: its last bit is right again after two or three samples.
            self.watch.unseen.update(range(sabotage.sample, sabotage.sample + FORGOTTEN_SAMPLES))

    def two_way(self, codec: Codec) -> TwoWay:
        # The transmitter must know a set-point in time: its word, and the way down, take samples.
        queue = WORD_SAMPLES + 2 + -(-self.plan.round_trip_ns // self.terms.sample_ns)
        scheme = MirroredLaw(paper_law(), (SetPointRange(0, -2.0, 2.0),), 1, 9, queue, LAYOUT)
        return TwoWay(codec, scheme, LAYOUT, 0, START, LIMITS, NO_SLEW)

    @property
    def recovery_ns_max(self) -> int:
        # Without a command lead an answer may begin before it has come; the next ones begin later.
        waiting_ns = CONFIRMATION_SAMPLES_MAX * self.terms.sample_ns + 3 * self.plan.round_trip_ns
        return super().recovery_ns_max + waiting_ns

    @property
    def calm_rejoins_max(self) -> int:
        return super().calm_rejoins_max + 4
