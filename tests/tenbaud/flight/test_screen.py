"""What a terminal shows, and what everything that is no terminal gets."""

from __future__ import annotations

import io
import json
import os
import pty
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from tenbaud.flight.screen import Screen, unicode_fits
from tenbaud.flight.status import status_line
from tests.tenbaud.processes import REPOSITORY, run

STATUS: dict[str, Any] = {
    "role": "transmitter", "phase": "flying", "tick": 500, "of_ticks": 1000, "time_s": 5.0,
    "outputs": [{"name": "pitch", "unit": "rad", "value": 0.5, "error": -0.01, "range": 0.05}],
    "erasures": 3, "desyncs": 1,
    "digest_checks": 50, "rejoins": 1, "words": [(1,), None, (-1,)], "guard": "running",
}  # fmt: skip
RECEIVER: dict[str, Any] = {
    "role": "receiver", "phase": "flying",
    "outputs": [
        {"name": "arm", "unit": "rad", "value": 0.4, "error": None, "range": 0.1},
        {"name": "pump [speed]", "unit": "", "value": 12.5, "error": 0.25, "range": 0.1},
    ],
}  # fmt: skip


def drawn(screen: Screen, **how: Any) -> str:
    console = Console(file=io.StringIO(), width=100, force_terminal=True, **how)
    console.print(screen)
    text: str = console.file.getvalue()  # type: ignore[attr-defined]
    return text


def test_it_says_all_that_matters() -> None:
    screen = Screen()
    assert "starting" in drawn(screen)
    screen.update(STATUS)
    screen.update({**RECEIVER, "baud": 9.98})
    text = drawn(screen, color_system=None)
    for words in ("5.0 s", "50 %", "+28.6 deg", "-0.57 deg", "50 digests", "1 differed", "3 erased"):
        assert words in text
    assert "receiver" in text
    for words in ("arm   +22.9 deg", "pump [speed]     +12.5", "+0.25   of M 0.1"):
        assert words in text
    assert "9.98 baud" in text
    assert "▀×▄" in text  # noqa: RUF001


def test_a_narrow_flight_says_what_is_certain_and_where_the_law_runs() -> None:
    narrow = {
        "scheme": "mirrored", "confirmed_to": 391, "unconfirmed": 7, "hypotheses": 3, "rest": 5.07e-7,
        "hash_bits_per_sample": 1.74, "baud": 19.98,
    }  # fmt: skip
    status = {**STATUS, "digest_checks": 0, "narrow": narrow}
    screen = Screen()
    screen.update(status)
    text = drawn(screen, color_system=None)
    assert "certain before sample 391, 7 behind; 3 hypotheses, rest 5e-07, 1 rejoins" in text
    assert "unseen for n samples with probability 2^(-1.7 n)" in text
    assert "digests" not in text
    assert "19.98 symbols/s; the law runs beside the plant too" in text
    assert status_line(status).endswith(
        "unconfirmed 7  hypotheses 3  rest 5e-07  down 20.0/s  law beside the plant"
    )


def test_bits_have_the_colour_of_the_output_that_they_were_about() -> None:
    screen = Screen()
    outputs = [{**STATUS["outputs"][0], "name": name} for name in ("arm", "cart")]
    words = {"words": [(1,), None, (-1,)], "about": [(0,), None, (1,)]}
    screen.update({**STATUS, "outputs": outputs, **words})
    text = drawn(screen, color_system="standard")
    blue, red, green = "\x1b[34m", "\x1b[31m", "\x1b[32m"
    assert f"{blue}▀\x1b[0m{red}×\x1b[0m{green}▄" in text  # noqa: RUF001
    assert f"{blue}  arm\x1b[0m{green}  cart" in text


def test_without_unicode_it_is_plain_ascii() -> None:
    screen = Screen(unicode=False)
    screen.update(STATUS)
    text = drawn(screen, color_system=None)
    assert text.isascii()
    assert "'x." in text
    assert not unicode_fits(Console(file=io.TextIOWrapper(io.BytesIO(), encoding="ascii")))


def test_a_line_has_every_output_with_its_unit() -> None:
    assert status_line(RECEIVER) == (
        "receiver: flying  arm +22.9 deg  M 5.73  pump [speed] +12.500  error +0.2500  M 0.100"
    )


def test_no_color_leaves_no_colour(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen()
    screen.update(STATUS)
    monkeypatch.delenv("NO_COLOR", raising=False)
    assert "\x1b[31m" in drawn(screen, color_system="standard")
    monkeypatch.setenv("NO_COLOR", "1")
    plain = drawn(screen, color_system="standard")
    assert "\x1b[3" not in plain
    assert "1 differed" in plain


def test_a_pitch_beyond_the_gauge_stays_on_it() -> None:
    screen = Screen()
    for angle in (-9.0, 0.0, 9.0):
        (output,) = STATUS["outputs"]
        screen.update({**STATUS, "outputs": [{**output, "value": angle}]})
        assert drawn(screen).count("●") == 1


def in_terminal(folder: Path, *arguments: str, **environment: str) -> str:
    """Run the command with standard error on a terminal; return what the terminal got."""
    ours, theirs = pty.openpty()
    path = os.pathsep.join([str(REPOSITORY), os.environ.get("PYTHONPATH", "")])
    process = subprocess.Popen(
        [sys.executable, "-m", "tenbaud", *arguments],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "TERM": "xterm", **environment},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=theirs,
    )
    os.close(theirs)
    got: list[bytes] = []

    def read() -> None:
        try:
            while data := os.read(ours, 4096):
                got.append(data)
        except OSError:
            pass  # the terminal is gone with its last writer

    reader = threading.Thread(target=read)
    reader.start()
    out, _ = process.communicate(timeout=240.0)
    reader.join(10.0)
    os.close(ours)
    assert process.returncode == 0
    assert json.loads(out)["outcome"] == "the flight is over"
    return b"".join(got).decode()


FLIGHT = ("demo", "--clock", "real", "--duration", "2", "--json", "--out")


def test_on_a_terminal_the_view_is_drawn_and_cleared(tmp_path: Path) -> None:
    shown = in_terminal(tmp_path, *FLIGHT, "a")
    assert "digests" in shown
    assert "\x1b[3" in shown
    without = in_terminal(tmp_path, *FLIGHT, "b", NO_COLOR="1")
    assert "digests" in without
    assert "\x1b[3" not in without


def test_elsewhere_there_are_plain_lines(tmp_path: Path) -> None:
    ended = run("demo", "--clock", "real", "--duration", "4", "--json", "--out", "r", cwd=tmp_path)
    assert ended.code == 0, ended.err
    lines = ended.err.splitlines()
    assert 1 <= len(lines) <= 6
    assert any(line.startswith(("transmitter: flying", "receiver: flying")) for line in lines)
    assert "\x1b" not in ended.err
    assert "\r" not in ended.err
