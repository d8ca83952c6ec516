"""Write golden vectors again: ``python -m tests.golden.regenerate numerics`` from the top folder.

A golden file pins bits that both ends of a link must share. Writing one again is therefore a
change of the wire format: say so in CHANGELOG.md, and never do it only to turn a test green.

To add a file, write a function that returns what JSON can hold and name it in ``GENERATORS``.
"""

from __future__ import annotations

import json
import math
import random
import sys
from collections.abc import Callable
from pathlib import Path

from channel import numerics

FOLDER = Path(__file__).resolve().parent


def numerics_vectors() -> dict[str, list[list[str]]]:
    """Return [argument, result] pairs of hex floats for each function."""
    chooser = random.Random(20240610)
    angles = [0.0, -0.0, 5e-324, 1e-300, -1e-9, 0.5, 1.0, -1.0, 1e5, -1e5]
    for quarter_turns in (1, 2, 3, 4, 5, 100, 12345, 63661):
        angle = quarter_turns * (math.pi / 2)
        angles += [angle, math.nextafter(angle, 0.0), -math.nextafter(angle, math.inf)]
    angles += [chooser.uniform(-math.pi / 4, math.pi / 4) for _ in range(60)]
    angles += [chooser.uniform(-10.0, 10.0) for _ in range(60)]
    angles += [chooser.uniform(-1e5, 1e5) for _ in range(40)]
    exponents = [0.0, -0.0, 5e-324, -1e-17, 0.5, 1.0, -1.0, 700.0, -700.0]
    exponents += [octaves * math.log(2.0) for octaves in (-1000, -1, 1, 2, 1000)]
    exponents += [chooser.uniform(-1.0, 1.0) for _ in range(60)]
    exponents += [chooser.uniform(-700.0, 700.0) for _ in range(60)]
    return {
        "sin": [[x.hex(), numerics.sin(x).hex()] for x in angles],
        "cos": [[x.hex(), numerics.cos(x).hex()] for x in angles],
        "exp": [[x.hex(), numerics.exp(x).hex()] for x in exponents],
    }


GENERATORS: dict[str, Callable[[], object]] = {
    "numerics": numerics_vectors,
}
"""Name of each golden file (without .json) and what makes its content."""


def main(names: list[str]) -> int:
    """Write the named files; with an unknown name, or none, write nothing and list the names."""
    unknown = [name for name in names if name not in GENERATORS]
    if unknown or not names:
        print(f"usage: python -m tests.golden.regenerate NAME...  ({', '.join(GENERATORS)})")
        return 2
    for name in names:
        path = FOLDER / f"{name}.json"
        path.write_text(render(GENERATORS[name]()), encoding="utf-8")
        print(f"wrote {path.name}")
    return 0


def render(content: object) -> str:
    """Return JSON with one vector on each line, so that a review shows which bits changed."""
    if not isinstance(content, dict):
        return json.dumps(content, indent=1) + "\n"
    parts = []
    for key, value in content.items():
        if isinstance(value, list):
            lines = ",\n  ".join(json.dumps(item) for item in value)
            parts.append(f" {json.dumps(key)}: [\n  {lines}\n ]")
        else:
            parts.append(f" {json.dumps(key)}: {json.dumps(value)}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
