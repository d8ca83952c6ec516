"""What a transmitter does when a receiver that it does not fly with asks for its flight.

A receiver that hears symbols of a session which it does not know says so (`Unknown`). That is the
receiver of this flight, started again, or a second one that has no business here. The first has lost
the session, so its commands have stopped coming; while they do come, whoever asks is a second one and
is refused. To take over on purpose takes a `Claim`, and the new receiver's session: answers of any
other are left alone until the new one has answered, refused or let the time pass.
"""

from __future__ import annotations

from channel.protocol.terms import Terms

SILENT_SAMPLES = 2
"""No command for so long: the receiver has lost the session, and whoever says so is believed."""
ALIVE_COMMANDS = 3
"""So many commands since somebody else asked prove that the receiver still flies."""
SUCCESSOR_SAMPLES = 3
"""How long a receiver that takes over has for its answer, beside the command lead, which is as long as
a round trip: short enough that the present one can go on before the watchdog has had enough."""


class Takeover:
    """Judges receivers that are not the present one; times are ticks."""

    def __init__(self, terms: Terms) -> None:
        self._terms = terms
        self._asked = False
        self._commands_since = 0
        self._successor: int | None = None
        self._until_tick = 0

    def on_command(self) -> None:
        """Note that the present receiver has sent something new."""
        self._commands_since += 1

    def is_lost(self, tick: int, heard_tick: int) -> bool:
        """Return whether the present receiver has been silent for long enough to have lost us."""
        return tick - heard_tick >= SILENT_SAMPLES * self._terms.ticks_per_sample

    def is_second(self) -> bool:
        """Note that somebody does not know our session; return whether that is a second receiver."""
        if not self._asked:
            self._asked, self._commands_since = True, 0
            return False
        if self._commands_since < ALIVE_COMMANDS:
            return False
        self._asked = False
        return True

    def name_successor(self, session: int, tick: int) -> None:
        """From now on only this session's answer counts, for a while."""
        self._successor = session
        patience = SUCCESSOR_SAMPLES * self._terms.ticks_per_sample + self._terms.lead_ticks
        self._until_tick = tick + patience

    def successor(self, tick: int) -> int | None:
        """Return the session that is taking over, if one is."""
        if self._successor is not None and tick >= self._until_tick:
            self._successor = None
        return self._successor

    def settle(self) -> None:
        """Forget who asked: a session begins, or the one that was to take over does not."""
        self._successor = None
        self._asked = False
