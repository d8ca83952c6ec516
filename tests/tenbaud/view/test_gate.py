"""Who gets anything of the page: by secret, by host name and by origin, over HTTP and WebSockets."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from benchmarks.browser import Served, served
from tenbaud.recording.errors import RecordingError
from tenbaud.recording.reader import Recording
from tenbaud.view.access import Access, Grant, draw_access, is_same_origin
from tests.tenbaud.view import asking
from tests.tenbaud.view.asking import POLLING, SOCKET_IO, ask, enter, everything, open_socket
from tests.tenbaud.view.viewers import needs_page

pytestmark = needs_page

# Ours are 400 and not 403: a POST of no session. That it got so far is the point.
OPEN = {"page": 200, "script": 200, "polling": 200, "posting": 400, "stream": 101, "socket.io": 101}
SHUT = dict.fromkeys(OPEN, 403)
ANOTHER_USER = 65534
NOT_ROOT = os.name != "posix" or os.getuid() != 0


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    folder = tmp_path_factory.mktemp("page")
    nowhere = f"unixsock-stream/{folder}/nobody.sock"
    with served(folder, "view", "--port", "0", "--connect", nowhere) as one:
        yield one


def key_of(address: str) -> str:
    return address.partition("?key=")[2]


def test_each_printed_address_opens_the_page_and_one_of_them_has_no_controls(page: Served) -> None:
    path, cookie = enter(page.port, key_of(page.url))
    look_path, look_cookie = enter(page.port, key_of(page.look_url))
    assert everything(page.port, path, cookie) == OPEN
    assert everything(page.port, look_path, look_cookie) == OPEN
    whole = ask(page.port, path, Cookie=cookie).text
    look = ask(page.port, look_path, Cookie=look_cookie).text
    assert "view-only" in look
    for part in ("Corrupt the transmitter's codec", "Bits lost", '"type":"click"', '"type":"change"'):
        assert part in whole, part
        assert part not in look, part
    # The secret for looking opens nothing at the path of the one that steers.
    assert everything(page.port, path, look_cookie) == SHUT


def test_the_cookie_is_strict_out_of_reach_for_scripts_and_for_one_path_only(page: Served) -> None:
    answer = ask(page.port, f"/?key={key_of(page.url)}")
    value, *attributes = answer.headers["set-cookie"].split("; ")
    path = attributes[0].removeprefix("Path=")
    assert value == f"tenbaud={key_of(page.url)}"
    assert attributes == [f"Path={path}", "HttpOnly", "SameSite=Strict"]
    # Browsers send a cookie to every port of its host: only a path that nobody can name keeps it here.
    assert len(path) == len("/0123456789abcdef/")
    assert path not in (page.url, key_of(page.url))
    assert answer.headers["cache-control"] == "no-store"


def test_without_a_secret_nothing_is_served_and_the_page_says_what_to_do(page: Served) -> None:
    path, cookie = enter(page.port, key_of(page.url))
    key = key_of(page.url)
    nearly = key[:-1] + ("0" if key[-1] != "0" else "1")
    for where in ("/", path):
        for what in ("", f"tenbaud={nearly}", f"tenbaud={key}x", "tenbaud=", "tenbaud", "a=b; ;"):
            assert everything(page.port, where, what) == SHUT, (where, what)
    assert everything(page.port, "/", cookie) == SHUT
    for query in (nearly, "", "%00", "%ff", "a&" * 100, f"{key}&key={nearly}x" * 9):
        answer = ask(page.port, f"/?key={query}")
        assert answer.status == 403
        assert "set-cookie" not in answer.headers
        assert "the whole address" in answer.text


def test_every_answer_forbids_to_be_framed(page: Served) -> None:
    path, cookie = enter(page.port, key_of(page.url))
    port, own = page.port, f"http://127.0.0.1:{page.port}"
    answers = {
        "refused": ask(port, "/"),
        "entered": ask(port, f"/?key={key_of(page.url)}"),
        "page": ask(port, path, Cookie=cookie),
        "script": ask(port, f"{path}view/view.js", Cookie=cookie),
        "missing": ask(port, f"{path}nothing", Cookie=cookie),
        "missing file": ask(port, f"{path}view/nothing", Cookie=cookie),
        "polling": ask(port, path + POLLING, Cookie=cookie),
        "bad session": ask(port, f"{path}{POLLING}&sid=x", "POST", Cookie=cookie, Origin=own),
        "bad method": ask(port, path, "DELETE", Cookie=cookie, Origin=own),
        "refused socket": open_socket(port, f"{path}stream", Origin=own),
    }
    for name, answer in answers.items():
        assert "frame-ancestors 'none'" in answer.headers["content-security-policy"], name
        assert answer.headers["x-frame-options"] == "DENY", name
        assert answer.headers["referrer-policy"] == "no-referrer", name
    assert answers["missing"].status == answers["missing file"].status == 404


@pytest.mark.parametrize(
    "host", ["rebound.example", "127.0.0.1.rebound.example", "localhost.", "[::1", "", "10.0.0.1"]
)
def test_a_name_that_was_rebound_to_this_machine_gets_nothing_even_with_the_secret(
    page: Served, host: str
) -> None:
    path, cookie = enter(page.port, key_of(page.url))
    name = f"{host}:{page.port}" if host else ""
    rebound = {"Host": name, "Origin": f"http://{name}", "Cookie": cookie}
    port = page.port
    assert ask(port, f"/?key={key_of(page.url)}", **rebound).status == 403
    assert ask(port, path, **rebound).status == 403
    assert ask(port, path + POLLING, **rebound).status == 403
    assert ask(port, f"{path}{POLLING}&sid=none", "POST", **rebound).status == 403
    assert open_socket(port, f"{path}stream", **rebound).status == 403
    assert open_socket(port, path + SOCKET_IO, **rebound).status == 403


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://127.0.0.1:1"},
        {"Origin": "http://localhost:{port}"},
        {"Origin": "https://example.org"},
        {"Origin": "null"},
        {"Origin": ""},
        {"Sec_Fetch_Site": "same-site"},
        {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "no-cors"},
        {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "iframe"},
    ],
)
def test_a_page_from_elsewhere_gets_nothing_even_if_the_browser_adds_the_cookie(
    page: Served, headers: dict[str, str]
) -> None:
    path, cookie = enter(page.port, key_of(page.url))
    sent = {name: text.format(port=page.port) for name, text in headers.items()} | {"Cookie": cookie}
    port = page.port
    assert ask(port, path, **sent).status == 403
    assert ask(port, path + POLLING, **sent).status == 403
    assert ask(port, f"{path}{POLLING}&sid=none", "POST", **sent).status == 403
    assert open_socket(port, f"{path}stream", **sent).status == 403
    assert open_socket(port, path + SOCKET_IO, **sent).status == 403


def test_what_changes_something_needs_an_origin_at_all(page: Served) -> None:
    path, cookie = enter(page.port, key_of(page.url))
    assert ask(page.port, f"{path}{POLLING}&sid=none", "POST", Cookie=cookie).status == 403
    assert open_socket(page.port, f"{path}stream", Cookie=cookie).status == 403
    assert open_socket(page.port, path + SOCKET_IO, Cookie=cookie).status == 403


def test_through_a_tunnel_with_another_port_the_page_opens(page: Served) -> None:
    path, cookie = enter(page.port, key_of(page.url))
    tunnel = {"Host": "localhost:9000", "Origin": "http://localhost:9000", "Cookie": cookie}
    assert ask(page.port, path, **tunnel).status == 200
    assert open_socket(page.port, f"{path}stream", **tunnel).status == 101


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="needs /proc")
def test_secrets_are_printed_once_and_seen_nowhere_else(page: Served) -> None:
    for address in (page.url, page.look_url):
        key = key_of(address)
        assert sum(key in line for line in page.said) == 1
        assert not any(key in path.read_text() for path in _files_in(page.folder))
        assert asking.found_in_sight(key) == []
    assert key_of(page.url) != key_of(page.look_url)


def _files_in(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


def test_with_view_only_no_address_steers(tmp_path: Path) -> None:
    nowhere = f"unixsock-stream/{tmp_path}/nobody.sock"
    with served(tmp_path, "view", "--port", "0", "--view-only", "--connect", nowhere) as one:
        assert one.look_url == ""
        path, cookie = enter(one.port, key_of(one.url))
        assert "view-only" in ask(one.port, path, Cookie=cookie).text


@pytest.mark.skipif(NOT_ROOT, reason="only root can become another user")
def test_another_user_of_the_machine_gets_nothing_and_steers_nothing(tmp_path: Path) -> None:
    arguments = ("demo", "--view", "--view-port", "0", "--duration", "600", "--out", "run")
    with served(tmp_path, *arguments) as flight:
        key = key_of(flight.url)
        path, _ = enter(flight.port, key)
        sockets = _open_sockets(flight.process.pid)
        given = {
            "uid": ANOTHER_USER, "port": flight.port, "key": key, "path": path, "sockets": sockets,
        }  # fmt: skip
        program = Path(asking.__file__).read_text()
        told = json.loads(
            subprocess.run(
                [sys.executable, "-c", program],
                input=json.dumps(given), capture_output=True, text=True, check=True, timeout=60.0,
            ).stdout
        )  # fmt: skip
        _wait_until_flown(tmp_path / "run" / "transmitter.mcap")
    assert told["uid"] == ANOTHER_USER
    assert told["without"] == dict.fromkeys(told["without"], SHUT)
    assert told["sockets"] == ["PermissionError"] * 2
    assert told["in sight"] == []
    # The same program in the same place, now with the secret: nothing else was missing.
    assert told["with"] == OPEN
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["desyncs"] == summary["commands_refused"] == 0


def _wait_until_flown(path: Path) -> None:
    """Return when a sample is recorded: a flight that is stopped before leaves no summary."""
    until_s = time.monotonic() + 60.0
    while time.monotonic() < until_s:
        with contextlib.suppress(RecordingError):
            if any(True for _ in Recording(path).rows("sample")):
                return
        time.sleep(0.1)
    raise AssertionError("no sample was recorded")


def _open_sockets(parent: int) -> list[str]:
    """Return the telemetry sockets of a demonstration, once both are there."""
    until_s = time.monotonic() + 20.0
    while time.monotonic() < until_s:
        words = [part for words in _command_lines(parent) for part in words if ".sock" in part]
        found = sorted({word.partition("/")[2] for word in words})
        if len(found) == 2 and all(Path(path).is_socket() for path in found):
            return found
        time.sleep(0.1)
    raise AssertionError("no telemetry sockets")


def _command_lines(parent: int) -> Iterator[list[str]]:
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            if int(path.read_text(errors="replace").rpartition(")")[2].split()[1]) == parent:
                yield (path.parent / "cmdline").read_text().split("\0")
        except OSError:
            continue


def test_the_browser_that_is_opened_gets_a_file_of_its_user_and_no_secret_in_words(
    tmp_path: Path,
) -> None:
    seen, browser = tmp_path / "seen", tmp_path / "browser"
    browser.write_text(
        f'#!/bin/sh\nfile="${{1#file://}}"\n'
        f'cp "$file" {seen}.html\nls -ld "$(dirname "$file")" > {seen}.ls\n'
        f'echo "$1" > {seen}.tmp\nmv {seen}.tmp {seen}\n'
    )
    browser.chmod(0o755)
    nowhere = f"unixsock-stream/{tmp_path}/nobody.sock"
    arguments = ("view", "--port", "0", "--open", "--connect", nowhere)
    with served(tmp_path, *arguments, environment={"BROWSER": f"{browser} %s"}) as one:
        until_s = time.monotonic() + 20.0
        while not seen.exists() and time.monotonic() < until_s:
            time.sleep(0.05)
        words = seen.read_text()
        assert key_of(one.url) not in words
        assert one.url in Path(f"{seen}.html").read_text()
        assert Path(f"{seen}.ls").read_text().startswith("drwx------")
        one.process.send_signal(signal.SIGINT)
        one.process.wait(20.0)
    assert not Path(words.strip().removeprefix("file://")).exists()


@pytest.mark.parametrize(
    ("host", "local", "remote"),
    [
        ("127.0.0.1:8710", True, True),
        ("localhost:9", True, True),
        ("192.0.2.1:8710", False, True),
        ("[2001:db8::1]:8710", False, True),
        ("192.0.2.7", True, True),
        ("example.org:8710", False, False),
        ("192.0.2.1.example.org", False, False),
        ("", False, False),
        ("[::1", False, False),
    ],
)
def test_a_server_for_other_machines_answers_to_addresses_and_not_to_any_name(
    host: str, local: bool, remote: bool
) -> None:
    assert draw_access("192.0.2.7", True, view_only=False).answers_to(host) is local
    assert draw_access("0.0.0.0", False, view_only=False).answers_to(host) is remote


def test_a_persons_own_step_to_the_page_may_come_from_anywhere() -> None:
    step = {"host": "h", "sec-fetch-mode": "navigate", "sec-fetch-dest": "document"}
    for site in ("none", "same-origin", "same-site", "cross-site"):
        assert is_same_origin({**step, "sec-fetch-site": site})
    assert not is_same_origin({**step, "origin": "http://other"})


def test_secrets_do_not_show_in_what_is_printed_of_them() -> None:
    grant = Grant(steers=True)
    access = Access((grant,), frozenset())
    assert grant.key not in f"{grant!r} {access!r}"
    assert len({Grant(steers=True).key for _ in range(100)}) == 100
