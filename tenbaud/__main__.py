"""Makes `python -m tenbaud` equal to `tenbaud`."""

from __future__ import annotations

from tenbaud.cli.app import main

if __name__ == "__main__":
    main()
