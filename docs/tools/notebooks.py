"""Runs the example notebooks from top to bottom and keeps their outputs.

python docs/tools/notebooks.py [NAME ...]
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import nbformat
from nbclient import NotebookClient

TOP = Path(__file__).resolve().parents[2]
EXAMPLES = TOP / "examples"
TIMEOUT_S = 240
DATED = re.compile(r"\d{4}-\d\d-\d\dT\d\d-\d\d-\d\d_")
"""Beginning of the name of a run's folder."""


def executed(path: Path, folder: Path) -> Any:
    """Return a notebook with the outputs of running it in a folder, without what differs each time."""
    notebook = nbformat.read(path, as_version=4)
    os.environ["PYTHONPATH"] = os.pathsep.join([str(TOP), os.environ.get("PYTHONPATH", "")])
    NotebookClient(
        notebook,
        timeout=TIMEOUT_S,
        kernel_name="python3",
        resources={"metadata": {"path": str(folder)}},
        record_timing=False,
    ).execute()
    notebook.metadata.language_info = {"name": "python"}
    for output in outputs_of(notebook):
        if "text" in output:
            output["text"] = DATED.sub("", output["text"])
        for kind, text in output.get("data", {}).items():
            if kind.startswith("text/"):
                output["data"][kind] = DATED.sub("", text)
    return notebook


def outputs_of(notebook: Any) -> list[Any]:
    """Return all outputs, in the order of the cells."""
    return [output for cell in notebook.cells for output in cell.get("outputs", [])]


if __name__ == "__main__":
    for one in sorted(EXAMPLES.glob("*.ipynb")):
        if not sys.argv[1:] or one.stem in sys.argv[1:]:
            with TemporaryDirectory() as place:
                nbformat.write(executed(one, Path(place)), one)
            print(f"written: {one.relative_to(TOP)}")
