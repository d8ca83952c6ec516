"""TLS and access rules of the Zenoh link: who is let in, to what, and who is not."""

from __future__ import annotations

import io
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace

import pytest

from channel.errors import LinkError
from channel.links.security import Invited, Security, access_rules
from channel.links.zenoh.gate import reason_of
from channel.links.zenoh.hub import ZenohHub
from channel.links.zenoh.link import ZenohLink
from channel.links.zenoh.router import ZenohRouter
from channel.protocol.frames import Symbol
from channel.protocol.wire import encode
from tests.contract.security import SESSION, credentials, free_tls_endpoint, security
from tests.contract.test_links import PATIENCE_S, SILENCE_S, Pair, until

RIG = security("rig", ("desk", "receiver"))
DESK = security("desk", ("rig", "transmitter"))
DESK_WITH_VIEWER = security("desk", ("rig", "transmitter"), ("page", "viewer"))


@pytest.fixture
def endpoint() -> str:
    return free_tls_endpoint()


@pytest.fixture
def pair(endpoint: str) -> Iterator[Pair]:
    with (
        ZenohLink("receiver", SESSION, listen=(endpoint,), security=DESK_WITH_VIEWER) as desk,
        ZenohLink("transmitter", SESSION, connect=(endpoint,), security=RIG) as rig,
    ):
        assert until(desk.peer_present)
        assert until(rig.peer_present)
        yield rig, desk


def symbol(slot: int) -> bytes:
    """Return a message for the paid path of the uplink, which has a separate key."""
    return encode(Symbol(1, 0, slot, 1))


def check_both_ways(rig: ZenohLink, desk: ZenohLink) -> None:
    rig.send(symbol(6))
    assert desk.receive(PATIENCE_S) == symbol(6)
    rig.send(b"control")
    assert desk.receive(PATIENCE_S) == b"control"
    desk.send(b"command")
    assert rig.receive(PATIENCE_S) == b"command"


def test_when_both_are_invited_then_they_talk_both_ways(pair: Pair) -> None:
    check_both_ways(*pair)  # type: ignore[arg-type]


def test_when_a_valid_node_is_not_invited_then_it_neither_hears_nor_is_heard(
    pair: Pair, endpoint: str
) -> None:
    rig, desk = pair
    as_rig = security("intern", ("desk", "receiver"))
    as_desk = security("intern", ("desk", "transmitter"))
    with ZenohLink("transmitter", SESSION, connect=(endpoint,), security=as_rig) as intern:
        intern.send(symbol(1))
        intern.send(b"hello of a stranger")
        assert desk.receive(SILENCE_S) is None
        assert not intern.peer_present()
    with ZenohLink("receiver", SESSION, connect=(endpoint,), security=as_desk) as intern:
        rig.send(symbol(6))
        assert desk.receive(PATIENCE_S) == symbol(6)
        assert intern.receive(SILENCE_S) is None
        intern.send(b"command of a stranger")
        assert rig.receive(SILENCE_S) is None
    assert desk.counts.refused == {"uninvited certificate intern": 2}
    check_both_ways(rig, desk)  # type: ignore[arg-type]


class StuckTerminal(io.StringIO):
    """Takes nothing until it is released, as a terminal that was stopped with Ctrl-S."""

    def __init__(self) -> None:
        super().__init__()
        self.released = threading.Event()
        self.threads: set[str] = set()

    def write(self, text: str) -> int:
        self.threads.add(threading.current_thread().name)
        self.released.wait(PATIENCE_S)
        return super().write(text)


def test_when_the_terminal_takes_nothing_then_no_thread_of_zenoh_waits_for_it(
    pair: Pair, endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, desk = pair
    terminal = StuckTerminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    stranger = security("intern", ("desk", "receiver"))
    try:
        with ZenohLink("transmitter", SESSION, connect=(endpoint,), security=stranger):
            assert until(lambda: desk.counts.refused["uninvited certificate intern"] == 1)
            assert until(lambda: bool(terminal.threads))
        check_both_ways(*pair)  # type: ignore[arg-type]
        assert terminal.threads == {"zenoh gate"}
    finally:
        terminal.released.set()
    assert until(lambda: "uninvited certificate intern (1 so far)" in terminal.getvalue())


def test_when_the_invited_rig_plays_the_receiver_then_its_commands_go_nowhere(endpoint: str) -> None:
    other = security("rig", ("desk", "transmitter"))
    with (
        ZenohLink("transmitter", SESSION, listen=(endpoint,), security=DESK) as desk,
        ZenohLink("receiver", SESSION, connect=(endpoint,), security=other) as rig,
    ):
        rig.send(b"command")
        assert desk.receive(SILENCE_S) is None
        assert not desk.peer_present()


def test_when_an_invited_node_puts_under_another_key_then_it_is_not_heard(pair: Pair) -> None:
    rig, desk = pair
    for sender, taker, key in (
        (rig, desk, "up/wake"),
        (rig, desk, "up/more"),
        (desk, rig, "down/wake"),
    ):
        sender._session.put(f"tenbaud/{SESSION}/{key}", b"anything")  # type: ignore[attr-defined]
        assert taker.receive(SILENCE_S) is None
    check_both_ways(*pair)  # type: ignore[arg-type]


def test_when_an_invited_node_flies_in_another_session_then_it_stays_out(endpoint: str) -> None:
    with (
        ZenohLink("receiver", SESSION, listen=(endpoint,), security=DESK) as desk,
        ZenohLink(
            "transmitter",
            SESSION + "/other",
            connect=(endpoint,),
            security=security("rig", ("desk", "receiver"), session=SESSION + "/other"),
        ) as rig,
    ):
        rig.send(b"symbol")
        assert desk.receive(SILENCE_S) is None
        assert not rig.peer_present()


def test_when_a_viewer_is_invited_then_it_sees_and_cannot_send(pair: Pair, endpoint: str) -> None:
    rig, desk = pair
    watching = security("page", ("desk", "receiver"))
    with ZenohLink("transmitter", SESSION, connect=(endpoint,), security=watching) as page:
        assert until(page.peer_present)
        desk.send(b"command")
        assert page.receive(PATIENCE_S) == b"command"
        assert rig.receive(PATIENCE_S) == b"command"
        page.send(symbol(2))
        page.send(b"hello of a viewer")
        assert desk.receive(SILENCE_S) is None


def test_when_many_rigs_are_served_then_each_is_confined_to_its_own_session(endpoint: str) -> None:
    invited = tuple(
        Invited(name, "transmitter", session)
        for name, session in (("rig", "lab/1"), ("intern", "lab/2"))
    )
    with (
        ZenohHub("lab/*", listen=(endpoint,), security=Security(credentials("desk"), invited)) as hub,
        ZenohLink("transmitter", "lab/1", connect=(endpoint,), security=rig_of("rig", "lab/1")) as one,
        ZenohLink(
            "transmitter", "lab/2", connect=(endpoint,), security=rig_of("intern", "lab/2")
        ) as two,
        # The first rig's certificate, in the second one's session.
        ZenohLink(
            "transmitter", "lab/2", connect=(endpoint,), security=rig_of("rig", "lab/2")
        ) as wrong,
    ):
        hub.join("lab/1")
        hub.join("lab/2")
        assert until(lambda: one.peer_present() and two.peer_present())
        one.send(symbol(3))
        assert hub.receive(PATIENCE_S) == ("lab/1", symbol(3))
        wrong.send(symbol(4))
        assert hub.receive(SILENCE_S) is None
        two.send(symbol(5))
        assert hub.receive(PATIENCE_S) == ("lab/2", symbol(5))
        hub.send("lab/2", b"command for two")
        assert two.receive(PATIENCE_S) == b"command for two"
        assert one.receive(SILENCE_S) is None
        assert wrong.receive(SILENCE_S) is None


def rig_of(name: str, session: str) -> Security:
    return security(name, ("desk", "receiver"), session=session)


def test_when_the_address_is_not_in_the_certificate_then_the_listener_is_not_accepted(
    endpoint: str,
) -> None:
    foreign = endpoint.replace("127.0.0.1", "127.0.0.2")
    with ZenohLink("receiver", SESSION, listen=(foreign,), security=DESK) as desk:
        with ZenohLink("transmitter", SESSION, connect=(foreign,), security=RIG) as rig:
            assert not until_briefly(rig)
        assert not desk.peer_present()


@pytest.mark.soak  # Zenoh waits for ten seconds before it gives such a listener up
def test_when_the_listener_has_no_tls_then_the_connecting_end_sends_it_nothing(endpoint: str) -> None:
    plain = endpoint.replace("tls/", "tcp/")
    with (
        ZenohLink("receiver", SESSION, listen=(plain,)) as desk,
        ZenohLink("transmitter", SESSION, connect=(endpoint,), security=RIG) as rig,
    ):
        rig.send(b"symbol")
        assert desk.receive(SILENCE_S) is None
        assert not until_briefly(rig)


def test_when_everybody_is_behind_a_router_then_they_talk_and_the_uninvited_do_not(
    endpoint: str,
) -> None:
    hub = security("hub", ("rig", "transmitter"), ("desk", "receiver"))
    at_rig, at_desk = security("rig", ("hub", "receiver")), security("desk", ("hub", "transmitter"))
    stranger = security("intern", ("hub", "receiver"))
    with (
        ZenohRouter((endpoint,), security=hub) as router,
        ZenohLink("receiver", SESSION, router=(endpoint,), security=at_desk) as desk,
        ZenohLink("transmitter", SESSION, router=(endpoint,), security=at_rig) as rig,
        ZenohLink("transmitter", SESSION, router=(endpoint,), security=stranger) as intern,
    ):
        assert until(desk.peer_present)
        assert until(rig.peer_present)
        check_both_ways(rig, desk)
        intern.send(symbol(6))
        assert desk.receive(SILENCE_S) is None
        assert not intern.peer_present()
        assert router.refused == {"uninvited certificate intern": 1}


def test_when_there_is_no_router_then_the_error_says_where_it_should_be(endpoint: str) -> None:
    at_rig = security("rig", ("hub", "receiver"))
    with pytest.raises(LinkError, match=endpoint):
        ZenohLink("transmitter", SESSION, router=(endpoint,), security=at_rig, patience_s=0.3)


def test_when_a_file_is_missing_then_it_is_a_link_error(endpoint: str) -> None:
    own = credentials("desk")
    broken = Security(replace(own, private_key=own.private_key.with_name("gone")), DESK.invited)
    with pytest.raises(LinkError):
        ZenohLink("receiver", SESSION, listen=(endpoint,), security=broken)


def test_when_nobody_is_invited_then_everything_is_denied() -> None:
    assert access_rules(()) == {"enabled": True, "default_permission": "deny"}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("peer sent no certificates", "no certificate"),
        ("invalid peer certificate: UnknownIssuer", "another authority's certificate"),
        ("invalid peer certificate: certificate expired: verification time 1", "expired certificate"),
        ("invalid peer certificate: BadEncoding", "wrong certificate"),
        ("received corrupt message of type InvalidContentType", "no TLS"),
        ("tls handshake eof", "no TLS"),
        ("something new", "failed handshake"),
    ],
)
def test_when_a_handshake_fails_then_its_reason_has_a_name(text: str, reason: str) -> None:
    assert reason_of(text) == reason


def until_briefly(link: ZenohLink) -> bool:
    """Return whether the peer appears while a connection would long have been made."""
    for _ in range(10):
        if link.peer_present():
            return True
        link.receive(SILENCE_S)
    return False
