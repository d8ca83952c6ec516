"""Where the machine code of compiled flights is kept, and who compiles.

It is kept in the user's cache folder under a digest of all sources that could matter, so that a second
study, or a second worker, does not compile again and no stale code is ever found. Of several processes
that need the same flight at once, one compiles it and the others read what it has kept.
"""

from __future__ import annotations

import gc
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import blake2b
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import FunctionType
from typing import Any

try:
    import fcntl
except ImportError:  # not a system with POSIX locks
    fcntl = None  # type: ignore[assignment]

PACKAGES = ("channel", "plant_sim", "receiver", "transmitter", "tenbaud")

SOURCES = (
    *PACKAGES[:-1],
    *(f"tenbaud.{name}" for name in ("bounds", "build", "config", "design", "flight", "studies")),
)
"""Packages that the figures of a flight depend on."""

BESIDE = (
    "channel/links/endpoints.py",
    *(
        f"tenbaud/studies/{name}.py"
        for name in (
            *("constants", "judging", "tuning", "records", "bench", "families", "quick", "search"),
            *("plots", "run", "table", "study", "study_file", "points", "settings", "progress"),
        )
    ),
)
"""Modules that no figure of a flight depends on."""

KEPT_FOLDERS = 8
KEPT_S = 86_400.0
"""How long machine code is kept unused, and of how many versions of the sources in any case."""

SETTINGS = ("OPT", "LOOP_VECTORIZE", "SLP_VECTORIZE", "BOUNDSCHECK", "DEBUGINFO_DEFAULT")
"""What a user may set in numba's environment variables that changes machine code; numba's own key has
the processor."""


class MachineCode:
    """Where numba keeps the machine code of a function: wherever its source is, in one place.

    So a copy of the project, in another folder or another environment, compiles nothing again.
    """

    def __init__(self, line: int, file: str) -> None:
        self._line = line
        self._py_file = file
        """numba names it where it warns that a function cannot be kept"""

    @classmethod
    def from_function(cls, function: FunctionType, file: str) -> MachineCode:
        return cls(function.__code__.co_firstlineno, file)

    def ensure_cache_path(self) -> None:
        """Do nothing: the folder is there."""

    def get_cache_path(self) -> str:
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        """Return nothing more: the folder stands for the sources."""
        return ""

    def get_disambiguator(self) -> str:
        config: Any = import_module("numba").config
        values = [int(getattr(config, name, None) or 0) for name in SETTINGS]
        most = "max" if getattr(config.OPT, "is_opt_max", False) else ""
        return f"{self._line}-{''.join(map(str, values))}{most}"


@cache
def sources_digest() -> str:
    """Return a digest of all sources that the figures of a flight depend on."""
    digest = blake2b(digest_size=12)
    for path in figure_sources():
        digest.update(path.read_bytes())
    return digest.hexdigest()


def figure_sources() -> list[Path]:
    """Return the files that the figures of a flight depend on, always in the same order."""
    found: list[Path] = []
    for package in SOURCES:
        spec = find_spec(package)
        for place in (spec and spec.submodule_search_locations) or ():
            paths = sorted(Path(place).rglob("*.py"))
            found += [path for path in paths if not path.as_posix().endswith(BESIDE)]
    return found


@cache
def cache_folder() -> Path | None:
    """Return where machine code is kept, None when that cannot be written."""
    try:
        base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        folder = Path(base) / "tenbaud" / sources_digest()
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            prune(folder.parent)
        os.utime(folder)
    except (OSError, RuntimeError):  # the latter for a user without a home, as in containers
        return None
    return folder if os.access(folder, os.W_OK) else None


def prune(base: Path) -> None:
    """Remove the machine code of sources that are in use no more; other processes may do so too."""
    with suppress(OSError):
        folders = sorted(base.iterdir(), key=lambda one: one.stat().st_mtime, reverse=True)
        for folder in folders[KEPT_FOLDERS:]:
            if time.time() - folder.stat().st_mtime > KEPT_S:
                shutil.rmtree(folder, ignore_errors=True)


def make_ready(function: Any, *arguments: Any) -> None:
    """Compile a function for arguments of these types, or read what has been kept.

    Garbage is collected afterwards: numba makes objects by the million, and looking through them while
    they grow takes a tenth of the time.
    """
    types = tuple(map(import_module("numba").typeof, arguments))
    if types in function.overloads:
        return
    collects = gc.isenabled()
    with _alone(function.__name__):
        gc.disable()
        try:
            function.compile(types)
        finally:
            if collects:
                gc.enable()


@contextmanager
def _alone(name: str) -> Iterator[None]:
    """Wait until no other process compiles the flight of this name; go on at once without locks."""
    folder = cache_folder()
    handle = -1
    try:
        if fcntl is not None and folder is not None:
            # The name of a flight is nearly as long as a file system allows.
            own = blake2b(name.encode(), digest_size=12).hexdigest()
            with suppress(OSError):
                handle = os.open(folder / f"{own}.lock", os.O_RDWR | os.O_CREAT, 0o600)
                fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        if handle >= 0:
            os.close(handle)
