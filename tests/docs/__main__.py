"""Lists the command blocks of the pages and how each is run: `python -m tests.docs`."""

from __future__ import annotations

from tests.docs.blocks import blocks_of, pages

if __name__ == "__main__":
    for page in pages():
        for block in blocks_of(page):
            if not block.runs:
                continue
            how = f"not run: {block.skip}" if block.skip else "run"
            how = f"long tests only: {block.soak}" if block.soak and not block.skip else how
            first = block.script.strip().splitlines()[0]
            print(f"{block.name:40} {how}\n    {first}")
