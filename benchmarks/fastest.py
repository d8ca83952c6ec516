"""The fastest symbol rate at which two processes fly in real time: one tick per symbol."""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.figures import Figure
from benchmarks.flights import demo_summary

LEAD_TICKS = 5
RATES = (1000, 2000)
SECONDS = 15.0


def fastest_figures(rates: tuple[int, ...] = RATES, seconds: float = SECONDS) -> Iterator[Figure]:
    """Yield late commands, missed ticks and erasures at each rate, both ends recording."""
    for rate in rates:
        summary = fly_at(rate, seconds)
        ticks = summary["samples"]
        asked = "below 0.1" if rate == RATES[0] else ""
        yield from (
            Figure(
                f"fastest_{rate}_late_commands_percent",
                100.0 * summary["commands_late"] / ticks,
                "% of ticks",
                asked,
            ),
            Figure(f"fastest_{rate}_baud_measured", summary["baud_measured"], "baud", f"{rate}"),
            Figure(f"fastest_{rate}_ticks_missed", summary["ticks_missed"], f"of {ticks}"),
            Figure(f"fastest_{rate}_erasures", summary["erasures"], f"of {ticks}"),
            Figure(f"fastest_{rate}_desyncs", summary["desyncs"], "", "0"),
            Figure(f"fastest_{rate}_loop_late_ms_p99", summary["loop_late_ms_p99"], "ms"),
        )


def fly_at(rate: int, seconds: float) -> dict[str, float]:
    """Fly at a rate with N = 1 and D = 5; of the lead, three fifths wait for the symbol."""
    tick_s = 1.0 / rate
    settings = {
        "timing.tick_s": tick_s,
        "timing.symbol_period_s": tick_s,
        "timing.lead_ticks": LEAD_TICKS,
        "channel.rate_baud": float(rate),
        "channel.deadline_allowance_s": 3 * tick_s,
        "channel.downlink_budget_s": 2 * tick_s,
        "coder.window_signs": 3,
    }
    arguments = [text for name, value in settings.items() for text in ("--set", f"{name}={value}")]
    flight = ("--clock", "real", "--duration", str(seconds), "--mismatch", "0.1")
    return demo_summary(*flight, *arguments)
