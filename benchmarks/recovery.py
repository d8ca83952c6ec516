"""How long it takes to notice that lockstep is gone, and to have it back: in the simulator."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from channel.line.impairments import Impairments, LineFaults
from channel.protocol.frames import Commands, Frame, Symbol
from channel.protocol.sabotage import Sabotage
from channel.protocol.wire import decode
from tests.channel.codec.parts import THREE_SIGNS, terms
from tests.simulation.faults import Plan
from tests.simulation.world import World
from transmitter.endpoint import TransmitterNode
from transmitter.session.session import Phase

SAMPLE_NS = 100_000_000
TICK_NS = 10_000_000
CORRUPTED_SAMPLE = 60
CUT_NS = (6_005_000_000, 7_005_000_000)


@dataclass(frozen=True)
class Recovery:
    """One failure; times in samples."""

    what: str
    trip_samples: float
    detected_samples: float | None
    """from the fault (for a cut: from its end) to the request for a new epoch"""
    rejoined_samples: float
    """from there (for a restart: from the moment when both are up) to the new epoch's first symbol"""
    control_bytes: int | None


class _Stopwatch(World):
    """A world that notes when the transmitter asks, and when it flies again."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(plan)
        self.asked_ns: int | None = None
        self.back_ns: int | None = None
        self.control_bytes = 0
        inner = self.watch.on_delivered
        self.watch.on_delivered = lambda node: self._look(node, inner)  # type: ignore[method-assign]

    def _look(self, node: TransmitterNode, inner: Callable[[TransmitterNode], None]) -> None:
        inner(node)
        if node.session.phase is Phase.REJOINING and self.asked_ns is None:
            self.asked_ns = self.now_ns

    def _offer(self, frames: Sequence[Frame]) -> None:
        super()._offer(frames)
        session = self.node.session if self.node is not None else None
        symbols = any(isinstance(frame, Symbol) for frame in frames)
        if symbols and session is not None and session.epoch_tick > 0 and self.back_ns is None:
            self.back_ns = self.now_ns

    def _take(self, data: bytes) -> None:
        if self.now_ns > SAMPLE_NS * 20 and not isinstance(decode(data), Commands):
            self.control_bytes += len(data)
        super()._take(data)


def recoveries() -> list[Recovery]:
    """Return all cases."""
    found = []
    for trip in (0, 1, 5, 10):
        line = Impairments(delay_ns=trip * SAMPLE_NS // 2)
        plan = _plan(line)
        corrupted = replace(plan, sabotage=(("receiver", Sabotage(CORRUPTED_SAMPLE, "coder", 0)),))
        world = _fly(corrupted)
        # Tick 0 is a handshake and one tick after true time 0.
        corrupted_ns = trip * SAMPLE_NS + TICK_NS + CORRUPTED_SAMPLE * SAMPLE_NS
        found.append(_timed("a bit of one state differs", trip, world, corrupted_ns, True))
        cut = replace(plan, partitions=((*CUT_NS, "both"),))
        found.append(_timed("line cut for ten samples", trip, _fly(cut), CUT_NS[1], False))
        for end in ("receiver", "transmitter"):
            killed_ns, outage_ns = 6_000_000_000, 500_000_000
            killed = replace(plan, restarts=((killed_ns, end),), outages_ns=(outage_ns,))
            world = _fly(killed)
            up_ns = killed_ns + outage_ns
            back_ns = world.back_ns or 0
            found.append(
                Recovery(f"{end} killed, back at once", trip, None, (back_ns - up_ns) / SAMPLE_NS, None)
            )
    return found


def _fly(plan: Plan) -> _Stopwatch:
    world = _Stopwatch(plan)
    world.fly()
    return world


def _timed(what: str, trip: int, world: _Stopwatch, fault_ns: int, counted: bool) -> Recovery:
    asked_ns, back_ns = world.asked_ns or 0, world.back_ns or 0
    assert world.uplink is not None
    meter = world.uplink.meter
    greeting = 60 if counted else 0
    control = meter.control_bytes - greeting + world.control_bytes if counted else None
    return Recovery(
        what, trip, (asked_ns - fault_ns) / SAMPLE_NS, (back_ns - asked_ns) / SAMPLE_NS, control
    )


def _plan(line: Impairments) -> Plan:
    flight_terms = terms(lead_ticks=3 + 2 * line.delay_ns // TICK_NS)
    return Plan(0, THREE_SIGNS, flight_terms, line, line, LineFaults(), (), (), (), (), 0.1)
