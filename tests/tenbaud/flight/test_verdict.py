"""Whether a flight that went to its end has flown."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tenbaud.build.flight import Agreement, agree
from tenbaud.config.load import load_config, nested
from tenbaud.flight.outcome import NotFlown
from tenbaud.flight.verdict import FlightCounts, faults_of, verdict_text

GOOD = FlightCounts(
    samples=600, confirmed=600, erased=60, rejoins=2, ticks=6000, ticks_down=100, ticks_commanded=5900
)


def flight(**settings: object) -> Agreement:
    lead = {"timing.lead_ticks": 60, "transmitter.watchdog_s": 0.5}
    return agree(load_config(overrides=nested(lead | settings)), "real")


def test_when_a_flight_has_flown_then_nothing_is_found() -> None:
    assert faults_of(GOOD) == ()
    assert faults_of(FlightCounts(samples=0, confirmed=0, erased=0, rejoins=0)) == ()


@pytest.mark.parametrize(
    ("changes", "still_flown", "fault"),
    [
        ({"confirmed": 299, "erased": 0}, {"confirmed": 300, "erased": 0}, NotFlown.UNCONFIRMED),
        ({"rejoins": 31}, {"rejoins": 30}, NotFlown.REJOINING),
        ({"rejoins": 10, "samples": 199, "confirmed": 199}, {"rejoins": 9, "samples": 100,
          "confirmed": 100}, NotFlown.REJOINING),
        ({"ticks_down": 3001}, {"ticks_down": 3000}, NotFlown.GUARD_DOWN),
        ({"ticks_commanded": 599}, {"ticks_commanded": 600}, NotFlown.NO_COMMANDS),
        ({"erased": 541}, {"erased": 540}, NotFlown.NO_WORDS),
        ({"bad_commands": 61, "commands": 6000}, {"bad_commands": 60, "commands": 6000},
         NotFlown.CONTROLLER),
        ({"fell": True}, {"fell": False}, NotFlown.FELL),
    ],
)  # fmt: skip
def test_when_one_count_is_beyond_its_bound_then_that_is_the_fault(
    changes: dict[str, int], still_flown: dict[str, int], fault: NotFlown
) -> None:
    assert faults_of(replace(GOOD, **changes)) == (fault,)
    assert faults_of(replace(GOOD, **still_flown)) == ()


def test_when_no_sample_was_confirmed_then_it_never_locked() -> None:
    faults = faults_of(replace(GOOD, confirmed=0, erased=0))
    assert faults == (NotFlown.NEVER_LOCKED, NotFlown.UNCONFIRMED)


def test_when_an_end_does_not_see_the_motors_then_it_does_not_judge_them() -> None:
    assert faults_of(replace(GOOD, ticks=0, ticks_down=0, ticks_commanded=0)) == ()


@pytest.mark.parametrize("fault", [NotFlown.NO_COMMANDS, NotFlown.REJOINING, NotFlown.UNCONFIRMED])
def test_when_the_law_is_mirrored_then_no_longer_lead_is_advised(fault: NotFlown) -> None:
    narrow = {"channel.downlink": "narrow", "timing.lead_ticks": "auto"}
    advice = verdict_text((fault,), GOOD, flight(**narrow), {}).splitlines()[-1]
    assert "look at the downlink" in advice
    assert "timing.lead_ticks" not in advice
    coded = flight(**narrow | {"downlink.scheme": "coded"})
    assert "timing.lead_ticks" in verdict_text((fault,), GOOD, coded, {})


def test_when_it_is_reported_then_with_its_numbers_and_what_to_change() -> None:
    endless = replace(GOOD, confirmed=101, erased=0, rejoins=99, ticks_down=4860, ticks_commanded=1010)
    faults = faults_of(endless)
    text = verdict_text(faults, endless, flight(), {"desync": 1, "guard": 98})
    assert text.splitlines() == [
        "the flight did not fly (rejoins without end, too few samples confirmed, guard down): "
        "101 of 600 samples confirmed, 0 of these erased, guard down for 81% of the flight, "
        "a command in time for 17% of the ticks, 99 rejoins (asked for: desync 1, guard 98)",
        "  each command frame repeats channel.repeats = 2 samples: raise it at both ends if command "
        "frames are lost; the command lead is 0.6 s, the watchdog 0.5 s, and the configuration knows "
        "of a round trip of 0.03 s; if the line takes longer, raise timing.lead_ticks (--lead) at both "
        'ends to what it takes, and leave transmitter.watchdog_s at "auto"',
    ]


@pytest.mark.parametrize(
    ("impairments", "advice"),
    [
        ("", "nearly all symbols are lost"),
        ("up:delay=0.3s±0.3s", "set it to at least 0.6 at both ends"),
    ],
)
def test_when_no_words_come_then_the_advice_follows_from_the_line(
    impairments: str, advice: str
) -> None:
    deaf = replace(GOOD, erased=600)
    line = flight(
        **{
            "link.impairments": impairments,
            "timing.lead_ticks": "auto",
            "transmitter.watchdog_s": "auto",
        }
    )
    text = verdict_text(faults_of(deaf), deaf, line, {})
    assert advice in text
