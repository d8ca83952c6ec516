"""What must hold in every flight of the simulator, checked from outside the two ends.

Safety, at every step: no sample with two different confirmed states without a raised event; voltages
within limits; no more symbols than the line's rate; no command but those of the present session and
epoch. Liveness, once the faults have stopped: locked again, and the error back under its bound.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from channel.codec.codec import Codec, Vector
from channel.protocol.recording import RecordChannel
from channel.protocol.terms import Terms
from transmitter.guard import GuardState
from transmitter.session.session import Phase

if TYPE_CHECKING:
    from receiver.session.session import ReceiverSession
    from tests.simulation.world import World
    from transmitter.endpoint import TransmitterNode

ERROR_BOUND_RAD = 0.5
"""After the quiet phase; the plant may be 20 % off the model."""

SLACK_NS = 2_000_000


class SafetyViolation(AssertionError):
    """Something happened that must never happen."""


class LivenessViolation(AssertionError):
    """Something did not happen in time."""


class ReceiverTap:
    """Sees what a receiver decides, as it decides it."""

    def __init__(self, watch: Watch, number: int) -> None:
        self.watch = watch
        self.number = number
        self.session: ReceiverSession | None = None

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[Any]) -> None:
        if self.session is None:
            return
        key = (self.number, self.session.epoch)
        if channel.topic == "sample":
            self.watch.decided_digests[(*key, row[0])] = int(row[5], 16)
        elif channel.topic == "tick":
            self.watch.decided_commands[(*key, row[0])] = row[3]


class TransmitterTap:
    """Sees what a transmitter confirms."""

    def __init__(self, watch: Watch) -> None:
        self.watch = watch

    def write(self, channel: RecordChannel, time_ns: int, row: Sequence[Any]) -> None:
        if channel.topic == "sample":
            self.watch.confirmed.append((row[0], int(row[6], 16)))


class Watch:
    """Collects the ground truth and compares."""

    def __init__(self, codec: Codec, terms: Terms) -> None:
        self.codec = codec
        self.terms = terms
        self.decided_digests: dict[tuple[int, int, int], int] = {}
        self.decided_commands: dict[tuple[int, int, int], Vector] = {}
        self.confirmed: list[tuple[int, int]] = []
        self.node: TransmitterNode | None = None
        self.samples = 0
        self.desyncs_raised = 0
        self.desyncs_missed = 0
        self.rejoins = 0
        self.rejoins_calm = 0
        """since the faults stopped"""
        self.last_rejoin_ns = 0
        """how long after the faults stopped"""
        self._rejoins_at_calm: int | None = None
        self._desyncs_seen = 0
        self._rejoins_seen = 0
        self._sent_ns: deque[int] = deque(maxlen=2)
        self.unseen: set[int] = set()
        """samples in which a difference may vanish before any hash bit shows it"""
        self._holds: dict[tuple[int, int], Vector] = {}

    def receiver_started(self, number: int) -> ReceiverTap:
        return ReceiverTap(self, number)

    def transmitter_started(self) -> TransmitterTap:
        self._desyncs_seen = 0
        self._rejoins_seen = 0
        self.confirmed.clear()
        return TransmitterTap(self)

    # Safety

    def on_volts(self, volts: Vector) -> None:
        limits = self.terms.limits.command_max
        if not all(abs(value) <= limit for value, limit in zip(volts, limits, strict=True)):
            raise SafetyViolation(f"voltages {volts} beyond {limits} V")

    def on_symbol_sent(self, now_ns: int) -> None:
        self._sent_ns.append(now_ns)
        if len(self._sent_ns) == 2:
            apart_ns = self._sent_ns[1] - self._sent_ns[0]
            if apart_ns < self.terms.slot_ns(1) - SLACK_NS:
                raise SafetyViolation(f"two symbols only {apart_ns / 1e6:g} ms apart")

    def on_delivered(self, node: TransmitterNode) -> None:
        """Compare what was just confirmed with what the receiver really decided."""
        session = node.session
        raised = session.counts["desyncs"] > self._desyncs_seen
        self.desyncs_raised += session.counts["desyncs"] - self._desyncs_seen
        self._desyncs_seen = session.counts["desyncs"]
        self.rejoins += session.counts["rejoins"] - self._rejoins_seen
        self._rejoins_seen = session.counts["rejoins"]
        for sample, digest in self.confirmed:
            self.samples += 1
            key = (session.session_number, session.epoch, sample)
            truth = self.decided_digests.get(key)
            if truth != digest and not raised and sample not in self.unseen:
                self.desyncs_missed += 1
                raise SafetyViolation(
                    f"sample {sample} of epoch {session.epoch}: the transmitter holds "
                    f"{digest:016x}, the receiver {truth and f'{truth:016x}'}, and nobody said so"
                )
        self.confirmed.clear()

    def on_tick(self, tick: int, node: TransmitterNode) -> None:
        """Check that a motor is moved by nothing but the present epoch's commands."""
        session = node.session
        if node.guard.state is not GuardState.RUNNING:
            return
        command = session.command(tick)
        if command is None or tick < session.epoch_tick:
            return
        if self.terms.downlink == "narrow":
            # It is the mean of what the hypotheses command; what is confirmed is compared elsewhere.
            return
        key = (session.session_number, session.epoch)
        decided = self.decided_commands.get((*key, tick))
        is_hold = tick < session.epoch_tick + self.terms.lead_ticks
        if decided != command and not is_hold:
            raise SafetyViolation(
                f"tick {tick}: command {command}, but epoch {session.epoch} decided {decided}"
            )

    # Liveness

    def on_calm_tick(self, world: World) -> None:
        """Count the rejoins that come after the last fault."""
        if self._rejoins_at_calm is None:
            self._rejoins_at_calm = self.rejoins
        calm = self.rejoins - self._rejoins_at_calm
        if calm > self.rejoins_calm:
            self.rejoins_calm = calm
            self.last_rejoin_ns = world.now_ns - world.calm_ns

    def check_recovery(self, world: World) -> None:
        """Raise unless lockstep came back in time, and with a few rejoins."""
        bound_ns = world.recovery_ns_max
        recovered_ns = world.recovered_ns
        if recovered_ns is None or recovered_ns > bound_ns:
            raise LivenessViolation(
                f"lockstep came back {recovered_ns and recovered_ns / 1e9} s after the last fault; at "
                f"most {bound_ns / 1e9:g} s are allowed"
            )
        if self.rejoins_calm > world.calm_rejoins_max or self.last_rejoin_ns > bound_ns:
            raise LivenessViolation(
                f"{self.rejoins_calm} rejoins after the last fault, the last one "
                f"{self.last_rejoin_ns / 1e9:g} s after it"
            )

    def is_locked(self, world: World) -> bool:
        """Return whether both ends fly the same epoch and echoes come as fast as the line allows."""
        if world.node is None or world.endpoint is None:
            return False
        session, other = world.node.session, world.endpoint.session
        trip_ns = world.plan.round_trip_ns
        if self.terms.downlink == "narrow":
            trip_ns += self.terms.heard_ns
        trip = -(-trip_ns // self.terms.sample_ns)
        together = (session.session_number, session.epoch) == (other.session_number, other.epoch)
        flown = session.confirmed_state.sample * self.terms.ticks_per_sample > session.epoch_tick
        return (
            session.phase is Phase.FLYING
            and together
            and flown
            and not world.node.guard.stopped
            and session.lag_samples <= trip + 2
        )

    def check_locked(self, world: World) -> None:
        if not self.is_locked(world):
            node, endpoint = world.node, world.endpoint
            raise LivenessViolation(
                f"not locked at the end: {node and node.session.phase}, "
                f"{endpoint and endpoint.session.phase}, guard {node and node.guard.state}, lag "
                f"{node and node.session.lag_samples}; last events "
                f"{node and list(node.session.events)[-3:]}"
            )
        self.check_recovery(world)
        if world.plan.is_slow:
            return
        assert world.node is not None
        error = world.node.scores.first.last_coded_error
        if error is None or abs(error) > ERROR_BOUND_RAD:
            raise LivenessViolation(f"the error is {error} rad, not below {ERROR_BOUND_RAD}")
