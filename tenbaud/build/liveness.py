"""Checks that lead, delays and watchdog allow a flight to recover from every loss of lockstep.

`agree` checks this for every configuration, so that one that cannot fly is refused, with numbers,
instead of requesting new epochs for ever. `docs/RELIABILITY.md` has the reasoning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from channel.line.impairments import LineFaults
from channel.protocol.terms import Clock, Terms

AUTO_SAMPLES = 5
AUTO_LEAST_S = 0.1
AUTO_MARGIN_SAMPLES = 2
"""The automatic watchdog: this many sample periods, but at least this long, and long enough for a
request for a new epoch and its answer, one of which may be lost."""


@dataclass(frozen=True, slots=True)
class RoundTrip:
    """From the first tick of a sample to the arrival of its commands, in ticks."""

    in_time_ticks: int
    """nothing erased, and the line as slow as it can be"""
    longest_ticks: int
    """the same, and the symbol is given up at its deadline"""


def round_trip(terms: Terms, faults: LineFaults, clock: Clock) -> RoundTrip:
    """Return the round trip that terms and line allow."""
    delay_ns = faults.longest_delay_ns
    if terms.is_narrow:
        heard_ns = terms.heard_ns + delay_ns
        return RoundTrip(_ticks(heard_ns - terms.downlink_budget_ns, terms), _ticks(heard_ns, terms))
    line_ns = terms.uplink_delivery_ns + terms.uplink_line_ns + terms.downlink_line_ns
    ideal = clock == "virtual" and terms.lead_ticks == 0 and terms.uplink_delivery_ns == 0
    needed_ticks = 0 if ideal else terms.lead_needed_ticks
    return RoundTrip(_ticks(line_ns + delay_ns, terms), needed_ticks + _ticks(delay_ns, terms))


def overtaking_ticks(terms: Terms, faults: LineFaults) -> int:
    """Return how long after a command frame one may come that was sent before it."""
    down = faults.down
    return _ticks(2 * down.jitter_ns + (down.reorder_ns if down.reorder else 0), terms)


def watchdog_ticks(wanted_s: float | None, terms: Terms, trip: RoundTrip) -> int:
    """Return the watchdog's time-out; `wanted_s` is None where it is chosen automatically."""
    if wanted_s is not None:
        return max(1, math.ceil(wanted_s * 1e9 / terms.tick_ns - 1e-9))
    per_sample = terms.ticks_per_sample
    # A lead says how long a round trip may be, also on a line of which nothing else is known.
    rejoin_ticks = max(terms.lead_ticks, trip.longest_ticks) + AUTO_MARGIN_SAMPLES * per_sample
    return max(AUTO_SAMPLES * per_sample, _ticks(round(AUTO_LEAST_S * 1e9), terms), rejoin_ticks)


def check_liveness(wanted_s: float | None, terms: Terms, trip: RoundTrip) -> None:
    """Raise ValueError, with what was set, what the least is and what to set, where nothing can fly."""
    tick_ms = terms.tick_ns / 1e6
    trip_samples = trip.longest_ticks / terms.ticks_per_sample
    if trip_samples > terms.history_samples:
        raise ValueError(
            f"the round trip takes up to {trip.longest_ticks * tick_ms:g} ms, which is "
            f"{trip_samples:.1f} samples; both ends remember {terms.history_samples}, so every echo "
            "would come too late: shorten it to "
            f"{terms.history_samples * terms.sample_ns / 1e6:g} ms, or lengthen timing.symbol_period_s"
        )
    last_ticks = terms.lead_ticks + terms.ticks_per_sample - 1
    if trip.in_time_ticks > last_ticks and not terms.is_mirrored:
        raise ValueError(
            f"lead_ticks = {terms.lead_ticks} is too short for this line: commands come up to "
            f"{trip.in_time_ticks} ticks ({trip.in_time_ticks * tick_ms:g} ms) after the sample they "
            f"rest on, and the last of them is due after {last_ticks}, so the motors would go without; "
            f'set lead_ticks to at least {trip.longest_ticks}, or to "auto"'
        )
    least_ticks = max(0, trip.longest_ticks - terms.lead_ticks) + 1
    if wanted_s is None or watchdog_ticks(wanted_s, terms, trip) >= least_ticks:
        return
    raise ValueError(
        f"transmitter.watchdog_s = {wanted_s:g} is too short: with lead_ticks = {terms.lead_ticks} and "
        f"a round trip of up to {trip.longest_ticks} ticks of {tick_ms:g} ms, commands may be "
        f"{least_ticks - 1} ticks late on a line that loses nothing, and the watchdog would trip in "
        f"every epoch; set it to at least {least_ticks * terms.tick_ns / 1e9:g}, set lead_ticks to at "
        f'least {trip.longest_ticks}, or leave it at "auto" '
        f"({watchdog_ticks(None, terms, trip) * terms.tick_ns / 1e9:g})"
    )


def _ticks(time_ns: int, terms: Terms) -> int:
    return -(-time_ns // terms.tick_ns)
