"""Both sessions at the mercy of hypothesis: it decides what arrives, when, how often, and who dies."""

from __future__ import annotations

from dataclasses import replace

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from channel.protocol.frames import Frame, Symbol
from channel.protocol.lockstep import HISTORY_SAMPLES
from receiver.session.session import Phase as ReceiverPhase
from receiver.session.session import ReceiverSession
from tenbaud import MemoryRecorder
from tests.channel.codec.parts import (
    THREE_SIGNS,
    TICK_NS,
    ConstantController,
    identity_of,
    pitch_codec,
    terms,
)
from transmitter.session.session import Phase, TransmitterSession

CODEC = pitch_codec(THREE_SIGNS)
TERMS = terms(lead_ticks=13)
IDENTITY = identity_of(CODEC)


class BothSessions(RuleBasedStateMachine):
    """Rules are what a line and an operator can do; invariants are what must hold all the same."""

    def __init__(self) -> None:
        super().__init__()
        self.started = 0
        self.tick = -1
        self.now_ns = 0
        self.up: list[Frame] = []
        self.down: list[Frame] = []
        self.decided: dict[tuple[int, int, int], str] = {}
        self.epochs: dict[int, int] = {}
        self.slots: set[tuple[int, int, int]] = set()
        self.recorder = MemoryRecorder()
        self.transmitter = TransmitterSession(CODEC, TERMS, IDENTITY, 5, self.recorder)
        self.start_receiver()
        self.up.append(self.transmitter.hello())

    def start_receiver(self) -> None:
        self.started += 1
        self.receiver_rows = MemoryRecorder()
        self.rows_seen = 0
        self.receiver = ReceiverSession(
            CODEC, TERMS, ConstantController(1.5, -0.5), IDENTITY, self.started, self.receiver_rows
        )

    # What happens

    @rule(
        ticks=st.integers(1, 25),
        angle=st.floats(-1.5, 1.5),
        skipped=st.sampled_from([0, 0, 0, 13, 700]),
    )
    def time_passes(self, ticks: int, angle: float, skipped: int) -> None:
        self.now_ns += skipped * TICK_NS
        if self.transmitter.phase is Phase.GREETING:
            self.up.append(self.transmitter.hello())
            return
        self.tick += skipped
        for _ in range(ticks):
            self.tick += 1
            self.now_ns += TICK_NS
            for frame in self.transmitter.on_measurement(self.tick, (angle,)):
                if isinstance(frame, Symbol):
                    key = (frame.session, frame.epoch, frame.slot)
                    assert key not in self.slots, "a slot was used twice"
                    self.slots.add(key)
                self.up.append(frame)
            self.transmitter.command(self.tick)

    @rule(back=st.integers(0, 40), keep=st.booleans(), flip=st.booleans())
    def something_arrives_up(self, back: int, keep: bool, flip: bool) -> None:
        frame = self._take(self.up, back, keep)
        if frame is None:
            return
        if flip and isinstance(frame, Symbol):
            frame = replace(frame, number=1 - frame.number)
        self.answered(self.receiver.on_frame(frame, self.now_ns))

    @rule(back=st.integers(0, 40), keep=st.booleans())
    def something_arrives_down(self, back: int, keep: bool) -> None:
        frame = self._take(self.down, back, keep)
        if frame is None:
            return
        before = len(self.recorder.column("sample", "sample"))
        self.up += self.transmitter.on_frame(frame)
        session = self.transmitter
        for row in self.recorder.topic("sample")[before:]:
            key = (session.session_number, session.epoch, row["sample"])
            assert row["digest"] == self.decided.get(key), "two states of one sample"

    @rule()
    def all_arrives(self) -> None:
        while self.up or self.down:
            if self.up:
                self.something_arrives_up(len(self.up), False, False)
            if self.down:
                self.something_arrives_down(len(self.down), False)

    @rule(lost=st.integers(1, 40), upward=st.booleans())
    def frames_are_lost(self, lost: int, upward: bool) -> None:
        del (self.up if upward else self.down)[:lost]

    @rule()
    def deadlines_pass(self) -> None:
        self.answered(self.receiver.on_deadline(self.now_ns))

    @rule()
    def the_receiver_is_started_again(self) -> None:
        if self.started < 6:
            self.start_receiver()

    def _take(self, frames: list[Frame], back: int, keep: bool) -> Frame | None:
        if not frames:
            return None
        index = max(0, len(frames) - 1 - back)
        return frames[index] if keep else frames.pop(index)

    def answered(self, frames: list[Frame]) -> None:
        session = self.receiver
        rows = self.receiver_rows.topic("sample")[self.rows_seen :]
        self.rows_seen += len(rows)
        for row in rows:
            key = (session.session_number, session.epoch, row["sample"])
            assert key not in self.decided, "one sample was decided twice"
            self.decided[key] = str(row["digest"])
        self.down += frames

    # What must hold

    @invariant()
    def nothing_differs(self) -> None:
        assert self.transmitter.counts["desyncs"] == 0
        assert self.receiver.counts["desyncs"] == 0

    @invariant()
    def epochs_only_rise(self) -> None:
        session = self.transmitter.session_number
        assert self.transmitter.epoch >= self.epochs.get(session, 0)
        self.epochs[session] = self.transmitter.epoch

    @invariant()
    def history_is_bounded(self) -> None:
        assert self.transmitter.lag_samples <= HISTORY_SAMPLES + 1

    @invariant()
    def nobody_ends(self) -> None:
        assert self.transmitter.phase is not Phase.ENDED
        assert self.receiver.phase is not ReceiverPhase.ENDED

    def teardown(self) -> None:
        """Once the line behaves, they are together again, whatever came before."""
        for _ in range(80):
            self.time_passes(10, 0.3, 0)
            self.all_arrives()
        assert self.transmitter.phase is Phase.FLYING
        assert self.receiver.session_number == self.transmitter.session_number
        assert self.receiver.epoch == self.transmitter.epoch
        assert self.transmitter.lag_samples <= 1


TestBothSessions = BothSessions.TestCase
TestBothSessions.settings = settings(
    max_examples=40,
    stateful_step_count=40,
    deadline=None,
    derandomize=True,
    suppress_health_check=list(HealthCheck),
)
