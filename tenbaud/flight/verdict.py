"""Decides from counts whether a completed flight has really flown, and explains it.

A process that came to the end of its flight has shown nothing by that. What counts is that samples were
confirmed, that most of them brought a word, that the controller worked, that the motors had commands,
that epochs lasted, and that what should stand upright did.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tenbaud.build.flight import Agreement
from tenbaud.flight.outcome import ExitCode, NotFlown, Outcome

CONFIRMED_SHARE_MIN = 0.5
"""of the samples that the flight had time for"""
WORDS_SHARE_MIN = 0.1
"""of the confirmed samples, whose word was not erased"""
DOWN_SHARE_MAX = 0.5
"""of the ticks, with the guard at the safe voltage or on its way there"""
COMMANDED_SHARE_MIN = 0.1
"""of the ticks, with their own command"""
BAD_COMMANDS_SHARE_MAX = 0.01
"""of the commands that the controller was asked for"""
REJOINS_MIN = 10
EPOCH_SAMPLES_MIN = 20
"""This many rejoins, with fewer confirmed samples than this for each, are rejoins without end."""


@dataclass(frozen=True, slots=True)
class FlightCounts:
    """The inputs of the verdict, as far as an end knows them."""

    samples: int
    """that the flight had time for"""
    confirmed: int
    """by the transmitter from echoes; at the receiver: samples flown"""
    erased: int
    rejoins: int
    ticks: int = 0
    """0: this end does not see the motors"""
    ticks_down: int = 0
    ticks_commanded: int = 0
    bad_commands: int = 0
    """ticks at which the controller failed; the transmitter knows of none"""
    commands: int = 0
    """that the controller was asked for"""
    fell: bool = False


def faults_of(counts: FlightCounts) -> tuple[NotFlown, ...]:
    """Return the faults of a flight; none if it has flown."""
    confirmed, ticks = counts.confirmed, counts.ticks
    holds = {
        NotFlown.NEVER_LOCKED: counts.samples > 0 and confirmed == 0,
        NotFlown.REJOINING: counts.rejoins >= REJOINS_MIN
        and confirmed < EPOCH_SAMPLES_MIN * counts.rejoins,
        NotFlown.UNCONFIRMED: confirmed < CONFIRMED_SHARE_MIN * counts.samples,
        NotFlown.CONTROLLER: counts.bad_commands > BAD_COMMANDS_SHARE_MAX * counts.commands,
        NotFlown.FELL: counts.fell,
        NotFlown.GUARD_DOWN: counts.ticks_down > DOWN_SHARE_MAX * ticks,
        NotFlown.NO_COMMANDS: counts.ticks_commanded < COMMANDED_SHARE_MIN * ticks,
        NotFlown.NO_WORDS: confirmed - counts.erased < WORDS_SHARE_MIN * confirmed,
    }
    return tuple(fault for fault, applies in holds.items() if applies)


def verdict(
    counts: FlightCounts, agreement: Agreement, asked: Mapping[str, int] | None = None
) -> Outcome | None:
    """Return the outcome of a flight that went to its end without flying; None: it has flown.

    `asked`: how often a new epoch was asked for, by reason.
    """
    faults = faults_of(counts)
    if not faults:
        return None
    return Outcome(ExitCode.NOT_FLOWN, verdict_text(faults, counts, agreement, asked or {}), faults)


def verdict_text(
    faults: tuple[NotFlown, ...], counts: FlightCounts, agreement: Agreement, asked: Mapping[str, int]
) -> str:
    """Return the verdict with its numbers and a remedy, for people."""
    numbers = [f"{counts.confirmed} of {counts.samples} samples confirmed"]
    numbers.append(f"{counts.erased} of these erased")
    if counts.ticks:
        numbers.append(f"guard down for {counts.ticks_down / counts.ticks:.0%} of the flight")
        numbers.append(
            f"a command in time for {counts.ticks_commanded / counts.ticks:.0%} of the ticks"
        )
    reasons = ", ".join(f"{why} {number}" for why, number in asked.items())
    if counts.bad_commands:
        numbers.append(f"no command from the controller at {counts.bad_commands} ticks")
    numbers.append(f"{counts.rejoins} rejoins" + (f" (asked for: {reasons})" if reasons else ""))
    lines = [f"the flight did not fly ({', '.join(faults)}): " + ", ".join(numbers)]
    # One fault causes others: the remedy is that of the first fault that has one.
    lines += [ADVICE[fault](agreement) for fault in faults if fault in ADVICE][:1]
    return "\n  ".join(lines)


def _on_words(flight: Agreement) -> str:
    allowance_s = flight.terms.deadline_allowance_ns / 1e9
    spread_s = 2 * flight.faults.up.jitter_ns / 1e9
    if spread_s > allowance_s:
        return (
            f"symbols spread by {spread_s:g} s on this line, and one that is more than "
            f"channel.deadline_allowance_s = {allowance_s:g} late is erased: set it to at "
            f'least {spread_s:g} at both ends, and leave timing.lead_ticks at "auto"'
        )
    return (
        "nearly all symbols are lost, or later than channel.deadline_allowance_s = "
        f"{allowance_s:g} allows: look at the uplink, or raise it at both ends"
    )


DOWN_SYMBOLS = (
    "too few down symbols come, or too many are flipped, to tell what the receiver consumed: look at "
    "the downlink; where it loses some, raise channel.downlink_baud at both ends, so that more of them "
    "are hash symbols"
)


def _on_commands(flight: Agreement) -> str:
    if flight.terms.is_mirrored:
        return DOWN_SYMBOLS  # its commands wait for no line: they stop when nothing is confirmed
    tick_s = flight.terms.tick_ns / 1e9
    return (
        f"the command lead is {flight.terms.lead_ticks * tick_s:g} s, the watchdog "
        f"{flight.watchdog_ticks * tick_s:g} s, and the configuration knows of a round trip of "
        f"{flight.trip.longest_ticks * tick_s:g} s; if the line takes longer, "
        "raise timing.lead_ticks (--lead) at both ends to what it takes, and leave "
        'transmitter.watchdog_s at "auto"'
    )


def _on_rejoins(flight: Agreement) -> str:
    if flight.terms.is_mirrored:
        return DOWN_SYMBOLS
    if flight.terms.is_narrow:
        return f"{DOWN_SYMBOLS}; {_on_commands(flight)}"
    return (
        f"each command frame repeats channel.repeats = {flight.terms.repeats} samples: raise it at "
        "both ends if command frames are lost; " + _on_commands(flight)
    )


def _on_controller(_: Agreement) -> str:
    return (
        "the last command was held at these ticks: a command is a tuple with one finite number for "
        "each input, and an exception counts as none"
    )


def _on_fall(_: Agreement) -> str:
    return (
        "the pendulum went beyond 90 degrees from upright: raise the rate (channel.rate_baud) at both "
        "ends; `tenbaud floor` tells how much the plant needs"
    )


ADVICE: Mapping[NotFlown, Callable[[Agreement], str]] = {
    NotFlown.CONTROLLER: _on_controller,
    NotFlown.FELL: _on_fall,
    NotFlown.NO_WORDS: _on_words,
    NotFlown.NO_COMMANDS: _on_commands,
    NotFlown.REJOINING: _on_rejoins,
    NotFlown.GUARD_DOWN: _on_commands,
    NotFlown.UNCONFIRMED: _on_rejoins,
}
