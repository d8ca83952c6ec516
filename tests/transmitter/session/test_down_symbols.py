"""A transmitter that follows down symbols: what it drops, when it commands, how it starts again."""

from __future__ import annotations

from dataclasses import replace
from statistics import median

import pytest

from channel.codec.codec import Vector
from channel.codec.downlink.layout import Layout
from channel.protocol.endings import Ending
from channel.protocol.events import ASKED
from channel.protocol.frames import Bye, Commands, DownSymbol, Echo, Frame, Hello, Symbol, Welcome, Why
from channel.protocol.sabotage import SabotagedCodec, parse_sabotage
from receiver.session.narrow import NarrowCommander
from receiver.session.session import ReceiverSession
from tenbaud import MemoryRecorder
from tenbaud.sentences.events import event_text
from tests.channel.codec.parts import TICK_NS, identity_of
from tests.events import event_fields
from tests.simulation.narrow import mirrored, tuned_codec
from tests.simulation.narrow_sessions import Announced, memory_flight, narrow_terms
from transmitter.session.down_symbols import (
    AGE_FACTOR,
    AGE_LEAST_SAMPLES,
    SILENT_SLOTS,
    NarrowFollowing,
)
from transmitter.session.owing import PAUSES_MAX
from transmitter.session.session import Phase, TransmitterSession

MACHINE = mirrored(Layout(2, 1, 4), 15)
TERMS = narrow_terms(MACHINE, is_mirrored=True)
PER_SAMPLE = TERMS.ticks_per_sample


class Pair:
    """Both sessions; what the receiver sends comes down at once, unless `drops` it."""

    def __init__(self, *, stop_on_desync: bool = False) -> None:
        identity = identity_of(MACHINE.codec)
        self.rows = MemoryRecorder()
        self.transmitter = TransmitterSession(
            MACHINE.codec, TERMS, identity, 5, self.rows, two_way=MACHINE, stop_on_desync=stop_on_desync
        )
        self.receiver = ReceiverSession(MACHINE.codec, TERMS, Announced(), identity, 9, two_way=MACHINE)
        self.tick = -1
        self.commands: list[Vector | None] = []
        self.up: list[Frame] = []
        self.down: list[Frame] = []
        self.drops = False
        self._pass([self.transmitter.hello()])

    def fly(self, samples: int) -> None:
        for _ in range(samples * PER_SAMPLE):
            self.tick += 1
            self._pass(self.transmitter.on_measurement(self.tick, (0.2,)))
            self.commands.append(self.transmitter.command(self.tick))

    def _pass(self, frames: list[Frame]) -> None:
        for frame in frames:
            self.up.append(frame)
            for answer in self.receiver.on_frame(frame, max(0, self.tick) * TICK_NS):
                self.down.append(answer)
                if not self.drops:
                    self._pass(self.transmitter.on_frame(answer))

    @property
    def following(self) -> NarrowFollowing:
        assert isinstance(self.transmitter.following, NarrowFollowing)
        return self.transmitter.following

    @property
    def commander(self) -> NarrowCommander:
        assert isinstance(self.receiver._commander, NarrowCommander)
        return self.receiver._commander


def test_when_symbols_are_foreign_or_impossible_then_they_are_dropped_and_counted() -> None:
    pair = Pair()
    pair.fly(10)
    session = pair.transmitter
    last = pair.down[-1]
    assert isinstance(last, DownSymbol)
    heard = pair.following.hypotheses.next_heard
    echo = Echo(10, 0, 0, (0, 0) * 10)
    for stale in (replace(last, session=8), replace(last, epoch=1), Commands(9, 0, (echo,))):
        assert session.on_frame(stale) == []
    assert session.counts["stale_frames"] == 3
    reach = 2 * (10 + 2 * TERMS.history_samples)
    for bad in (replace(last, number=2), replace(last, slot=reach + 2), replace(last, slot=2**32 - 1)):
        assert session.on_frame(bad) == []
    assert session.counts["out_of_bounds"] == 3
    assert session.on_frame(last) == []
    assert (session.counts["stale_frames"], session.counts["down_late"]) == (4, 0)
    ahead = replace(last, slot=2 * heard)
    session.on_frame(ahead)
    session.on_frame(replace(ahead, number=1 - ahead.number))
    assert session.counts["stale_frames"] == 5
    assert session.counts["down_came"] == len(pair.down)  # without the welcome, and with `ahead`
    assert pair.following.hypotheses.next_heard == heard


def test_when_nothing_is_confirmed_any_more_then_commands_stop_after_four_usual_delays() -> None:
    pair = Pair()
    pair.fly(50)
    assert None not in pair.commands[PER_SAMPLE:]
    pair.following.take_confirmed()
    sure = pair.following.hypotheses.next_confirmed
    usual = median(pair.rows.column("confirmed", "lag_samples"))
    assert pair.following._age_max == max(AGE_LEAST_SAMPLES, round(AGE_FACTOR * usual))
    # Sooner than usual, or what is not followed would outweigh the list before.
    pair.following._age_max = 20
    pair.following._silent_ticks_max = 1000
    pair.drops = True
    pair.fly(15)
    commands = pair.commands[PER_SAMPLE:]
    missing = [tick // PER_SAMPLE + 1 for tick, command in enumerate(commands) if command is None]
    assert missing[0] - sure == 20 + 1
    assert pair.transmitter.phase is Phase.FLYING
    assert pair.transmitter.counts["down_erased"] > 20
    pair.fly(30)
    assert pair.transmitter.rejoins_asked == {Why.REST: 1}


def test_when_no_symbol_comes_any_more_then_commands_stop_after_twelve_slots() -> None:
    pair = Pair()
    pair.fly(50)
    pair.drops = True
    pair.fly(15)
    missing = [
        tick for tick, command in enumerate(pair.commands) if command is None and tick > PER_SAMPLE
    ]
    silent_ns = SILENT_SLOTS * TERMS.sample_ns // 2 + TERMS.heard_ns
    # The last symbols came at the first tick of sample 49.
    assert missing[0] == 49 * PER_SAMPLE + -(-silent_ns // TICK_NS) + 1


def test_when_no_symbol_has_come_in_a_flight_then_nothing_is_commanded() -> None:
    pair = Pair()
    pair.drops = True
    pair.fly(40)
    assert set(pair.commands) == {None}


def test_when_it_rejoins_then_both_stand_in_the_same_state_and_no_command_is_given_before() -> None:
    pair = Pair()
    pair.fly(30)
    asked = pair.transmitter.rejoin(Why.GUARD)
    assert pair.transmitter.command(pair.tick) is None
    pair._pass(asked)
    welcome = pair.down[-1]
    assert isinstance(welcome, Welcome)
    assert welcome.hold_steps == ()
    assert MACHINE.unpack(welcome.state) == pair.commander.two_way_state
    pair.fly(1)
    assert pair.following.hypotheses.confirmed_state.codec.sample == 30
    assert pair.commander.two_way_state.sample == 31
    pair.fly(30)
    assert pair.following.hypotheses.next_confirmed > 45
    assert (pair.transmitter.phase, pair.transmitter.counts["rejoins"]) == (Phase.FLYING, 1)
    assert [row["sample"] for row in pair.rows.topic("two_way")] == [0, 30]


@pytest.mark.parametrize("what", ["short", "of another sample", "command"])
def test_when_a_welcome_has_no_state_of_the_machine_then_it_is_dropped(what: str) -> None:
    pair = Pair()
    pair.fly(20)
    pair.drops = True
    hello = pair.transmitter.rejoin(Why.GUARD)[-1]
    assert isinstance(hello, Hello)
    pair._pass([hello])
    welcome = pair.down[-1]
    assert isinstance(welcome, Welcome)
    state = MACHINE.unpack(welcome.state)
    data = {
        "short": MACHINE.codec.pack(state.codec),
        "of another sample": MACHINE.pack(state._replace(codec=state.codec._replace(sample=19))),
        "command": MACHINE.pack(state._replace(hold=(5.1, 0.0))),
    }[what]
    pair.transmitter.on_frame(replace(welcome, state=data))
    assert pair.transmitter.phase is Phase.REJOINING
    assert pair.transmitter.counts["out_of_bounds"] == 1
    pair.transmitter.on_frame(welcome)
    assert pair.transmitter.phase is Phase.FLYING


def test_when_no_epoch_brings_a_confirmation_then_there_are_no_commands_before_the_first() -> None:
    pair = Pair()
    for _ in range(PAUSES_MAX - 1):
        pair._pass(pair.transmitter.rejoin(Why.LAG))
        pair.fly(2)
        assert pair.commands[-1] is not None
    pair._pass(pair.transmitter.rejoin(Why.LAG))
    begun = len(pair.commands)
    pair.fly(30)
    first = next(tick for tick in range(begun, len(pair.commands)) if pair.commands[tick] is not None)
    assert 3 * PER_SAMPLE < first - begun < 20 * PER_SAMPLE
    assert None not in pair.commands[first:]


@pytest.mark.parametrize("end", ["transmitter", "receiver"])
def test_when_either_codec_is_wrong_in_its_last_bit_then_a_new_epoch_brings_them_together(
    end: str,
) -> None:
    right = tuned_codec()
    wrong = SabotagedCodec(right, parse_sabotage("sample=47,field=angle"))
    machine = mirrored(Layout(2, 1, 4), 15)
    machine.codec = wrong if end == "transmitter" else right
    other = wrong if end == "receiver" else right
    flight = memory_flight(machine, Announced(), 1, receiver_codec=other)
    flight.fly(10.0)
    assert flight.transmitter.rejoins_asked == {Why.REST: 1}
    asked = next(event for event in flight.transmitter.events if event.cause is Why.REST)
    assert 4.8 < asked.time_ns / 1e9 < 4.8 + 2.0
    rows = flight.transmitter_rows, flight.receiver_rows
    ours, theirs = ({row["sample"]: row["digest"] for row in one.topic("sample")} for one in rows)
    assert [sample for sample in ours if ours[sample] != theirs[sample]] == []
    assert max(ours) > 85


def receiver_beside(number: int, *, take_over: bool) -> ReceiverSession:
    identity = identity_of(MACHINE.codec)
    return ReceiverSession(
        MACHINE.codec, TERMS, Announced(), identity, number, take_over=take_over, two_way=MACHINE
    )


def test_when_another_receiver_takes_over_then_the_flight_goes_on_with_its_state() -> None:
    pair = Pair()
    pair.fly(20)
    other = receiver_beside(77, take_over=True)
    symbol = next(frame for frame in reversed(pair.up) if isinstance(frame, Symbol))
    (claim,) = other.on_frame(symbol, pair.tick * TICK_NS)
    (hello,) = pair.transmitter.on_frame(claim)
    (welcome,) = other.on_frame(hello, pair.tick * TICK_NS)
    assert pair.transmitter.on_frame(welcome) == [Bye(9, Ending.TAKEN_OVER)]
    pair.receiver = other
    pair.fly(40)
    assert (pair.transmitter.session_number, pair.transmitter.counts["take_overs"]) == (77, 1)
    assert pair.following.hypotheses.next_confirmed > 45
    assert pair.transmitter.rejoins_asked == {Why.TAKEN_OVER: 1}


def test_when_a_second_receiver_asks_while_down_symbols_come_then_it_is_refused() -> None:
    pair = Pair()
    pair.fly(20)
    other = receiver_beside(77, take_over=False)
    symbol = next(frame for frame in reversed(pair.up) if isinstance(frame, Symbol))
    (unknown,) = other.on_frame(symbol, pair.tick * TICK_NS)
    assert pair.transmitter.on_frame(unknown) == []
    pair.fly(2)
    assert pair.transmitter.on_frame(unknown) == [Bye(0, Ending.SECOND_RECEIVER)]
    assert pair.transmitter.session_number == 9


def test_when_a_flight_is_to_stop_at_a_difference_then_it_ends_with_it() -> None:
    wrong = SabotagedCodec(MACHINE.codec, parse_sabotage("sample=47,field=angle"))
    flight = memory_flight(MACHINE, Announced(), 1, receiver_codec=wrong, stop_on_desync=True)
    result = flight.fly(20.0)
    assert flight.transmitter.end is not None
    assert flight.transmitter.end.ending is Ending.DESYNC
    assert 480 < result.ticks < 700


@pytest.mark.parametrize("why", [why for why in Why if why is not Why.START])
def test_every_reason_for_a_new_epoch_has_a_sentence(why: Why) -> None:
    event = replace(ASKED, cause=why, sample=3, session=9, epoch=2, number=70, value=1.5)
    text = event_text(event_fields(event))
    assert text.endswith("requesting a new epoch after 2")
    assert "=" not in text
