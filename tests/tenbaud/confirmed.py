"""What a summary of a flight on the real clock must say however busy the machine was.

A process that is held up misses ticks, and a sample whose first tick is missed has no symbol. A symbol
that is held up comes after its slot was erased. Both are counted, so the sums below are exact; each
sample is confirmed by an equal digest all the same. Only when commands stay away for the watchdog's
time, half a second where a test does not set `PATIENT`, the guard stops and a rejoin skips samples.
"""

from __future__ import annotations

from typing import Any

import pytest

Summary = dict[str, Any]

PATIENT = ("--set", "transmitter.watchdog_s=30")
"""For a flight that is not about the guard: no pause of a process ends an epoch."""


def check_flown(summary: Summary, samples: int, receiver: Summary | None = None, bits: int = 1) -> None:
    """Check that all samples of a flight without faults of its line were confirmed.

    `receiver`: the receiver's summary, where it is not joined to the transmitter's; `bits` of a word.
    """
    assert summary["desyncs"] == 0
    if summary["rejoins"]:
        assert summary["guard_rearmed"] == summary["rejoins"], summary["rejoins_asked"]
        assert summary["commands_late"] > 0
        assert summary["digest_checks"] < samples
        return
    flown = summary["samples"]
    assert summary["digest_checks"] == flown >= samples
    if flown > samples:  # held up at its end: the receiver, by its own clock, went on meanwhile
        assert summary["ticks_missed"] > 0
    unsent = summary["words_missed"] + summary["symbols_refused"]
    symbols = flown * bits - unsent
    assert summary["coder_bits_up"] == symbols, "one bit for each symbol that was sent"
    if summary["link"] != "serial":  # a byte that is late by several slots may be taken for another's
        assert summary["erasures"] == unsent + (receiver or summary)["symbols_late"]


def held_up(summary: Summary) -> str | None:
    """Return how a busy machine made this flight another one; None: it did not."""
    names = ("ticks_missed", "words_missed", "symbols_refused", "commands_late", "erasures", "rejoins")
    counted = {name: summary[name] for name in names if summary[name]}
    return ", ".join(f"{name} {number}" for name, number in counted.items()) or None


def need_idle(summary: Summary) -> None:
    """Skip the rest of a test, which holds for processes that keep their times only."""
    if (why := held_up(summary)) is not None:
        pytest.skip(f"the machine was too busy for the flight's times: {why}")
