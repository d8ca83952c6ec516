"""The tick from which commands are due: where the watchdog begins to count in an epoch.

A new epoch begins a command lead ahead, and its first command is decided for a lead after that. Until
then none can come, however healthy the line is: a watchdog that counted these ticks would trip in every
epoch whose lead reaches its time-out, ask for another epoch, and never see a command. So nothing is
owed before the first tick whose command is decided in the epoch, or whose command could be there if the
answer came late.

That pause has two bounds, for the motors hold their last voltage in it. An epoch that claims to begin
later than a healthy one can is owed commands as if it began then. And after `PAUSES_MAX` epochs in a
row that brought no command the next gets no pause: the watchdog counts on. The epoch that follows
a trip of the watchdog always has one, so that some attempt is always given its full time.
"""

from __future__ import annotations

from channel.protocol.frames import Why
from channel.protocol.terms import Terms

PAUSES_MAX = 4


class Owing:
    """Knows when commands are owed; times are ticks."""

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._since_tick = terms.lead_ticks
        """first tick that is owed a command decided in the present epoch"""
        self._pauses = 0
        """in a row, without a command between them"""
        self.counts_on = False
        """whether the present epoch has no pause"""

    def owed_ticks(self, tick: int) -> int:
        """Return for how many ticks, up to this one, commands are owed; 0: none is yet."""
        return max(0, tick - self._since_tick + 1)

    def on_confirmed(self) -> None:
        self._pauses = 0

    def begin(self, epoch_tick: int, tick: int, why: Why) -> int:
        """Begin an epoch, agreed on at `tick`; return for how many ticks its first command is held.

        That is the command lead, or 0 where the watchdog counts on.
        """
        lead, per_sample = self._terms.lead_ticks, self._terms.ticks_per_sample
        if why in (Why.START, Why.GUARD):
            self._pauses = 0
        self.counts_on = self._pauses >= PAUSES_MAX
        if self.counts_on:
            return 0
        self._pauses += 1
        if why is Why.START:
            # The flight's time begins with the epoch, whenever the answer comes.
            self._since_tick = epoch_tick + lead
            return lead
        next_sample_tick = (tick // per_sample + 1) * per_sample
        # A request names the sample after it, the answer adds the lead in whole samples.
        latest_tick = next_sample_tick + lead + per_sample
        self._since_tick = min(max(epoch_tick, next_sample_tick), latest_tick) + lead
        return lead
