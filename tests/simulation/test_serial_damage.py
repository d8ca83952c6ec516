"""Flights whose serial line changes one byte in a hundred: never a silent divergence."""

from __future__ import annotations

from typing import Any

import pytest

from channel.links.serial.wire import SerialWire
from tenbaud import MemoryFlight
from tests.channel.codec.parts import THREE_SIGNS
from tests.simulation.flight import pitch_flight
from tests.simulation.serial_lines import StreamLine

DAMAGE = 0.01
WIRE = SerialWire(2)


def damaged_flight(seed: int, damage_down: float, **changes: Any) -> tuple[MemoryFlight, StreamLine]:
    up = StreamLine(WIRE, DAMAGE, 2 * seed, upward=True)
    down = StreamLine(WIRE, damage_down, 2 * seed + 1, upward=False)
    flight = pitch_flight(
        THREE_SIGNS, mismatch=0.1, uplink_line=up, downlink_line=down, wire=WIRE, **changes
    )
    return flight, up


def fly_on(flight: MemoryFlight, samples: int) -> int:
    """Fly the given number of samples or to the end of the session; return how many were confirmed."""
    flight.fly(samples * flight.terms.sample_ns / 1e9)
    return flight.transmitter.confirmed_state.sample


def assert_nothing_silent(flight: MemoryFlight) -> None:
    """Every digest that was confirmed is the receiver's own of that sample, or was reported."""
    received = flight.receiver_rows.topic("sample")
    theirs = {row["sample"]: row["digest"] for row in received}
    assert len(theirs) == len(received)
    assert len(flight.transmitter_rows.topic("sample")) == flight.transmitter.counts["digest_checks"]
    differing = [
        row for row in flight.transmitter_rows.topic("sample") if row["digest"] != theirs[row["sample"]]
    ]
    assert len(differing) <= flight.transmitter.counts["desyncs"]
    # A frame that was damaged unseen may also show a difference where there is none.
    assert flight.transmitter.counts["rejoins"] >= flight.transmitter.counts["desyncs"]


def uplink_damage(samples: int) -> None:
    flight, up = damaged_flight(
        seed=1, damage_down=0.0, ticks_per_sample=2, deadline_allowance_ns=5_000_000
    )
    assert fly_on(flight, samples) == samples
    assert_nothing_silent(flight)
    assert flight.transmitter.confirmed_state == flight.receiver.state
    # The damage was there and hurt: bytes refused, symbols taken for others, slots erased.
    assert up.bytes_damaged > 0.008 * samples
    assert up.symbols_changed > 0
    assert up.dropped["check bits"] > 0
    assert 0.005 * samples < flight.receiver.counts["erasures"] < 0.03 * samples
    # Yet as many symbols flew, at one byte each, as there were samples.
    assert flight.node.session.next_sample == samples


def damage_both_ways(samples: int) -> None:
    """Command frames are damaged so often that there are rejoins; flights of 500 samples each."""
    total = sessions = erased = 0
    while total < samples:
        flight, _ = damaged_flight(
            seed=sessions,
            damage_down=DAMAGE,
            ticks_per_sample=2,
            deadline_allowance_ns=5_000_000,
            repeats=4,
        )
        total += fly_on(flight, 500)
        assert_nothing_silent(flight)
        erased += flight.transmitter.counts["erasures"]
        sessions += 1
    assert sessions > 1
    assert 0 < erased < 0.1 * total


def test_when_symbol_bytes_are_damaged_then_the_copies_stay_in_lockstep() -> None:
    uplink_damage(2_500)


def test_when_both_directions_are_damaged_then_no_divergence_is_silent() -> None:
    damage_both_ways(1_000)


@pytest.mark.soak
def test_when_a_hundred_thousand_symbols_fly_with_damage_then_the_copies_stay_in_lockstep() -> None:
    uplink_damage(100_000)


@pytest.mark.soak
def test_when_a_hundred_thousand_symbols_fly_with_damage_both_ways_then_nothing_is_silent() -> None:
    damage_both_ways(100_000)


def test_when_nothing_is_damaged_then_the_serial_wire_changes_no_bit_of_the_flight() -> None:
    plain = pitch_flight(THREE_SIGNS, mismatch=0.1)
    plain_result = plain.fly(20.0)
    up = StreamLine(WIRE, 0.0, 0, upward=True)
    down = StreamLine(WIRE, 0.0, 1, upward=False)
    serial = pitch_flight(THREE_SIGNS, mismatch=0.1, uplink_line=up, downlink_line=down, wire=WIRE)
    serial_result = serial.fly(20.0)
    assert serial_result.digests == plain_result.digests
    assert not up.dropped
    assert not down.dropped
    # Hello, one byte per symbol, farewell.
    assert up.bytes_carried - 200 < 120
