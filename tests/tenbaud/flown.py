"""Short real flights for tests that read recordings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tenbaud import Run, fly

SECONDS = 12.0


def flown(folder: Path, preset: str = "tuned-10baud", **settings: Any) -> Run:
    """Fly both ends in this process for a few seconds; `settings` have __ where a dot belongs."""
    named = {name.replace("__", "."): value for name, value in settings.items()}
    return fly(
        preset,
        settings={"duration_s": SECONDS, "transmitter.plant.mismatch": 0.1, **named},
        out=folder,
    )
