"""The node on a Cortex-M3 that QEMU emulates, its UART a socket that `tenbaud receive` opens."""

from __future__ import annotations

import contextlib
import json
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from tests.tenbaud.ends import Relay
from tests.tenbaud.export.compiled_codec import need
from tests.tenbaud.export.test_node import PRESET, check_equal
from tests.tenbaud.processes import REPOSITORY, finish, run, start

ARM_FLAGS = (
    *("-std=c99", "-mcpu=cortex-m3", "-mthumb", "-O2", "-Wall", "-Werror", "-ffp-contract=off"),
    *("-ffunction-sections", "-fdata-sections", "-Wl,--gc-sections", "-nostdlib"),
)
FLASH_BYTES_MAX, RAM_BYTES_MAX = 32_768, 8_192
INSTRUCTIONS_PER_TICK_MAX = 40_000
PATIENCE_S = 120.0


def build_image(folder: Path, *arguments: str) -> Path:
    """Export a node and compile it for the board; return the image."""
    need("arm-none-eabi-gcc", "gcc-arm-none-eabi")
    need("qemu-system-arm", "qemu-system-arm")
    out = folder / "board"
    done = run("export-c", *arguments, "--out", str(out), cwd=folder)
    assert done.code == 0, done.err
    compiled = compiled_image(out)
    assert compiled.returncode == 0, compiled.stderr
    return out / "node.elf"


def compiled_image(folder: Path) -> subprocess.CompletedProcess[str]:
    parts = (*folder.glob("*.c"), folder / "simulated/rig.c", *folder.glob("qemu/*.c"))
    return subprocess.run(
        [
            *("arm-none-eabi-gcc", *ARM_FLAGS, "-T", str(folder / "qemu/lm3s6965.ld")),
            *("-o", str(folder / "node.elf"), *map(str, parts), "-lgcc"),
        ],
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def image(tmp_path_factory: pytest.TempPathFactory) -> Path:
    given = ("--preset", PRESET, "--set", "transmitter.watchdog_s=60")
    return build_image(tmp_path_factory.mktemp("board"), *given)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
        return port


@dataclass
class Board:
    """An emulated board; `counts` is the last line that it wrote."""

    image: Path
    report: Path
    port: int = field(default_factory=free_port)
    counts: dict[str, Any] = field(default_factory=dict)
    flags: tuple[str, ...] = ()
    _process: subprocess.Popen[str] | None = None

    def power_on(self) -> None:
        line = f"tcp:127.0.0.1:{self.port},server=on,wait=off,nodelay=on"
        self._process = subprocess.Popen(
            [
                *("qemu-system-arm", "-M", "lm3s6965evb", "-nographic", "-monitor", "none"),
                *("-kernel", str(self.image), "-serial", line, "-serial", f"file:{self.report}"),
                *self.flags,
            ],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )

    def power_off(self) -> None:
        """Kill the emulator: the chip stops wherever it is."""
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
            self._process = None

    def lines(self) -> list[dict[str, Any]]:
        text = self.report.read_text() if self.report.exists() else ""
        return [json.loads(line) for line in text.splitlines(keepends=True) if line.endswith("\n")]

    def wait_for(self, what: str, least: int) -> None:
        """Wait until a count is reached."""
        until = time.monotonic() + PATIENCE_S
        while time.monotonic() < until:
            self.counts = (self.lines() or [{}])[-1]
            if self.counts.get(what, -1) >= least:
                return
            time.sleep(0.1)
        raise AssertionError(f"{what} did not reach {least} in {PATIENCE_S} s: {self.counts}")


@contextmanager
def powered(image: Path, folder: Path, *flags: str) -> Iterator[Board]:
    board = Board(image, folder / "counts.txt", flags=flags)
    board.power_on()
    try:
        yield board
    finally:
        board.power_off()


def receive(port: int, folder: Path) -> subprocess.Popen[str]:
    """Start a receiver at a socket that is open by now."""
    until = time.monotonic() + PATIENCE_S
    while time.monotonic() < until:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)):
            break
        time.sleep(0.05)
    given = ("--preset", PRESET, "--link", "serial", "--port", f"socket://127.0.0.1:{port}")
    return start("receive", *given, "--json", "--out", "run", cwd=folder)


def stop(receiver: subprocess.Popen[str]) -> None:
    receiver.send_signal(signal.SIGINT)
    finish(receiver)


def test_the_emulated_board_flies_with_a_receiver_and_every_digest_is_equal(
    image: Path, tmp_path: Path
) -> None:
    with powered(image, tmp_path) as board:
        receiver = receive(board.port, tmp_path)
        board.wait_for("symbols", 20)
        board.power_off()
        stop(receiver)
    check_equal(board, tmp_path)


def test_a_board_that_lost_its_power_joins_again_and_so_does_one_whose_cable_was_pulled(
    image: Path, tmp_path: Path
) -> None:
    with powered(image, tmp_path) as board:
        relay = Relay(board.port)
        receiver = receive(relay.port, tmp_path)
        try:
            board.wait_for("sample", 10)
            relay.cut(1.0)
            board.wait_for("sample", board.counts["sample"] + 20)
            assert board.counts["rejoins"] + board.counts["erasures"] > 0
            flown = board.counts["sample"]
            board.power_off()
            board.report.unlink()
            board.power_on()
            board.wait_for("sample", flown + 10)
            board.power_off()
            stop(receiver)
        finally:
            receiver.kill()
            relay.close()
    assert board.counts["confirmed"] < board.counts["sample"], "it is a new board that went on"
    check_equal(board, tmp_path)


def test_the_board_has_room_and_time(image: Path, tmp_path: Path) -> None:
    """With -icount shift=0 the emulator counts one nanosecond for an instruction."""
    sized = subprocess.run(
        ["arm-none-eabi-size", str(image)], capture_output=True, text=True, check=True
    )
    text, data, bss = (int(one) for one in sized.stdout.splitlines()[1].split()[:3])
    assert text + data < FLASH_BYTES_MAX
    with powered(image, tmp_path, "-icount", "shift=0") as board:
        board.wait_for("samples", 1)
    assert data + bss + board.counts["stack_bytes"] < RAM_BYTES_MAX
    assert 0 < board.counts["tick_ns"] < INSTRUCTIONS_PER_TICK_MAX


@pytest.mark.parametrize(("there", "small"), [("LENGTH = 64K", "LENGTH = 4K"), ("256K", "16K")])
def test_a_board_without_room_is_refused_by_the_linker(
    image: Path, there: str, small: str, tmp_path: Path
) -> None:
    board = tmp_path / "board"
    shutil.copytree(image.parent, board)
    script = board / "qemu" / "lm3s6965.ld"
    script.write_text(script.read_text().replace(there, small))
    compiled = compiled_image(board)
    assert compiled.returncode != 0
    assert "no room" in compiled.stderr or "overflowed" in compiled.stderr


def test_the_project_for_a_nucleo_compiles(image: Path, tmp_path: Path) -> None:
    need("make", "make")
    project = REPOSITORY / "examples/firmware/tenbaud_nucleo/Makefile"
    made = subprocess.run(
        ["make", "-f", str(project), f"NODE={image.parent}"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    assert 0 < (tmp_path / "node.bin").stat().st_size < FLASH_BYTES_MAX
