"""Every command of `tenbaud --help` in its shortest form, and what its end may leave."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from tenbaud.cli.app import run
from tenbaud.keys.authority import NodeRole
from tenbaud.keys.store import add_node, create_authority

SHORT = ("--mismatch", "0", "--duration", "1")
ALONE = ("--set", "link.peer_timeout_s=0.2", "--listen", "tcp/127.0.0.1:0")
STUDY = """
name = "small"
engine = "plain"
set = { duration_s = 1.0 }
grid = { loss = [0.0, 0.1] }
"""


@dataclass(frozen=True)
class Inputs:
    """What the commands read: a flown run, keys, a study, a coder to design."""

    folder: Path

    @property
    def run(self) -> str:
        return str(self.folder / "run")

    @property
    def keys(self) -> str:
        return str(self.folder / "keys")

    @property
    def study(self) -> str:
        return str(self.folder / "study.toml")

    @property
    def plant(self) -> str:
        return str(self.folder / "plant.toml")


def make_inputs(folder: Path) -> Inputs:
    """Fly once, and make keys, a study and a coder to design."""
    made = Inputs(folder)
    assert run(["demo", "--link", "memory", *SHORT, "--json", "--out", made.run]) == 0
    create_authority(Path(made.keys))
    add_node(Path(made.keys), "rig", NodeRole.TRANSMITTER, ())
    Path(made.study).write_text(STUDY)
    Path(made.plant).write_text('[coder]\nkind = "direction"\n')
    return made


Arguments = Callable[[Inputs, str], list[str]]

WRITERS: dict[str, Arguments] = {
    "demo": lambda _, out: ["demo", "--link", "memory", *SHORT, "--figure", "--out", out],
    "demo over zenoh": lambda _, out: ["demo", *SHORT, "--figure", "--out", out],
    "transmit": lambda _, out: ["transmit", *ALONE, "--out", out],
    "receive": lambda _, out: ["receive", *ALONE, "--out", out],
    "replay": lambda inputs, out: ["replay", inputs.run, "--save", out],
    "convert csv": lambda inputs, out: ["convert", inputs.run, "--to", "csv", "--out", out],
    "convert mat": lambda inputs, out: ["convert", inputs.run, "--to", "mat", "--out", out],
    "convert parquet": lambda inputs, out: ["convert", inputs.run, "--to", "parquet", "--out", out],
    "convert json": lambda inputs, out: ["convert", inputs.run, "--to", "json", "--out", out],
    "convert mcap": lambda inputs, out: ["convert", inputs.run, "--to", "mcap", "--out", out],
    "identify": lambda _, out: [
        *("identify", "--excitation", "square:0.2,0,2.5", "--duration", "12", "--figure", "--out", out),
    ],
    "compare figure": lambda inputs, out: [
        *("compare", inputs.run, inputs.run, "--figure", f"{out}.png"),
    ],
    "sweep": lambda inputs, out: ["sweep", inputs.study, "--workers", "1", "--no-plots", "--out", out],
    "keys init": lambda _, out: ["keys", "init", "--folder", out],
    "export-c": lambda _, out: ["export-c", "--preset", "paper-10baud", "--out", out],
    "design": lambda inputs, out: ["design", "--config", inputs.plant, "--out", out],
}
"""Commands that leave something at `out`."""

SLOW_WRITERS: dict[str, Arguments] = {
    "figures": lambda _, out: ["figures", "3", "--out", out],
    "tune": lambda _, out: [
        *(
            "tune",
            "--disturbance",
            "q=2e-3",
            "--duration",
            "5",
            "--seeds",
            "1",
            "--test-seeds",
            "1",
            "--evaluations",
            "4",
        ),
        *("--out", out),
    ],
}

READERS: dict[str, Arguments] = {
    "presets": lambda *_: ["presets"],
    "inspect": lambda inputs, _: ["inspect", inputs.run],
    "log": lambda inputs, _: ["log", inputs.run],
    "compare": lambda inputs, _: ["compare", inputs.run, inputs.run],
    "diff": lambda inputs, _: ["diff", inputs.run],
    "audit": lambda inputs, _: ["audit", inputs.run],
    "recover": lambda inputs, _: ["recover", inputs.run],
    "rig-check": lambda *_: ["rig-check", "--rig", "cobs:/nowhere"],
    "rig": lambda *_: ["rig", "--duration", "0.1"],
    "router": lambda *_: ["router", "--print-config"],
    "view": lambda *_: ["view", "--schema"],
    # Five are refused; what is served lasts: `LASTING` in test_signals.py.
    "view RUN": lambda inputs, _: ["view", "--port", "0", *[inputs.run] * 5],
    "keys show": lambda inputs, _: ["keys", "show", inputs.keys],
    "keys renew": lambda inputs, _: ["keys", "renew", "rig", "--folder", inputs.keys],
    "keys add": lambda inputs, out: [
        *("keys", "add", Path(out).parent.name or "more", "--role", "viewer"),
        *("--folder", inputs.keys),
    ],
    "doctor": lambda *_: ["doctor"],
    "floor": lambda *_: ["floor", "--plant", "pendulum", "--rate", "20"],
}
"""Commands that leave nothing new, or only beside what they read."""

LONG = ("bench coders",)
"""Minutes long; it writes by the same functions as `figures`."""

ENDS_OF_THEIR_OWN = {"rig-check": 2, "view RUN": 2}
"""Exit codes of commands that cannot do well in the form above."""


@contextmanager
def small_disk(folder: Path, *, room_bytes: int) -> Iterator[Path]:
    """Mount a small file system; skips where that is not permitted."""
    folder.mkdir()
    with _mounted(folder, f"size={room_bytes or 16_384},nr_inodes=1k"):
        if not room_bytes:
            fill(folder)
        yield folder


def fill(disk: Path) -> Path:
    """Take all the room that is left on a disk; return the file that holds it."""
    filling = disk / "filled"
    with suppress(OSError), filling.open("wb", buffering=0) as file:
        while True:
            file.write(bytes(4096))
    return filling


@contextmanager
def read_only_disk(folder: Path) -> Iterator[Path]:
    """Mount a file system that nobody may write to."""
    folder.mkdir()
    with _mounted(folder, "ro"):
        yield folder


@contextmanager
def _mounted(folder: Path, options: str) -> Iterator[None]:
    mount = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(folder)]
    try:
        done = subprocess.run(mount, capture_output=True, text=True, check=False)
    except OSError as error:
        pytest.skip(f"nothing can be mounted here: {error}")
    if done.returncode:
        pytest.skip(f"nothing can be mounted here: {done.stderr.strip()}")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def left_below(folder: Path) -> list[Path]:
    """Return the files below a folder."""
    return [path for path in folder.rglob("*") if path.is_file() and path.name != "filled"]


def nothing_half_is_left(folder: Path) -> None:
    """Assert that no file is a temporary one, and that none but recordings is empty."""
    for path in left_below(folder):
        assert not path.name.endswith((".part", ".unfinished")), path
        assert path.suffix == ".mcap" or path.stat().st_size > 0, path


def processes_with(text: str) -> list[str]:
    """Return the command lines, other than this process', that hold a text."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit() or int(entry.name) == os.getpid():
            continue
        try:
            line = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
        except OSError:
            continue
        if text in line:
            found.append(line)
    return found
