"""No frame whatever, good check or not, makes a session raise or harms a flight for long."""

from __future__ import annotations

from collections import Counter

import pytest

from channel.protocol.bounds import Bounds
from tests.simulation.forgeries import fly_among_forgeries, forgeries

MESSAGES = 10_000
SOAK_MESSAGES = 1_000_000
KINDS = ("hello", "welcome", "refuse", "symbol", "commands", "desync", "bye", "unknown", "claim")


def check(messages: int, seed: int, flood: bool) -> None:
    counts = forgeries(messages, seed, flood)
    assert sum(counts[f"forged {kind}"] for kind in KINDS) >= messages
    # A tenth of each kind, and fewer farewells: those that would end the flight are not sent.
    assert min(counts[f"forged {kind}"] for kind in KINDS) > messages // 50
    assert counts["out of bounds"] > messages // 100
    assert counts["rejoins"] > counts["flights"]


def test_when_frames_are_forged_with_a_good_check_then_no_end_raises_and_no_harm_lasts() -> None:
    check(MESSAGES, 1, flood=False)


@pytest.mark.soak
def test_when_a_million_frames_are_forged_then_no_end_raises_and_no_harm_lasts() -> None:
    check(SOAK_MESSAGES, 2, flood=True)


def test_when_nothing_is_out_of_bounds_then_the_harness_finds_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Bounds, "drops", lambda _bounds, _problem: False)
    with pytest.raises((ValueError, LookupError, TypeError)):
        fly_among_forgeries(1, 100.0, Counter())
