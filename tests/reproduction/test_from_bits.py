"""The table of models out of bits: `python -m reproduction.from_bits`."""

from __future__ import annotations

from typing import Any

from reproduction.from_bits import CASES, table


def test_when_no_flight_has_measurements_to_compare_with_then_their_line_is_left_out() -> None:
    row: dict[str, Any] = {
        "case": CASES[0].name,
        "seed": 101,
        "bits": [0.1, 0.5, 0.35, -0.1],
        "deviations": [0.01] * 4,
        "true": [0.1, 0.5, 0.35, -0.115],
        "measured": None,
        "refused": ["uncertain"],
    }
    assert [line.split("|")[2].strip() for line in table([row])] == ["from", "---", "bits"]
    both = list(table([row | {"measured": row["true"]}]))
    assert both[-1].startswith("| | measurements | 0, 0 %")
