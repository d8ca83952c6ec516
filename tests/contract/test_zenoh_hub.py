"""One end of many sessions: names, answers."""

from __future__ import annotations

import pytest

from channel.errors import LinkError
from channel.links.endpoints import free_endpoint
from channel.links.zenoh.hub import ZenohHub
from channel.links.zenoh.link import ZenohLink
from channel.protocol.frames import Symbol
from channel.protocol.wire import encode
from tests.contract.test_links import PATIENCE_S, SILENCE_S, until


@pytest.mark.parametrize(
    "pattern", ["", "rig/", "/rig", "rig//*", "rig/a*", "rig/***", "a b", "rig/$*"]
)
def test_when_a_pattern_is_no_key_then_it_is_refused(pattern: str) -> None:
    with pytest.raises(LinkError, match="sessions"):
        ZenohHub(pattern, listen=(free_endpoint(),))


SYMBOL = encode(Symbol(1, 0, 0, 1))


def test_when_an_endpoint_leaves_this_machine_then_it_is_refused_unless_insecure() -> None:
    with pytest.raises(LinkError, match="--insecure"):
        ZenohHub("rig/*", listen=("tcp/192.0.2.1:7447",))


def reach(hub: ZenohHub, *links: ZenohLink) -> bool:
    """Return whether the hub comes to hear each of these; what was sent for it is taken out again."""

    def is_heard(link: ZenohLink) -> bool:
        link.send(b"are you there?")
        return hub.receive(SILENCE_S) is not None

    heard = all(until(lambda link=link: is_heard(link)) for link in links)  # type: ignore[misc]
    while hub.receive(SILENCE_S) is not None:
        pass
    return heard


def test_when_two_transmitters_speak_then_each_is_heard_by_name_and_answered_alone() -> None:
    endpoint = free_endpoint()
    with (
        ZenohHub("rig/*", listen=(endpoint,)) as hub,
        ZenohLink("transmitter", "rig/1", connect=(endpoint,)) as one,
        ZenohLink("transmitter", "rig/2", connect=(endpoint,)) as two,
        ZenohLink("transmitter", "other/1", connect=(endpoint,)) as stranger,
    ):
        assert reach(hub, one, two)
        assert until(lambda: len(list(hub._session.info.transports())) == 3)
        stranger.send(b"not for you")
        one.send(SYMBOL)
        two.send(b"b")
        heard = {hub.receive(PATIENCE_S), hub.receive(PATIENCE_S)}
        assert heard == {("rig/1", SYMBOL), ("rig/2", b"b")}
        assert hub.receive(SILENCE_S) is None
        hub.join("rig/1")
        assert until(one.peer_present)
        assert not two.peer_present()
        hub.send("rig/1", b"joined")
        hub.send("rig/2", b"not joined")
        assert one.receive(PATIENCE_S) == b"joined"
        assert two.receive(PATIENCE_S) == b"not joined"
        hub.leave("rig/1")
        assert until(lambda: not one.peer_present())


def test_when_another_thread_rings_then_the_wait_ends() -> None:
    with ZenohHub("rig/*", listen=(free_endpoint(),)) as hub:
        hub.wake()
        # Without the ring this would outlast the test's own limit of time.
        assert hub.receive(10_000.0) is None
        assert hub.receive(0.0) is None


@pytest.mark.parametrize("name", ["rig/..", "../rig", "rig/a b", "rig/a\nb", "rig/\x1b[2J"])
def test_when_a_key_names_no_session_then_its_message_is_dropped_and_counted(name: str) -> None:
    endpoint = free_endpoint()
    with (
        ZenohHub("**", listen=(endpoint,)) as hub,
        ZenohLink("transmitter", "rig/1", connect=(endpoint,)) as one,
    ):
        assert reach(hub, one)
        one._session.put(f"tenbaud/{name}/up/control", b"let me in")
        one.send(b"a")
        heard = [hub.receive(PATIENCE_S), hub.receive(PATIENCE_S)]
        assert [item for item in heard if item is not None] == [("rig/1", b"a")]
        assert hub.counts.dropped == {"no session's name": 1}
    with pytest.raises(LinkError, match="session name"):
        ZenohLink("transmitter", name, connect=(endpoint,))
