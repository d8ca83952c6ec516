"""Rig, session, guard and scores joined for one tick at a time."""

from __future__ import annotations

import itertools

import pytest

from channel.codec.codec import Vector
from channel.protocol.endings import End, Ending
from channel.protocol.events import EventKind
from channel.protocol.frames import Commands, Echo, Welcome
from tenbaud import MemoryRecorder
from tenbaud.sentences.events import event_text, guard_text
from tests.channel.codec.parts import identity_of, pitch_codec, terms
from tests.events import event_fields
from transmitter.endpoint import TransmitterNode
from transmitter.guard import Guard, GuardCause, GuardReason, GuardSettings, GuardState
from transmitter.metrics.scores import Scores
from transmitter.rigs.base import Reading, Rig
from transmitter.session.session import Phase, TransmitterSession

CODEC = pitch_codec()
TICKS = 200


class ScriptedRig(Rig):
    """Returns given readings, and notes the voltages."""

    def __init__(
        self, faulty_tick: int | None = None, angle_rad: float = 0.1, ticks: int = TICKS
    ) -> None:
        self._faulty_tick = faulty_tick
        self._angle_rad = angle_rad
        self._ticks = ticks
        self.written: list[tuple[int, Vector]] = []

    def read(self, tick: int) -> Reading | None:
        if tick >= self._ticks:
            return None
        fault = "the cable is off" if tick == self._faulty_tick else None
        return Reading((tick,), (self._angle_rad,), fault=fault)

    def write(self, tick: int, volts: Vector) -> None:
        self.written.append((tick, volts))


def node_with(rig: ScriptedRig, recorder: MemoryRecorder | None = None) -> TransmitterNode:
    session = TransmitterSession(CODEC, terms(), identity_of(CODEC), 5, recorder)
    guard = Guard(session.terms.limits, GuardSettings(20, 10, (0.0, 0.0), (1.0,)))
    scores = Scores(CODEC.model, 0, 640, lambda _: ())
    node = TransmitterNode(session, rig, guard, scores, recorder)
    node.deliver(Welcome(77, 0, 0, 5))
    return node


def fly_sample(node: TransmitterNode, sample: int) -> int:
    """Fly ten ticks with an honest receiver; return the number of symbols that left."""
    sent = 0
    for tick in range(10 * sample, 10 * sample + 10):
        symbols = node.measure(tick)
        assert symbols is not None
        if symbols:
            word = ((-1, 1)[symbols[0].number],)
            state = CODEC.step(node.session.confirmed_state, word, [(2.0, -2.0)] * 10)
            echo = Echo(sample, symbols[0].number, CODEC.digest(state), (2000, -2000) * 10)
            node.deliver(Commands(77, 0, (echo,)))
        sent += len(symbols)
        node.actuate(tick)
    return sent


def test_when_commands_come_then_they_are_on_the_motors_at_their_ticks() -> None:
    rig = ScriptedRig()
    node = node_with(rig)
    assert [fly_sample(node, sample) for sample in range(5)] == [1] * 5
    assert rig.written == [(tick, (2.0, -2.0)) for tick in range(50)]
    assert node.commands_late == 0
    node.flush_records()
    assert node.scores.first.coded.count == node.scores.first.live.count == 50


def test_when_no_command_has_come_then_it_is_counted_as_late_and_the_last_one_is_held() -> None:
    rig = ScriptedRig()
    node = node_with(rig)
    fly_sample(node, 0)
    for tick in range(10, 20):
        node.measure(tick)
        assert node.actuate(tick) == (2.0, -2.0)
    assert node.commands_late == 10
    assert node.guard.state is GuardState.HOLDING


def test_when_the_guard_has_stopped_then_no_symbol_leaves_although_the_session_flies() -> None:
    node = node_with(ScriptedRig())
    fly_sample(node, 0)
    node.stop()
    for tick in range(10, 40):
        assert node.measure(tick) == []
        node.actuate(tick)
        assert node.session.phase is Phase.FLYING
    assert node.latched
    assert node.guard.command == (0.0, 0.0)
    assert node.session.next_sample == 1


def test_when_the_session_ends_then_the_voltage_is_taken_down_with_its_reason() -> None:
    rig = ScriptedRig()
    node = node_with(rig)
    fly_sample(node, 0)
    node.session.bye(End(Ending.OVER, "enough"))
    for tick in range(10, 20):
        node.measure(tick)
        node.actuate(tick)
    assert node.latched
    assert node.guard.reason == GuardReason(GuardCause.SESSION_ENDED, 10)
    assert rig.written[-1] == (19, (0.0, 0.0))
    fronts = [volts[0] for tick, volts in rig.written if tick >= 9]
    assert fronts == sorted(fronts, reverse=True)
    assert max(before - after for before, after in itertools.pairwise(fronts)) < 0.21


@pytest.mark.parametrize(
    ("rig", "text"),
    [
        (ScriptedRig(faulty_tick=25), "tick 25: the cable is off"),
        (ScriptedRig(angle_rad=1.5), "axis 0: 85.9 deg at tick 0"),
    ],
    ids=["fault", "soft limit"],
)
def test_when_the_sensor_or_the_angle_is_wrong_then_the_guard_trips_and_it_is_reported(
    rig: ScriptedRig, text: str
) -> None:
    recorder = MemoryRecorder()
    node = node_with(rig, recorder)
    for sample in range(5):
        fly_sample(node, sample)
    assert node.latched
    assert text in guard_text(node.guard.reason)
    told = [event for event in node.session.events if event.kind is EventKind.GUARD]
    assert [event.state for event in told] == [GuardState.RAMPING, GuardState.LATCHED]
    assert event_text(event_fields(told[0])).startswith("guard ramping: ")
    assert text in event_text(event_fields(told[0]))
    assert recorder.column("tick", "guard")[-1] == "latched"
    assert (node.sensor_fault is not None) == ("cable" in text)


def test_when_the_rig_has_no_more_then_measuring_says_so() -> None:
    node = node_with(ScriptedRig(ticks=1))
    assert node.measure(0) is not None
    assert node.measure(1) is None


def test_when_a_tick_is_actuated_before_it_was_measured_then_it_is_an_error() -> None:
    with pytest.raises(RuntimeError, match="before it was measured"):
        node_with(ScriptedRig()).actuate(0)


def test_when_a_row_is_recorded_then_commanded_and_applied_voltages_stand_side_by_side() -> None:
    recorder = MemoryRecorder()
    node = node_with(ScriptedRig(), recorder)
    fly_sample(node, 0)
    node.measure(10)
    node.actuate(10)
    rows = recorder.topic("tick")
    assert [row["tick"] for row in rows] == list(range(11))
    assert rows[3]["commanded"] == rows[3]["applied"] == (2.0, -2.0)
    assert rows[10]["commanded"] is None
    assert rows[10]["applied"] == (2.0, -2.0)
    assert [row["late"] for row in rows] == [False] * 10 + [True]
