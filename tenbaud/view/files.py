"""The folder of the page's own scripts, styles and pictures."""

from pathlib import Path

STATIC = Path(__file__).parent / "static"
