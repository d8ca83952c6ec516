"""Which addresses stay on this machine, and what is said about the others."""

from __future__ import annotations

import socket

import pytest

from channel.errors import LinkError
from channel.links.endpoints import DEFAULT_ENDPOINT, check_endpoints, free_endpoint, is_loopback


@pytest.mark.parametrize(
    "endpoint",
    [
        DEFAULT_ENDPOINT,
        "tcp/127.0.0.1:7447",
        "tcp/127.3.2.1:1",
        "tcp/[::1]:7447",
        "tcp/localhost:7447",
        "udp/127.0.0.1:7447?rel=1",
        "tls/127.0.0.1:7447#iface=lo",
        "unixsock-stream/some/socket",
    ],
)
def test_when_an_endpoint_is_loopback_then_it_is_allowed(endpoint: str) -> None:
    assert is_loopback(endpoint)


@pytest.mark.parametrize(
    "endpoint",
    [
        "tcp/0.0.0.0:7447",
        "tcp/[::]:7447",
        "tcp/192.168.1.5:7447",
        "tcp/[fe80::1]:7447",
        "tcp/example.org:7447",
        "tcp/127.0.0.1.example.org:7447",
        "tcp/localhost.example.org:7447",
        "tcp/8.8.8.8:7447#127.0.0.1:1",
        "tcp/8.8.8.8:7447?host=127.0.0.1:1",
        "udp/224.0.0.224:7446",
        "",
    ],
)
def test_when_an_endpoint_leaves_this_machine_then_it_is_no_loopback(endpoint: str) -> None:
    assert not is_loopback(endpoint)


@pytest.mark.parametrize("endpoint", ["tcp/192.168.1.5:7447", "tcp/0.0.0.0:7447"])
def test_when_an_endpoint_leaves_this_machine_then_the_refusal_says_why_and_what_to_do(
    endpoint: str,
) -> None:
    with pytest.raises(LinkError) as caught:
        check_endpoints((DEFAULT_ENDPOINT, endpoint), insecure=False)
    text = str(caught.value)
    assert endpoint in text
    assert "no encryption" in text
    assert "--insecure" in text
    assert "127.0.0.1" in text


def test_when_insecure_is_asked_for_then_any_address_is_allowed() -> None:
    check_endpoints(("tcp/192.168.1.5:7447",), insecure=True)


@pytest.mark.parametrize("endpoint", ["", "127.0.0.1", "127.0.0.1:7447", "tcp/7447", "7447"])
@pytest.mark.parametrize("insecure", [False, True])
def test_when_an_endpoint_is_malformed_then_the_right_form_is_shown(
    endpoint: str, insecure: bool
) -> None:
    with pytest.raises(LinkError) as caught:
        check_endpoints((endpoint,), insecure)
    assert DEFAULT_ENDPOINT in str(caught.value)


def test_when_an_endpoint_on_this_machine_is_asked_for_then_it_can_be_used() -> None:
    endpoint = free_endpoint()
    check_endpoints((endpoint,), insecure=False)
    assert 1024 <= int(endpoint.rpartition(":")[2]) <= 65535


def test_when_a_port_was_given_away_then_a_server_may_listen_there_and_nothing_else_gets_it() -> None:
    ports = [int(free_endpoint().rpartition(":")[2]) for _ in range(20)]
    assert len(set(ports)) == len(ports)
    with socket.socket() as other, pytest.raises(OSError, match="in use"):
        other.bind(("127.0.0.1", ports[0]))
    address = ("127.0.0.1", ports[0])
    with socket.create_server(address), socket.create_connection(address) as client:
        assert client.getsockname()[1] not in ports
