"""Where the recorded flights of real helicopters are; they are no part of the repository."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from reproduction.commands import DATA_VARIABLE
from reproduction.paper.real import UIUC_FILE
from tests.rules.sources import TOP

FOLDER = Path(os.environ.get(DATA_VARIABLE, TOP.parent / "shared" / "data"))

needs_data = pytest.mark.skipif(
    not (FOLDER / UIUC_FILE).is_file(),
    reason=f"the recorded flights are not at hand; give their folder in {DATA_VARIABLE}",
)
