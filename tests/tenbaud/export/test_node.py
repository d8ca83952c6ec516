"""The node in C, a program beside `tenbaud receive`: the same protocol, the same digests."""

from __future__ import annotations

import json
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from channel.links.serial.emulated import EmulatedLine
from tenbaud.config.load import preset_names
from tenbaud.recording.reader import Recording
from tests.channel.links.serial.noisy_line import NoisyLine
from tests.tenbaud.export.compiled_codec import FLAGS, compiler, need
from tests.tenbaud.processes import finish, run, start

PRESET = "paper-10baud"
MISMATCH = 8
"""`Ending.MISMATCH`, as the frame has it"""
TOO_FAST = {"usual-1000baud", "helicopter-usual"}
"""for the slot counter of a symbol byte, with the usual allowance"""
SAFETY_STOP = 6
LATCHED = 4
"""as guard.h counts"""


def build(folder: Path, *arguments: str) -> Path:
    """Export a node and compile it; return the program."""
    need("gcc", "gcc")
    out = folder / "node"
    done = run("export-c", *arguments, "--out", str(out), cwd=folder)
    assert done.code == 0, done.err
    program = out / "program"
    rest = [str(out / name) for name in ("linux/main.c", "simulated/rig.c")]
    compiled = compiler(out, *rest, "-o", str(program), flags=FLAGS)
    assert compiled.returncode == 0, compiled.stderr
    return program


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    given = ("--preset", PRESET, "--set", "transmitter.watchdog_s=60")
    return build(tmp_path_factory.mktemp("node"), *given)


class Node:
    """A running node and its last line of counts."""

    def __init__(self, program: Path, port: Path | str, seconds: float) -> None:
        self._process = subprocess.Popen(
            [str(program), str(port), str(seconds)], stdout=subprocess.PIPE, text=True
        )
        self.counts: dict[str, Any] = {}

    def wait_for(self, sample: int) -> None:
        """Read until this sample is reached, or the node has ended."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.counts = json.loads(line)
            if self.counts["sample"] >= sample:
                return

    def finish(self) -> int:
        out, _ = self._process.communicate(timeout=60)
        lines = out.splitlines()
        self.counts = json.loads(lines[-1]) if lines else self.counts
        return self._process.returncode

    def kill(self) -> None:
        self._process.send_signal(signal.SIGKILL)
        self._process.wait()

    def close(self) -> None:
        if self._process.poll() is None:
            self.kill()


@contextmanager
def node_at(program: Path, port: Path | str, seconds: float) -> Iterator[Node]:
    node = Node(program, port, seconds)
    try:
        yield node
    finally:
        node.close()


def receive(line: EmulatedLine, folder: Path, *more: str) -> subprocess.Popen[str]:
    given = ("--preset", PRESET, "--link", "serial", "--port", str(line.receiver_port))
    return start("receive", *given, "--json", "--out", "run", *more, cwd=folder)


def check_equal(node: Node, folder: Path) -> None:
    """Every sample that the node confirmed had the receiver's digest, the last one as recorded."""
    counts = node.counts
    assert counts["desyncs"] == 0
    assert counts["digest_checks"] == counts["confirmed"] > 0
    samples = {
        row["sample"]: row["digest"]
        for _, row in Recording(folder / "run" / "receiver.mcap").rows("sample")
    }
    assert samples[counts["sample"] - 1] == counts["digest"]


@pytest.mark.real_time
def test_the_node_flies_with_a_receiver_and_every_digest_is_equal(
    program: Path, tmp_path: Path
) -> None:
    with EmulatedLine(tmp_path, 115_200) as line:
        receiver = receive(line, tmp_path)
        with node_at(program, line.transmitter_port, 4.0) as node:
            assert node.finish() == 0
        ended = finish(receiver)
    assert ended.code == 0, ended.err
    check_equal(node, tmp_path)
    assert node.counts["confirmed"] + 3 >= node.counts["symbols"] > 10
    assert node.counts["rejoins"] == 0


@pytest.mark.soak
@pytest.mark.parametrize("preset", sorted({*preset_names()} - TOO_FAST))
def test_the_node_of_every_preset_flies(preset: str, tmp_path: Path) -> None:
    """A plant that falls while the machine is held up ends in a stop for safety, never in a desync."""
    own = build(tmp_path, "--preset", preset)
    with EmulatedLine(tmp_path, 115_200) as line:
        receiver = receive(line, tmp_path, "--preset", preset)
        with node_at(own, line.transmitter_port, 12.0) as node:
            assert node.finish() == 0 or node.counts["ending"] == SAFETY_STOP
        finish(receiver)
    check_equal(node, tmp_path)


@pytest.mark.parametrize("preset", sorted(TOO_FAST))
def test_a_preset_that_no_serial_line_carries_is_refused_in_words(preset: str, tmp_path: Path) -> None:
    ended = run("export-c", "--preset", preset, "--out", "node", cwd=tmp_path)
    assert ended.code == 2
    assert "deadline_allowance_s" in ended.err
    assert not (tmp_path / "node").exists()


@pytest.mark.real_time
def test_a_node_that_was_killed_joins_again_after_its_reboot(program: Path, tmp_path: Path) -> None:
    with EmulatedLine(tmp_path, 115_200) as line:
        receiver = receive(line, tmp_path)
        with node_at(program, line.transmitter_port, 60.0) as node:
            node.wait_for(10)
            flown = node.counts["sample"]
            node.kill()
        with node_at(program, line.transmitter_port, 3.0) as again:
            assert again.finish() == 0
        ended = finish(receiver)
    assert ended.code == 0, ended.err
    assert again.counts["sample"] > flown >= 10
    check_equal(again, tmp_path)


@pytest.mark.soak
def test_a_receiver_that_was_killed_is_joined_again(program: Path, tmp_path: Path) -> None:
    (tmp_path / "second").mkdir()
    with EmulatedLine(tmp_path, 115_200) as line:
        receiver = receive(line, tmp_path)
        with node_at(program, line.transmitter_port, 60.0) as node:
            node.wait_for(10)
            receiver.kill()
            receiver.communicate()
            receiver = receive(line, tmp_path / "second")
            node.wait_for(node.counts["sample"] + 20)
            assert node.counts["desyncs"] == 0
            assert node.counts["rejoins"] >= 1
            node.kill()
        receiver.send_signal(signal.SIGINT)
        finish(receiver)


@pytest.mark.soak
def test_without_its_receiver_the_node_takes_the_motors_down_and_stays_there(
    tmp_path: Path,
) -> None:
    hasty = build(tmp_path, "--preset", PRESET, "--set", "transmitter.watchdog_s=1")
    with EmulatedLine(tmp_path, 115_200) as line:
        receiver = receive(line, tmp_path)
        with node_at(hasty, line.transmitter_port, 60.0) as node:
            node.wait_for(5)
            receiver.kill()
            receiver.communicate()
            assert node.finish() == 5
    assert node.counts["guard"] == LATCHED
    assert node.counts["ending"] == SAFETY_STOP


@pytest.mark.soak
def test_a_cable_that_was_pulled_out_costs_words_and_a_rejoin(program: Path, tmp_path: Path) -> None:
    with EmulatedLine(tmp_path, 115_200) as line:
        receiver = receive(line, tmp_path)
        with node_at(program, line.transmitter_port, 60.0) as node:
            node.wait_for(5)
            line.unplug()
            time.sleep(1.0)
            line.plug()
            node.wait_for(node.counts["sample"] + 30)
            node.kill()
        receiver.send_signal(signal.SIGINT)
        finish(receiver)
    assert node.counts["desyncs"] == 0
    assert node.counts["digest_checks"] == node.counts["confirmed"] > 10
    assert node.counts["rejoins"] + node.counts["erasures"] > 0


@pytest.mark.real_time
def test_noise_and_garbage_on_the_line_cost_words_and_never_lockstep(
    program: Path, tmp_path: Path
) -> None:
    with NoisyLine(tmp_path, 115_200, seed=7) as line:
        receiver = receive(line, tmp_path)
        with node_at(program, line.transmitter_port, 60.0) as node:
            node.wait_for(5)
            line.inject("down", bytes(range(256)) * 8)
            line.corrupt("down", 0.001)
            line.corrupt("up", 0.05)
            node.wait_for(node.counts["sample"] + 30)
            node.kill()
        line.corrupt("up", 0.0)
        receiver.send_signal(signal.SIGINT)
        finish(receiver)
    assert line.damaged["down"] + line.damaged["up"] > 0
    assert node.counts["desyncs"] == 0
    assert node.counts["digest_checks"] == node.counts["confirmed"] > 20


@pytest.mark.real_time
def test_a_receiver_of_another_configuration_refuses_the_node(program: Path, tmp_path: Path) -> None:
    with EmulatedLine(tmp_path, 115_200) as line:
        receiver = receive(line, tmp_path, "--set", "coder.decay=0.9")
        with node_at(program, line.transmitter_port, 30.0) as node:
            assert node.finish() == 3
        ended = finish(receiver)
    assert node.counts["ending"] == MISMATCH
    assert node.counts["symbols"] == 0
    assert ended.code == 3
    assert "the shared configuration differs" in ended.err


@pytest.mark.real_time
def test_without_a_receiver_the_node_waits_and_moves_nothing(program: Path, tmp_path: Path) -> None:
    with EmulatedLine(tmp_path, 115_200) as line, node_at(program, line.transmitter_port, 1.5) as node:
        time.sleep(0.1)
        node.finish()
    assert node.counts["phase"] == 0
    assert node.counts["ticks"] == node.counts["symbols"] == 0
