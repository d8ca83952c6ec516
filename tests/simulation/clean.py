"""A long clean flight through two processes: nothing goes wrong, and nothing may differ."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

SAMPLE_S = 0.02


def fly_clean(symbols: int) -> dict[str, Any]:
    """Fly `symbols` symbols over Zenoh on the virtual clock, one tick per sample; return the figures.

    Both processes take part with a recording, as in any other flight.
    """
    started = time.monotonic()
    repository = Path(__file__).parents[2]
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "tenbaud", "demo", "--json", "--mismatch", "0.1"]
        command += ["--duration", str(symbols * SAMPLE_S), "--out", str(Path(folder) / "run")]
        for setting in (
            f"timing.tick_s={SAMPLE_S}",
            f"timing.symbol_period_s={SAMPLE_S}",
            f"channel.rate_baud={1 / SAMPLE_S}",
        ):
            command += ["--set", setting]
        ended = subprocess.run(command, cwd=repository, capture_output=True, text=True, check=False)
    if not ended.stdout.strip():
        raise RuntimeError(f"the clean run left no summary:\n{ended.stderr[-2000:]}")
    summary = json.loads(ended.stdout)
    return {
        "symbols": summary["coder_bits_up"],
        "digest_checks": summary["digest_checks"],
        "desyncs": summary["desyncs"],
        "erasures": summary["erasures"],
        "exit_code": ended.returncode,
        "seconds": round(time.monotonic() - started, 1),
    }
