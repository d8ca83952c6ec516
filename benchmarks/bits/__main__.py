"""Compares the bits of this machine's places, and writes the table of docs/RELIABILITY.md anew.

It takes about ten minutes; with `--quick` it is for a look.
"""

from __future__ import annotations

import argparse
import sys
import time

from benchmarks.bits.places import PLACES, Amount, Found, Place, PlaceFailed, differences
from benchmarks.reliability import PAGE, replaced

LONG, QUICK = Amount(100_000, 10_000), Amount(2_000, 200)
HEAD = ["where", "golden vectors", "codecs flown", "samples", "flights or files that differ"]


def compared(place: Place, amount: Amount, expected: Found) -> tuple[list[str], list[str]]:
    """Run a place; return its row of the table and what differs."""
    missing = place.missing()
    if missing is not None:
        return [place.title, f"not run: {missing}", "", "", ""], []
    try:
        found = place.run(amount)
    except PlaceFailed as failure:
        return [place.title, "failed", "", "", ""], [str(failure)]
    differing = differences(expected, found, amount)
    row = [
        place.title,
        ", ".join(found.golden),
        str(len(found.flights)),
        f"{sum(amount.of(name) for name in found.flights):,}".replace(",", " "),
        str(len(differing)),
    ]
    return row, differing


def main() -> int:
    """Run the places, print the table; return 1 where a bit differs."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="short flights; shows only")
    parser.add_argument("--samples", type=int, help="samples of the paper's codec; shows only")
    parser.add_argument("places", nargs="*", help=", ".join(PLACES))
    options = parser.parse_args()
    unknown = sorted(set(options.places) - set(PLACES))
    if unknown:
        parser.error(f"no place {', '.join(unknown)}; there are {', '.join(PLACES)}")
    amount = QUICK if options.quick else LONG
    if options.samples is not None:
        amount = Amount(options.samples, max(10, options.samples // 10))
    if amount.samples < 100 or amount.samples % 100:
        parser.error("--samples is a multiple of 100")
    expected = PLACES["python"].run(amount)
    rows, faults = [HEAD], 0
    for name in options.places or PLACES:
        started = time.monotonic()
        row, differing = compared(PLACES[name], amount, expected)
        rows.append(row)
        print("  ".join(row), f" {time.monotonic() - started:.0f} s", flush=True)
        for text in differing:
            print(f"    {text}", file=sys.stderr)
        faults += len(differing)
    if amount == LONG and not options.places and not faults:
        PAGE.write_text(replaced(PAGE.read_text(encoding="utf-8"), "places", rows), encoding="utf-8")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
