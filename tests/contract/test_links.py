"""What every link promises, asked of each of them in the same words.

A new kind of link joins by adding a function that makes a pair of ends to `MAKERS`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from channel.errors import LinkError
from channel.links.base import Link
from channel.links.endpoints import free_endpoint
from channel.protocol.frames import DownSymbol, ShortSymbol, Symbol
from tests.channel.links.memory_pair import memory_pair
from tests.contract.serial_pairs import make_serial, make_split

PATIENCE_S = 10.0
"""How long anything may take before a test fails; none of them waits that long when all is well."""
SILENCE_S = 0.05

Pair = tuple[Link, Link]
"""The transmitter's end and the receiver's."""


def make_memory(_: ExitStack) -> Pair:
    return memory_pair()


def make_zenoh(stack: ExitStack) -> Pair:
    from channel.links.zenoh.link import ZenohLink

    endpoint = free_endpoint()
    receiver = stack.enter_context(ZenohLink("receiver", "test/contract", listen=(endpoint,)))
    transmitter = stack.enter_context(ZenohLink("transmitter", "test/contract", connect=(endpoint,)))
    return transmitter, receiver


MAKERS: dict[str, Callable[[ExitStack], Pair]] = {
    "memory": make_memory,
    "zenoh": make_zenoh,
    "serial": make_serial,
    "split": make_split,
}


def until(condition: Callable[[], bool]) -> bool:
    """Return whether the condition came true within the patience."""
    give_up = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > give_up:
            return False
        time.sleep(0.005)
    return True


@pytest.fixture(params=MAKERS.keys())
def ends(request: pytest.FixtureRequest) -> Iterator[Pair]:
    with ExitStack() as stack:
        transmitter, receiver = MAKERS[request.param](stack)
        stack.callback(receiver.close)
        stack.callback(transmitter.close)
        assert until(transmitter.peer_present), "the transmitter's end never saw the receiver's"
        assert until(receiver.peer_present), "the receiver's end never saw the transmitter's"
        yield transmitter, receiver


@pytest.fixture(params=["up", "down"])
def way(request: pytest.FixtureRequest, ends: Pair) -> Pair:
    """The sending end and the receiving one, in either direction."""
    return ends if request.param == "up" else (ends[1], ends[0])


def received(end: Link, count: int) -> list[bytes]:
    messages = []
    for _ in range(count):
        message = end.receive(PATIENCE_S)
        assert message is not None, f"only {len(messages)} of {count} messages came"
        messages.append(message)
    return messages


def test_when_many_messages_are_sent_then_they_come_whole_and_in_order(way: Pair) -> None:
    sender, taker = way
    messages = [f"message {number}".encode() for number in range(1000)]
    for message in messages:
        sender.send(message)
    assert received(taker, len(messages)) == messages
    assert taker.receive(0.0) is None


@pytest.mark.parametrize("kind", [Symbol, DownSymbol])
def test_when_symbols_are_sent_in_their_slots_then_they_come_in_order(
    ends: Pair, kind: type[Symbol | DownSymbol]
) -> None:
    sender, taker = ends if kind is Symbol else (ends[1], ends[0])
    for number in range(100):
        symbol = sender.wire.encode(kind(1, 0, number, number % 2))
        assert sender.wire.is_symbol(symbol)
        assert isinstance(taker.wire.decode(symbol), (kind, ShortSymbol))
        sender.send(symbol)
        assert received(taker, 1) == [symbol]


@pytest.mark.parametrize(
    "data",
    [bytes(range(256)), bytes(256), b"\xff" * 256, b"\n\r\0\x7d\x7e\x11\x13", bytes(range(256)) * 16],
    ids=["all bytes", "zeros", "ones", "bytes that lines like to eat", "4 KiB"],
)
def test_when_any_bytes_are_sent_then_the_same_bytes_come(way: Pair, data: bytes) -> None:
    sender, taker = way
    sender.send(data)
    assert received(taker, 1) == [data]


def test_when_a_longest_frame_is_sent_then_it_comes_whole(way: Pair) -> None:
    sender, taker = way
    data = bytes(number * 7 % 256 for number in range(16_384))
    sender.send(data)
    assert received(taker, 1) == [data]


def test_when_a_message_is_empty_then_it_comes_or_is_refused(way: Pair) -> None:
    sender, taker = way
    try:
        sender.send(b"")
    except (LinkError, ValueError):
        pytest.skip("this link has no empty messages")
    sender.send(b"next")
    assert received(taker, 2) == [b"", b"next"]


@pytest.mark.parametrize("timeout_s", [0.0, SILENCE_S])
def test_when_nothing_comes_then_receiving_ends_with_none(way: Pair, timeout_s: float) -> None:
    assert way[1].receive(timeout_s) is None


def test_when_a_message_waits_then_it_is_there_without_waiting(way: Pair) -> None:
    sender, taker = way
    sender.send(b"one")
    assert until(lambda: taker.receive(0.0) == b"one")


def test_when_messages_go_both_ways_at_once_then_neither_end_hears_itself(ends: Pair) -> None:
    transmitter, receiver = ends
    for number in range(50):
        transmitter.send(b"up %d" % number)
        receiver.send(b"down %d" % number)
    assert received(receiver, 50) == [b"up %d" % number for number in range(50)]
    assert received(transmitter, 50) == [b"down %d" % number for number in range(50)]
    assert transmitter.receive(0.0) is None
    assert receiver.receive(0.0) is None


def test_when_messages_pass_then_both_ends_count_them(way: Pair) -> None:
    sender, taker = way
    for size in (1, 10, 100):
        sender.send(bytes(size))
    received(taker, 3)
    assert (sender.counts.messages_out, sender.counts.bytes_out) == (3, 111)
    assert (taker.counts.messages_in, taker.counts.bytes_in) == (3, 111)
    assert (sender.counts.messages_in, taker.counts.messages_out) == (0, 0)
    assert not sender.counts.dropped
    assert not taker.counts.dropped


def test_when_one_end_closes_then_the_other_sees_it_gone(way: Pair) -> None:
    leaving, staying = way
    leaving.close()
    assert until(lambda: not staying.peer_present())


def test_when_messages_were_sent_before_closing_then_they_still_come(way: Pair) -> None:
    sender, taker = way
    for number in range(20):
        sender.send(b"last words %d" % number)
    sender.close()
    assert received(taker, 20) == [b"last words %d" % number for number in range(20)]


def test_when_an_end_is_closed_twice_then_nothing_happens(ends: Pair) -> None:
    for end in ends:
        end.close()
        end.close()


def test_when_the_peer_has_closed_then_sending_neither_raises_nor_hangs(way: Pair) -> None:
    leaving, staying = way
    leaving.close()
    staying.send(b"into the void, perhaps before it is known to be one")
    assert until(lambda: not staying.peer_present())
    for _ in range(10):
        staying.send(b"into the void")
    assert staying.receive(SILENCE_S) is None


def test_when_this_end_is_closed_then_sending_is_a_link_error(ends: Pair) -> None:
    for end in ends:
        end.close()
        with pytest.raises(LinkError):
            end.send(b"x")


def test_when_used_with_with_then_the_end_is_closed_afterwards(way: Pair) -> None:
    leaving, staying = way
    with leaving as same:
        assert same is leaving
    assert until(lambda: not staying.peer_present())


def test_when_links_are_summed_up_then_they_have_a_name(ends: Pair) -> None:
    assert ends[0].name == ends[1].name != ""
