"""The example sketch, compiled for this machine: its frames against the Python side, both ways."""

from __future__ import annotations

import math
import shutil
import struct
import subprocess
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from transmitter.rigs.formats.cobs import COMMAND, COMMAND_TYPE, CobsFormat, seal
from transmitter.rigs.formats.samples import DeviceFlag, RawSample

SHIM = Path(__file__).parent / "shim"
SKETCH = Path(__file__).parents[3] / "examples" / "firmware" / "tenbaud_cobs" / "tenbaud_cobs.ino"
COMPILER = shutil.which("g++") or shutil.which("clang++")
PERIOD_US = 2084
WATCHDOG_US = 100_000
ENABLE_PIN, ESTOP_PIN = 9, 10
FRONT_PWM, REAR_PWM, FRONT_DIRECTION, REAR_DIRECTION = 5, 6, 7, 8

pytestmark = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler (g++ or clang++) on PATH")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("firmware") / "sketch"
    command = [str(COMPILER), "-std=c++17", "-Wall", "-Wextra", "-Werror", "-fsanitize=undefined"]
    command += [f'-DSKETCH="{SKETCH}"', f"-I{SHIM}", str(SHIM / "main.cpp"), "-o", str(target)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return target


class Board:
    """The running sketch, on a clock that we set."""

    def __init__(self, program: Path) -> None:
        self.process = subprocess.Popen(
            [str(program)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.us = 0
        self.format = CobsFormat()
        self.format.feed(b"\0")

    def ask(self, text: str) -> str:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()

    def hear(self, data: bytes) -> None:
        self.ask(f"R {data.hex()}")
        self.step(0)

    def step(self, us: int) -> list[RawSample]:
        """Let time pass, then run the loop once."""
        self.us += us
        self.ask(f"T {self.us % (1 << 32)}")
        return self.format.feed(bytes.fromhex(self.ask("L")))

    def pass_time(self, us: int) -> list[RawSample]:
        samples = []
        end = self.us + us
        while self.us < end:
            samples += self.step(min(500, end - self.us))
        return samples

    def pin(self, pin: int) -> int:
        return int(self.ask(f"G {pin}"))

    @property
    def pwm(self) -> tuple[int, int]:
        return self.pin(FRONT_PWM), self.pin(REAR_PWM)


@pytest.fixture
def board(program: Path) -> Iterator[Board]:
    board = Board(program)
    yield board
    assert board.process.stdin is not None
    board.process.stdin.close()
    assert board.process.wait(10) == 0


def test_samples_come_at_their_rate_with_sequence_and_time(board: Board) -> None:
    samples = board.pass_time(1_000_000)
    assert 479 <= len(samples) <= 481
    assert [sample.sequence for sample in samples] == list(range(1, len(samples) + 1))
    times = [sample.device_us or 0 for sample in samples]
    steps = [after - before for before, after in pairwise(times)]
    assert all(PERIOD_US - 500 <= step <= PERIOD_US + 500 for step in steps)
    assert board.format.counts == {}


@pytest.mark.parametrize("counts", [(0, 0, 0), (100, -200, 300), (2**31 - 1, -(2**31), 256)])
def test_counts_of_every_size_and_sign_arrive(board: Board, counts: tuple[int, ...]) -> None:
    for channel, value in enumerate(counts):
        board.ask(f"C {channel} {value}")
    assert board.pass_time(5_000)[-1].counts == counts


def test_a_command_turns_the_motors_as_asked(board: Board) -> None:
    assert board.pwm == (0, 0)
    board.hear(b"\0" + CobsFormat().command(1, (3.0, -1.5), True))
    assert board.pwm == (64, 32)
    assert (board.pin(FRONT_DIRECTION), board.pin(REAR_DIRECTION)) == (1, 0)
    assert board.pin(ENABLE_PIN) == 1
    assert board.pass_time(5_000)[-1].flags == DeviceFlag.OUTPUT_ENABLED


def test_the_board_keeps_to_its_own_limit(board: Board) -> None:
    board.hear(CobsFormat().command(1, (11.0, -11.0), True))
    assert board.pwm == (106, 106)


def test_the_watchdog_cuts_and_stays_cut_until_it_hears_that_the_motors_are_off(board: Board) -> None:
    on = CobsFormat().command(1, (3.0, 3.0), True)
    board.hear(on)
    board.pass_time(WATCHDOG_US - 5_000)
    assert board.pwm == (64, 64)
    board.hear(on)
    board.pass_time(WATCHDOG_US - 5_000)
    assert board.pwm == (64, 64), "a command in time feeds it"
    samples = board.pass_time(20_000)
    assert board.pwm == (0, 0)
    assert board.pin(ENABLE_PIN) == 0
    assert samples[-1].flags == DeviceFlag.WATCHDOG_TRIPPED
    board.hear(on)
    assert board.pwm == (0, 0), "arming again must be on purpose"
    board.hear(CobsFormat().command(2, (0.0, 0.0), False))
    board.hear(on)
    assert board.pwm == (64, 64)


def test_damaged_commands_neither_turn_motors_nor_feed_the_watchdog(board: Board) -> None:
    whole = CobsFormat().command(1, (3.0, 3.0), True)
    board.hear(whole)
    board.pass_time(WATCHDOG_US - 5_000)
    for position in range(len(whole) - 1):
        board.hear(whole[:position] + bytes([whole[position] ^ 0x11 or 1]) + whole[position + 1 :])
        board.hear(whole[:position] + whole[position + 1 :])
    board.hear(seal(COMMAND.pack(COMMAND_TYPE, 1, 9, math.nan, 0.0)))
    board.hear(seal(struct.pack("<B", COMMAND_TYPE)))
    board.hear(bytes(range(1, 256)) * 2 + b"\0")
    board.pass_time(10_000)
    assert board.pwm == (0, 0)
    board.hear(CobsFormat().command(2, (0.0, 0.0), False))
    board.hear(whole)
    assert board.pwm == (64, 64), "and it is in step again at the next whole frame"


def test_an_open_emergency_stop_cuts_and_is_reported(board: Board) -> None:
    board.hear(CobsFormat().command(1, (3.0, 3.0), True))
    board.ask(f"P {ESTOP_PIN} 1")
    sample = board.pass_time(5_000)[-1]
    assert sample.flags == DeviceFlag.ESTOP_OPEN
    assert board.pwm == (0, 0)
    board.hear(CobsFormat().command(2, (3.0, 3.0), True))
    assert board.pwm == (0, 0)


def test_zeroing_sets_every_encoder_to_zero(board: Board) -> None:
    for channel in range(3):
        board.ask(f"C {channel} {channel + 50}")
    board.hear(seal(COMMAND.pack(COMMAND_TYPE, 2, 1, 0.0, 0.0)))
    assert board.pass_time(5_000)[-1].counts == (0, 0, 0)


def test_the_clock_may_wrap_under_a_running_watchdog(board: Board) -> None:
    board.us = (1 << 32) - 50_000
    board.step(0)
    board.hear(CobsFormat().command(1, (3.0, 3.0), True))
    board.pass_time(90_000)
    assert board.pwm == (64, 64)
    board.pass_time(20_000)
    assert board.pwm == (0, 0)
