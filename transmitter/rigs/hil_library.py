"""The names that a rig on a Quanser board uses of the vendor's package, or of its double."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class HilLibrary:
    """The names that we use of the vendor's package, or of its double."""

    hil: Callable[[str, str], Any]
    error: type[Exception]
    hardware_clock: Any
    overwrite_on_overflow: Any
