"""Where the bits are compared: what each place needs, and how it runs there."""

from __future__ import annotations

import platform
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from benchmarks.bits import in_c
from benchmarks.bits.flight import CHECKPOINTS, LONGEST, report
from tests.golden.regenerate import GOLDEN_CODECS

TOP = Path(__file__).resolve().parents[2]
AARCH64_PYTHON = TOP / ".cache" / "aarch64"
PYODIDE = TOP / ".cache" / "pyodide" / "node_modules" / "pyodide"
PATIENCE_S = 7200.0


class Amount(NamedTuple):
    """How much is flown."""

    samples: int
    """of the paper's codec"""
    others: int
    """of each other codec"""
    in_c: tuple[str, ...] = tuple(GOLDEN_CODECS)
    """which codecs are compiled"""

    def of(self, name: str) -> int:
        return self.samples if name == LONGEST else self.others


class Found(NamedTuple):
    """What came of a place."""

    golden: dict[str, int]
    """how many vectors differ, or whether the file does, by its name"""
    flights: dict[str, list[str]]
    """checkpoints, and the number of failed samples"""


class Place(NamedTuple):
    """Somewhere to compute."""

    title: str
    needs: tuple[tuple[str | Path, str], ...]
    """programs and files, and what to do where one is missing"""
    run: Callable[[Amount], Found]

    def missing(self) -> str | None:
        """Return what to install; None where all is there."""
        for what, remedy in self.needs:
            is_there = what.exists() if isinstance(what, Path) else shutil.which(what)
            if not is_there:
                return f"needs {what if isinstance(what, str) else what.name}: {remedy}"
        return None


class PlaceFailed(Exception):
    """A program ended with an error or said something else than it should."""


def differences(expected: Found, found: Found, amount: Amount) -> list[str]:
    """Return a line for each golden file and each flight that differs."""
    lines = [f"golden {name}: {count} differ" for name, count in found.golden.items() if count]
    for name, flown in found.flights.items():
        pairs = zip(expected.flights[name], flown, strict=True)
        at = next((at for at, (ours, theirs) in enumerate(pairs) if ours != theirs), None)
        if at is not None:
            every = amount.of(name) // CHECKPOINTS
            lines.append(f"{name}: a digest of {at * every} ... {(at + 1) * every} differs")
    return lines


def read(text: str) -> Found:
    """Read what `flight.py` and `flight.c` print."""
    found = Found({}, {})
    for line in text.splitlines():
        kind, *values = line.split(";")
        if kind == "golden":
            found.golden[values[0]] = int(values[1])
        elif kind == "flight":
            found.flights[values[0]] = values[1:]
    if not text.rstrip().endswith("end"):
        raise PlaceFailed(f"it ended early: {text[-500:]!r}")
    return found


def ran(*command: str | Path, folder: Path = TOP) -> str:
    """Run a command; return what it printed."""
    try:
        done = subprocess.run(
            list(map(str, command)),
            cwd=folder,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            encoding="utf-8",
            timeout=PATIENCE_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise PlaceFailed(f"{command[0]} did not end within {PATIENCE_S:.0f} s") from error
    if done.returncode != 0:
        raise PlaceFailed(f"{command[0]} ended with {done.returncode}: {done.stderr[-2000:]}")
    return done.stdout


def here(amount: Amount) -> Found:
    return read(report(*amount[:2]))


def on_aarch64(amount: Amount) -> Found:
    python = AARCH64_PYTHON / "usr/bin/python3"
    program = TOP / "benchmarks/bits/flight.py"
    given = map(str, amount[:2])
    return read(ran("qemu-aarch64", "-L", AARCH64_PYTHON, python, "-I", "-S", program, *given))


def in_webassembly(amount: Amount) -> Found:
    script = TOP / "benchmarks/bits/webassembly.mjs"
    return read(ran("node", script, PYODIDE / "pyodide.mjs", TOP, *map(str, amount[:2])))


def compiled(amount: Amount) -> Found:
    from benchmarks.bits.compiled import compiled_report

    return read(compiled_report(*amount[:2]))


def in_c_for(target: in_c.Target) -> Callable[[Amount], Found]:
    """Return what compiles every golden codec and runs it."""

    def run(amount: Amount) -> Found:
        found = Found({"numerics": 0, "codec": 0}, {})
        for name in amount.in_c:
            with TemporaryDirectory() as folder:
                in_c.write_sources(name, GOLDEN_CODECS[name], Path(folder))
                one = read(run_in_c(target, Path(folder), amount.of(name)))
            for kind, differing in one.golden.items():
                found.golden[kind] += differing
            found.flights[name] = one.flights["c"]
        return found

    return run


def run_in_c(target: in_c.Target, folder: Path, samples: int) -> str:
    """Compile a folder and run the program; return what it printed."""
    sources = (*in_c.SOURCES, *target.sources)
    ran(*target.compiler, *in_c.FLAGS, f"-DSAMPLES={samples}", *sources, folder=folder)
    # Windows looks for a relative program elsewhere.
    program = str(folder / in_c.PROGRAM)
    return ran(*[program if one == in_c.PROGRAM else one for one in target.run], folder=folder)


MAKE = "make emulators, as root on Debian"
QEMU_USER = ("qemu-aarch64", f"{MAKE} (qemu-user)")
PLACES = {
    "python": Place(f"CPython {platform.python_version()}, {platform.machine()}", (), here),
    "aarch64": Place(
        "CPython of Debian, aarch64 (QEMU)",
        (QEMU_USER, (AARCH64_PYTHON / "usr/bin/python3", MAKE)),
        on_aarch64,
    ),
    "webassembly": Place(
        "CPython of Pyodide, WebAssembly (Node)",
        (("node", "install Node and npm"), (PYODIDE / "pyodide.mjs", "make pyodide")),
        in_webassembly,
    ),
    "studies": Place(f"compiled for studies (numba), {platform.machine()}", (), compiled),
    "c": Place(f"C, {platform.machine()} (GCC)", (("gcc", f"{MAKE} (gcc)"),), in_c_for(in_c.HOST)),
    "c-aarch64": Place(
        "C, aarch64 (GCC, QEMU)",
        (QEMU_USER, ("aarch64-linux-gnu-gcc", f"{MAKE} (gcc-aarch64-linux-gnu)")),
        in_c_for(in_c.AARCH64),
    ),
    "c-cortex-m3": Place(
        "C, Cortex-M3, doubles in software (GCC, QEMU)",
        (
            ("arm-none-eabi-gcc", f"{MAKE} (gcc-arm-none-eabi)"),
            ("qemu-system-arm", f"{MAKE} (qemu-system-arm)"),
        ),
        in_c_for(in_c.CORTEX_M3),
    ),
}
