"""Bytes in, bytes out: the receiver without time and transport."""

from __future__ import annotations

import pytest

from channel.errors import ConfigMismatch
from channel.line.line import Downlink
from channel.links.serial.wire import SerialWire
from channel.protocol import wire
from channel.protocol.frames import Commands, Hello, Symbol, Welcome
from receiver.endpoint import ReceiverEndpoint, SteppedEndpoint
from receiver.session.session import ReceiverSession
from tests.channel.codec.parts import ConstantController, identity_of, pitch_codec, terms

MS = 1_000_000
CODEC = pitch_codec()


def endpoint() -> ReceiverEndpoint:
    identity = identity_of(CODEC)
    return ReceiverEndpoint(ReceiverSession(CODEC, terms(), ConstantController(1.0, 1.0), identity, 77))


def greeted() -> ReceiverEndpoint:
    end = endpoint()
    identity = end.session.identity
    hello = Hello(5, identity.version, identity.config_digest, identity.numerics_probe)
    (answer,) = end.take(wire.encode(hello), 0)
    assert isinstance(wire.decode(answer), Welcome)
    return end


def test_when_bytes_are_garbage_then_they_are_counted_and_nothing_is_answered() -> None:
    end = endpoint()
    assert end.take(b"garbage", 0) == []
    assert end.inlet.malformed == end.session.counts["malformed"] == 1
    assert end.inlet.meter.wire_bytes == 7


def test_when_messages_pass_then_wire_bytes_of_both_ways_are_counted() -> None:
    end = greeted()
    data = wire.encode(Symbol(77, 0, 0, 1))
    up, down = end.inlet.meter.wire_bytes, end.downlink.meter.wire_bytes
    (answer,) = end.take(data, 0)
    assert end.inlet.meter.wire_bytes - up == len(data)
    assert end.downlink.meter.wire_bytes - down == len(answer)


def test_when_a_symbol_comes_exactly_at_its_deadline_then_it_is_in_time() -> None:
    end = greeted()
    end.step(0, wire.encode(Symbol(77, 0, 0, 1)))
    reply = end.step(120 * MS, wire.encode(Symbol(77, 0, 1, 1)))
    assert end.session.counts["erasures"] == 0
    assert reply.deadline_ns == 240 * MS
    assert [type(wire.decode(frame)) for frame in reply.frames] == [Commands]


def test_when_a_step_has_no_message_then_deadlines_pass() -> None:
    end = greeted()
    end.step(0, wire.encode(Symbol(77, 0, 0, 1)))
    reply = end.step(120 * MS, None)
    assert end.session.counts["erasures"] == 1
    assert len(reply.frames) == 1
    assert reply.deadline_ns == 220 * MS


def test_a_stepped_receiver_tells_a_flight_on_the_other_clock_from_what_a_line_damaged() -> None:
    wire_of_line = SerialWire(2)
    session = ReceiverSession(CODEC, terms(), ConstantController(1.0, 1.0), identity_of(CODEC), 77)
    end = SteppedEndpoint(session, Downlink(wire_of_line))
    assert end.take(wire_of_line.encode(Symbol(77, 0, 0, 1)), 0) == []
    assert end.take(b"garbage", 0) == []
    identity = session.identity
    hello = Hello(5, identity.version, identity.config_digest, identity.numerics_probe)
    with pytest.raises(ConfigMismatch, match="give both the same --clock"):
        end.take(wire.encode(hello), 0)
