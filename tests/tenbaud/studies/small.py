"""A small study, flown by the nodes themselves, so that nothing needs to be compiled."""

from __future__ import annotations

from typing import Any

from tenbaud.studies.study import Study
from tenbaud.studies.study_file import StudyFile

SMALL: dict[str, Any] = {
    "name": "small",
    "preset": "tuned-10baud",
    "seeds": 3,
    "engine": "plain",
    "chunk_flights": 2,
    "set": {"duration_s": 2.0, "transmitter": {"plant": {"disturbance": "q=2e-3"}}},
    "grid": {"mismatch": [0.0, 0.1], "rate": [5, 10]},
}


def study_of(**changes: Any) -> Study:
    return Study(StudyFile.model_validate(SMALL | changes))
