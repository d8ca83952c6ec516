"""Checks every second whether a flight keeps its configured symbol rate.

A flight whose processes are too slow continues: the slots that it misses are erasures, and this module
reports how many are kept. Symbols that the line alone has lost cause no event.
"""

from __future__ import annotations

from channel.protocol.events import Event, EventKind, Rate
from channel.protocol.terms import Terms
from transmitter.session.session import TransmitterSession

WINDOW_NS = 1_000_000_000
WINDOW_SAMPLES = 100
KEPT_SHARE = 0.95
"""Share of the slots below which the rate counts as not kept."""
OWN_SHARE = 0.01
"""Share of ticks missed by this process above which it has part in that."""
SLOW_SHARE = 0.5
"""Share of ticks with answers overdue above which the way to the receiver and back has part in it."""
SLOW_NS = 20_000_000
"""Answers, echoes or down symbols, that lag by this and by twice the command lead are overdue."""


class RateWatch:
    """Compares the symbols that the receiver took in with the slots that passed."""

    def __init__(self, terms: Terms) -> None:
        self.kept_symbols_per_s: float | None = None
        """of the last window, while the rate is not kept; None while it is"""
        self.asked_symbols_per_s = 1e9 * terms.symbols_per_word / terms.sample_ns
        self._terms = terms
        window = max(WINDOW_NS, WINDOW_SAMPLES * terms.sample_ns)
        self._window_ticks = -(-window // terms.sample_ns) * terms.ticks_per_sample
        lead = -(-2 * terms.lead_ticks // terms.ticks_per_sample) + 1
        self._lag_usual = terms.samples_in(SLOW_NS, lead)
        self._from_tick: int | None = None
        self._received = 0
        self._looks = 0
        self._slow = 0

    def look(self, tick: int, session: TransmitterSession) -> Event | None:
        """Take one flown tick; return the event to report, if any."""
        if self._from_tick is None:
            self._begin(tick, session)
        self._looks += 1
        self._slow += session.lag_samples > self._lag_usual
        if tick - (self._from_tick or 0) < self._window_ticks:
            return None
        event = self._judge(tick - (self._from_tick or 0), session)
        self._begin(tick, session)
        return event

    def _begin(self, tick: int, session: TransmitterSession) -> None:
        self._from_tick, self._looks, self._slow = tick, 0, 0
        self._received = _received(session)

    def _judge(self, ticks: int, session: TransmitterSession) -> Event | None:
        samples = ticks / self._terms.ticks_per_sample
        share = (_received(session) - self._received) / samples
        missed = 1.0 - self._looks / ticks
        slow = self._slow / self._looks
        before, self.kept_symbols_per_s = self.kept_symbols_per_s, None
        if share >= KEPT_SHARE or (missed <= OWN_SHARE and slow <= SLOW_SHARE):
            return None if before is None else Event(EventKind.RATE, cause=Rate.KEPT)
        self.kept_symbols_per_s = share * self.asked_symbols_per_s
        if before is not None:
            return None
        return Event(
            EventKind.RATE,
            cause=Rate.MISSED,
            value=self.kept_symbols_per_s,
            limit=self.asked_symbols_per_s,
            missed_share=missed,
            overdue_share=slow,
        )


def _received(session: TransmitterSession) -> int:
    """Return how many samples the receiver says it has received whole."""
    return session.counts["confirmed"] - session.counts["erasures"]
