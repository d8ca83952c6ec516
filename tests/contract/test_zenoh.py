"""What only the Zenoh link has: names, endpoints, incarnations."""

from __future__ import annotations

import pytest

from channel.errors import LinkError
from channel.links.endpoints import free_endpoint
from channel.links.zenoh.link import ZenohLink
from tests.contract.test_links import PATIENCE_S, SILENCE_S, until


@pytest.mark.parametrize("name", ["", "a b", "a/*", "/a", "a/", "a//b", "a$b", "**", "a?b", "a#b", "é"])
def test_when_a_session_name_is_no_key_then_it_is_refused(name: str) -> None:
    with pytest.raises(LinkError, match="session name"):
        ZenohLink("receiver", name, listen=(free_endpoint(),))


def test_when_no_endpoint_is_given_then_it_is_refused() -> None:
    with pytest.raises(LinkError, match="endpoint"):
        ZenohLink("receiver", "test")


@pytest.mark.parametrize("endpoint", ["tcp/0.0.0.0:0", "tcp/192.0.2.1:7447"])
def test_when_an_endpoint_leaves_this_machine_then_it_is_refused_unless_insecure(endpoint: str) -> None:
    with pytest.raises(LinkError, match="--insecure"):
        ZenohLink("receiver", "test", listen=(endpoint,))
    with pytest.raises(LinkError, match="--insecure"):
        ZenohLink("receiver", "test", connect=(endpoint,))


def test_when_the_protocol_is_unknown_then_it_is_a_link_error() -> None:
    with pytest.raises(LinkError):
        ZenohLink("receiver", "test", listen=("carrier-pigeon/127.0.0.1:1",))


def test_when_the_address_is_taken_then_it_is_a_link_error_that_names_it() -> None:
    endpoint = free_endpoint()
    with ZenohLink("receiver", "test", listen=(endpoint,)), pytest.raises(LinkError) as caught:
        ZenohLink("receiver", "test", listen=(endpoint,)).close()
    assert endpoint in str(caught.value)


def test_when_two_sessions_share_a_line_then_they_do_not_hear_each_other() -> None:
    endpoint = free_endpoint()
    with (
        ZenohLink("receiver", "one", listen=(endpoint,)) as receiver,
        ZenohLink("transmitter", "one", connect=(endpoint,)) as transmitter,
        ZenohLink("transmitter", "other", connect=(endpoint,)) as stranger,
    ):
        assert until(receiver.peer_present)
        assert until(transmitter.peer_present)
        stranger.send(b"not for you")
        transmitter.send(b"for you")
        assert receiver.receive(PATIENCE_S) == b"for you"
        assert receiver.receive(SILENCE_S) is None
        assert not stranger.peer_present()


def test_when_the_connecting_end_starts_first_then_the_ends_still_meet() -> None:
    endpoint = free_endpoint()
    with (
        ZenohLink("transmitter", "test", connect=(endpoint,)) as transmitter,
        ZenohLink("receiver", "test", listen=(endpoint,)) as receiver,
    ):
        assert until(transmitter.peer_present)
        assert until(receiver.peer_present)


def test_when_the_peer_restarts_then_it_is_seen_again() -> None:
    endpoint = free_endpoint()
    with ZenohLink("receiver", "test", listen=(endpoint,)) as receiver:
        for _ in range(2):
            with ZenohLink("transmitter", "test", connect=(endpoint,)):
                assert until(receiver.peer_present)
            assert until(lambda: not receiver.peer_present())
