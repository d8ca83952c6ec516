"""Builds the page on which both ends fly in the visitor's browser: `browser/flight.html` of the site.

The page has the live page's instruments, the modules that a flight needs, the parts of one flight as
objects, and Pyodide, which is Python for browsers (npm's `pyodide`, by `make pyodide`). All is local.
"""

from __future__ import annotations

import io
import pickle
import struct
import subprocess
import sys
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from channel.line.impairments import ImpairedLine
from channel.protocol.wire import DATAGRAM
from docs.browser.flight import FlightParts
from tenbaud.build.controllers import build_controller
from tenbaud.build.ends import build_line, build_observer, build_transmitter
from tenbaud.build.flight import agree
from tenbaud.build.references import build_references
from tenbaud.config.load import load_config
from tenbaud.telemetry.end import steered

TOP = Path(__file__).resolve().parents[2]
SOURCE = TOP / "docs" / "browser"
STATIC = TOP / "tenbaud" / "view" / "static"
PYODIDE = TOP / ".cache" / "pyodide" / "node_modules" / "pyodide"
RUNTIME = (
    "pyodide.mjs",
    "pyodide.asm.mjs",
    "pyodide.asm.wasm",
    "python_stdlib.zip",
    "pyodide-lock.json",
)
STYLED = (".js", ".css", ".svg")
PRESET = "tuned-10baud"
SETTINGS = {
    "transmitter": {"plant": {"mismatch": 0.1}},
    "link": {"kind": "memory"},
    "duration_s": 3600.0,
}
WITHOUT = """<!doctype html>
<html lang="en"><meta charset="utf-8"><title>tenbaud in the browser</title>
<p>This site was built without Pyodide, npm's Python for browsers, so the flight is not here.
Install npm and build the site again: <code>make docs</code></p></html>
"""
SCRIPT = '<script type="module" src="view/view.js"></script>'
FLY_BARE = """
import sys
sys.path.insert(0, sys.argv[1])
from docs.browser.flight import BrowserFlight
flight = BrowserFlight(sys.stdin.buffer.read())
flight.advance(1.0, 600.0)
flight.news(1.0, False)
flight.symbols_file()
top = sys.argv[1] + "/"
files = [getattr(one, "__file__", None) or "" for one in sys.modules.values()]
print("\\n".join(sorted(one.removeprefix(top) for one in files if one.startswith(top))))
"""


def page_files() -> dict[str, bytes]:
    """Return the files of the page by their place on the site; without Pyodide a page that says so."""
    if why_no_pyodide() is not None:
        return {"browser/flight.html": WITHOUT.encode()}
    parts = flight_parts()
    found = {
        "flight.html": page().encode(),
        "parts.pickle": parts,
        "heart.zip": heart(modules_of(parts)),
    }
    found |= {one.name: one.read_bytes() for one in SOURCE.glob("*.js")}
    found |= {f"view/{one.name}": one.read_bytes() for one in STATIC.iterdir() if one.suffix in STYLED}
    found |= {f"pyodide/{name}": (PYODIDE / name).read_bytes() for name in RUNTIME}
    return {f"browser/{name}": content for name, content in found.items()}


def why_no_pyodide() -> str | None:
    """Return why the page cannot be built here, None when it can."""
    missing = [name for name in RUNTIME if not (PYODIDE / name).is_file()]
    return f"no {missing[0]} of npm's pyodide in {PYODIDE}: make pyodide" if missing else None


def page() -> str:
    """Return the page: the live page's instruments within its own frame."""
    instruments = (STATIC / "instruments.html").read_text(encoding="utf-8")
    if SCRIPT not in instruments:
        raise ValueError(f"instruments.html no longer has {SCRIPT}: the page would have two scripts")
    frame = (SOURCE / "frame.html").read_text(encoding="utf-8")
    return frame.replace("<!-- instruments -->", instruments.replace(SCRIPT, ""))


class PartsPickler(pickle.Pickler):
    """Pickles the layouts of packed states too, which are made again from their formats."""

    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, struct.Struct):
            return struct.Struct, (obj.format,)
        return NotImplemented


def flight_parts() -> bytes:
    """Return the pickled `FlightParts` of the configuration that the page flies."""
    config = load_config(PRESET, overrides=SETTINGS)
    agreement = replace(agree(config, "virtual"), live=True)
    references = steered(agreement)
    configured = build_references(config, agreement.signals, agreement.codec.model)[0]
    if references is None or configured is None:
        raise ValueError(f"{config.preset} has no set-point that the page could steer")
    node = build_transmitter(agreement, None)
    lines = [build_line(agreement, one, DATAGRAM) for one in ("up", "down")]
    up, down = (one for one in lines if isinstance(one, ImpairedLine))
    parts = FlightParts(
        config.model_dump(mode="json"),
        agreement.codec,
        agreement.terms,
        agreement.identity,
        node.rig,
        node.guard,
        round(config.link.peer_timeout_s / config.timing.tick_s),
        build_observer(agreement),
        build_controller(config, references, agreement.codec.model),
        references,
        configured,
        (up, down),
        agreement.flight_ticks,
    )
    file = io.BytesIO()
    PartsPickler(file, protocol=4).dump(parts)
    return file.getvalue()


def modules_of(parts: bytes) -> list[str]:
    """Return the files of this project that a flight needs, from one on Python without any package."""
    words = [sys.executable, "-I", "-S", "-c", FLY_BARE, str(TOP)]
    done = subprocess.run(words, input=parts, capture_output=True, check=False)
    if done.returncode:
        raise RuntimeError(f"the page's flight needs more than Python: {done.stderr.decode()}")
    return done.stdout.decode().split()


def heart(modules: list[str]) -> bytes:
    """Return these files as an archive that Python can import from."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in modules:
            # Equal sources give an equal archive.
            archive.writestr(zipfile.ZipInfo(name), (TOP / name).read_bytes(), zipfile.ZIP_DEFLATED)
    return file.getvalue()
