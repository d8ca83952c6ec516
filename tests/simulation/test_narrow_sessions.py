"""Sessions with the narrow downlink: the same bits as without sessions, through faults and restarts."""

from __future__ import annotations

import math

import pytest

from channel.codec.downlink.layout import Layout
from channel.protocol.frames import DownSymbol
from channel.protocol.wire import encode
from receiver.controllers.pid import PAPER_GAINS, Pid
from receiver.controllers.references import Square
from receiver.session.narrow import NarrowCommander
from reproduction.bothways.lines import Faults
from tests.channel.codec.parts import TICK_S
from tests.simulation.narrow import coded, mirrored
from tests.simulation.narrow_sessions import Announced, TimedFlight, memory_flight, narrow_terms
from tests.simulation.test_narrow import DIRECTION, announced, pid

SAMPLES = 70
LOSSES = Faults(loss_up=0.01, loss_down=0.03)
SCHEMES = {
    "mirrored 1": (mirrored(Layout(1, 1, 8), 40), 40),
    "mirrored 2": (mirrored(Layout(2, 1, 4), 15), 15),
    "mirrored 4": (mirrored(Layout(4, 1, 4), 15), 15),
    "mirrored, lead": (mirrored(Layout(2, 1, 4), 15, lead_ticks=13), 15),
    "coded 1": (coded(Layout(1, 1, 2), DIRECTION), None),
    "coded 2": (coded(Layout(2), DIRECTION), None),
    "coded 4": (coded(Layout(4), DIRECTION, lead_ticks=10), None),
}
CLEAN = ("mirrored 2", "coded 2")
"""Flown over a clean line too; the others under make soak."""


def controller_of(queue: int | None) -> Announced | Pid:
    if queue is not None:
        return Announced()
    return Pid(PAPER_GAINS, Square(math.pi / 2, 25.0, TICK_S), TICK_S)


@pytest.mark.parametrize(
    ("name", "faults"),
    [
        pytest.param(
            name,
            faults,
            id=f"{name}-{line}",
            marks=() if line == "losses" or name in CLEAN else pytest.mark.soak,
        )
        for name in SCHEMES
        for line, faults in (("clean", Faults()), ("losses", LOSSES))
    ],
)
def test_when_sessions_fly_then_all_bits_are_those_of_the_flight_without(
    name: str, faults: Faults
) -> None:
    machine, queue = SCHEMES[name]
    flight_terms = narrow_terms(machine, is_mirrored=queue is not None)
    wanted = pid() if queue is None else announced(queue)
    twin = TimedFlight(machine, wanted, 3, faults, flight_terms.heard_ns)
    twin.fly(SAMPLES)
    flight = memory_flight(machine, controller_of(queue), 3, faults)
    result = flight.fly(SAMPLES * 0.1)
    assert result.ended_by == ""
    down, up = flight.receiver_rows, flight.transmitter_rows
    assert down.column("sample", "digest") == twin.digests
    assert down.column("tick", "command") == twin.commands
    assert up.column("tick", "applied") == twin.applied
    confirmed = [
        (row["sample"], row["word"], row["symbols"], row["doubt"], row["lag_samples"])
        for row in up.topic("confirmed")
    ]
    expected = [
        (one.sample, one.word, one.symbols, one.doubt, one.lag_samples) for one in twin.confirmed
    ]
    assert confirmed[: len(expected)] == expected
    assert len(expected) > 0
    commander = flight.receiver._commander
    assert isinstance(commander, NarrowCommander)
    assert machine.pack(commander.two_way_state) == machine.pack(twin.state)
    lost = sum(row["symbols"].count(None) for row in up.topic("down_symbols"))
    assert flight.transmitter.counts["down_erased"] == lost
    assert (lost > 0) is (faults is LOSSES)


def test_when_a_down_symbol_is_not_taken_then_it_is_not_measured() -> None:
    machine, queue = SCHEMES["mirrored 2"]
    flight = memory_flight(machine, controller_of(queue), 3)
    flight.fly(2.0)
    endpoint, session = flight.loop.endpoint, flight.transmitter
    came = session.counts["down_came"]
    assert came == endpoint.inlet.meter.symbols
    forged = DownSymbol(session.session_number, session.epoch, 2**32 - 1, 1)
    endpoint.take(encode(forged), 10_000_000_000)
    assert session.counts["down_came"] == came
    assert endpoint.down_baud.whole_baud == pytest.approx(20.0, rel=0.05)
