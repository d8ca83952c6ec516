"""Who may open the page, and what is said when it cannot be served."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from benchmarks.browser import served
from tenbaud.view.server import Address, PageUnavailable
from tests.tenbaud.processes import run


def _has_ipv6() -> bool:
    try:
        with socket.socket(socket.AF_INET6) as probe:
            probe.bind(("::1", 0))
    except OSError:
        return False
    return True


NEEDS_IPV6 = pytest.mark.skipif(not _has_ipv6(), reason="this machine has no IPv6 loopback")

WITHOUT_NICEGUI = """
import sys
sys.modules["nicegui"] = None
from tenbaud.cli.app import main
main()
"""


def test_an_address_that_others_reach_needs_insecure() -> None:
    with pytest.raises(PageUnavailable, match="not encrypted"):
        Address("0.0.0.0", 0).checked()
    Address("0.0.0.0", 0, insecure=True).checked()
    assert Address("127.0.0.1", 0).checked().port > 0


def test_a_port_that_is_taken_is_named() -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(PageUnavailable, match=f"{port}.*another --port"):
            Address(port=port).checked()
    free = Address(port=0).checked()
    assert free.checked() == free


@pytest.mark.parametrize(
    ("host", "url"),
    [
        ("127.0.0.1", "http://127.0.0.1:8710"),
        ("localhost", "http://localhost:8710"),
        ("::1", "http://[::1]:8710"),
        ("0.0.0.0", "http://127.0.0.1:8710"),
        ("::", "http://[::1]:8710"),
        ("192.0.2.1", "http://192.0.2.1:8710"),
    ],
)
def test_the_url_leads_to_where_the_page_is_served(host: str, url: str) -> None:
    assert Address(host, 8710).url == url


@NEEDS_IPV6
@pytest.mark.parametrize("host", ["::1", "[::1]"])
def test_when_the_host_is_an_ipv6_address_then_the_page_is_served_there(
    host: str, tmp_path: Path
) -> None:
    pytest.importorskip("nicegui")
    with served(tmp_path, "view", "--host", host, "--port", "0") as page:
        assert page.url.startswith("http://[::1]:")
        with urlopen(page.url, timeout=10.0) as answer:
            assert answer.status == 200
            assert "tenbaud" in answer.read().decode()
        foreign = Request(page.url, headers={"Host": "example.org"})
        with pytest.raises(HTTPError, match="403"):
            urlopen(foreign, timeout=10.0)


@NEEDS_IPV6
def test_when_a_port_at_an_ipv6_address_is_taken_then_it_is_named() -> None:
    with socket.socket(socket.AF_INET6) as other:
        other.bind(("::1", 0))
        other.listen()
        port = other.getsockname()[1]
        with pytest.raises(PageUnavailable, match=rf"\[::1\]:{port}.*another --port"):
            Address("::1", port).checked()


@pytest.mark.parametrize("arguments", [("view",), ("demo", "--view")])
def test_without_the_extra_the_command_says_what_to_install(
    tmp_path: Path, arguments: tuple[str, ...]
) -> None:
    ended = run(*arguments, cwd=tmp_path, code=WITHOUT_NICEGUI)
    assert ended.code == 2
    assert "pip install 'tenbaud[page]'" in ended.err
    assert not (tmp_path / "runs").exists()


def test_a_flight_in_memory_has_no_page(tmp_path: Path) -> None:
    ended = run("demo", "--view", "--link", "memory", cwd=tmp_path)
    assert ended.code == 2
    assert "--view" in ended.err


def test_nothing_of_the_page_is_loaded_by_a_flight() -> None:
    source = "import sys, tenbaud.flight.demo, tenbaud.cli.commands; sys.exit('nicegui' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", source], check=False).returncode == 0
