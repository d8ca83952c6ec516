"""Points of a study: flown in two processes, and kept one by one, so that none is flown again."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from tenbaud.files.whole import write_whole
from tenbaud.studies.machine_code import sources_digest

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

P = TypeVar("P", bound="DataclassInstance")
F = TypeVar("F", bound="DataclassInstance")
OnProgress = Callable[[float, float, str], None]
WORKERS = 2


class Kept(Generic[P, F]):
    """A file of points and of what was found at each; `point` and `found` are their dataclasses.

    `own`: bytes that stand for what the figures rest on beside the sources of all studies. A file that
    other sources made, or that is damaged, holds nothing.
    """

    def __init__(self, path: Path, point: type[P], found: type[F], own: bytes) -> None:
        self._path, self._point, self._found = path, point, found
        self._sources = f"{sources_digest()} {blake2b(own, digest_size=8).hexdigest()}"

    def fly_all(
        self, fly: Callable[[P], F], points: Iterable[P], on_progress: OnProgress
    ) -> dict[P, F]:
        """Fly what the file does not hold yet, and keep each point in it as it comes."""
        points = list(dict.fromkeys(points))
        kept = self._read()
        found = {point: kept[point] for point in points if point in kept}
        left = [point for point in points if point not in found]
        context = multiprocessing.get_context("spawn")
        on_progress(len(found), len(points), "flights")
        with ProcessPoolExecutor(min(WORKERS, max(1, len(left))), context) as pool:
            flying = {pool.submit(fly, point): point for point in left}
            for future in as_completed(flying):
                found[flying[future]] = future.result()
                self._write({**kept, **found})
                on_progress(len(found), len(points), "flights")
        return {point: found[point] for point in points}

    def _read(self) -> dict[P, F]:
        try:
            values = json.loads(self._path.read_text(encoding="utf-8"))
            if values["sources"] != self._sources:
                return {}
            points = values["points"]
            return {self._point(**one["point"]): self._found(**one["found"]) for one in points}
        except (FileNotFoundError, ValueError, TypeError, KeyError):
            return {}

    def _write(self, found: dict[P, F]) -> None:
        points = [{"point": asdict(point), "found": asdict(one)} for point, one in found.items()]
        values = {"sources": self._sources, "points": points}
        write_whole(self._path, json.dumps(values, indent=1) + "\n")
