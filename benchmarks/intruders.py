"""Effect of refused connections on a flight: `python -m benchmarks.intruders` (as root, in namespaces).

Two flights over TLS, one left alone and one with connection attempts from a third machine, at the rate
that Zenoh takes; prints the loop lateness of both.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.network.test_intruders import ATTEMPTS_PER_S, flown_under


def main() -> None:
    """Measure and print one JSON object."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--attempts", type=int, default=400)
    attempts = parser.parse_args().attempts
    seconds = attempts / ATTEMPTS_PER_S
    with TemporaryDirectory(prefix="tenbaud-bench-") as folder:
        quiet, _ = flown_under(0, seconds, Path(folder) / "quiet")
        attacked, lower = flown_under(attempts, seconds, Path(folder) / "attacked")
    late = quiet["loop_late_ms_p99"], attacked["loop_late_ms_p99"]
    figures = {
        "attempts": attempts,
        "refused": lower["connections_refused"],
        "quiet_loop_late_ms_p99": late[0],
        "attacked_loop_late_ms_p99": late[1],
        "ratio": round(late[1] / late[0], 3),
        "rejoins": attacked["rejoins"],
        "commands_late": attacked["commands_late"],
    }
    print(json.dumps(figures, indent=2))


if __name__ == "__main__":
    main()
